"""Plug-in of pytest: scenario files are collected, and each expectation is a test.

The package is apart from `twinrig` so that pytest starts without NumPy and the native module: it
imports them when it collects a scenario.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pytest_twinrig.items import ScenarioFile

PLANT = re.compile(r"^\s*(\[\s*plant\s*[.\]]|plant\s*[.=])", re.MULTILINE)
DURATION = re.compile(r"^\s*duration\s*=", re.MULTILINE)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options, each with an equivalent in the configuration file."""
    group = parser.getgroup("twinrig", "scenarios of twinrig")
    group.addoption(
        "--twin-set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="set a key of every scenario, as `twin run --set`; can be repeated",
    )
    group.addoption(
        "--twin-plant",
        metavar="MODEL",
        action="append",
        default=[],
        help="run every scenario on this plant; repeated, on each of them",
    )
    group.addoption("--twin-record", metavar="DIR", help="record every run into this folder")
    parser.addini("twin_set", "settings KEY=VALUE of every scenario", type="linelist", default=[])
    parser.addini("twin_plant", "plants for every scenario", type="args", default=[])
    parser.addini("twin_record", "folder for recordings, relative to that of this file")


def pytest_configure(config: pytest.Config) -> None:
    """Refuse options without a meaning before anything is collected."""
    for text in settings(config):
        if "=" not in text:
            raise pytest.UsageError(f"--twin-set {text}: expected KEY=VALUE")


def settings(config: pytest.Config) -> list[str]:
    """Return the settings of every scenario, those of the command line last."""
    from_file: list[str] = config.getini("twin_set")
    from_line: list[str] = config.getoption("twin_set")
    return [*from_file, *from_line]


def plants(config: pytest.Config) -> list[str]:
    """Return the plants on which every scenario runs; none for its own."""
    chosen: list[str] = config.getoption("twin_plant") or config.getini("twin_plant")
    return list(dict.fromkeys(chosen))


def recordings(config: pytest.Config) -> Path | None:
    """Return the folder for recordings."""
    from_line: str | None = config.getoption("twin_record")
    if from_line:
        return config.invocation_params.dir / from_line
    from_file: str = config.getini("twin_record")
    if not from_file:
        return None
    return (config.inipath.parent if config.inipath else config.rootpath) / from_file


def pytest_report_header(config: pytest.Config) -> list[str]:
    """Name settings and plants, which decide about the results."""
    words = [f"--twin-set {text}" for text in settings(config)]
    words += [f"--twin-plant {plant}" for plant in plants(config)]
    return ["twinrig: " + " ".join(words)] if words else []


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> ScenarioFile | None:
    """Collect scenario files; a TOML file that is named on the command line is taken for one."""
    if file_path.suffix != ".toml":
        return None
    if not (parent.session.isinitpath(file_path) or is_scenario(file_path)):
        return None
    from pytest_twinrig.items import ScenarioFile

    collected: ScenarioFile = ScenarioFile.from_parent(parent, path=file_path)
    return collected


def is_scenario(path: Path) -> bool:
    """Return whether a file has a table `plant` and a `duration`.

    A file that is not valid TOML is judged by its text: as a scenario, its mistake is reported.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False
    # Most TOML files of a project are refused here, without parsing.
    if not (PLANT.search(text) and DURATION.search(text)):
        return False
    if sys.version_info >= (3, 11):
        import tomllib
    else:  # pytest brings it there.
        import tomli as tomllib
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return True
    return isinstance(tables.get("plant"), dict) and "duration" in tables
