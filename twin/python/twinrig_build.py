"""Backend that builds the Python package: maturin, and the library of FMUs in the wheel.

An FMU is loaded by programs without Python, so that its library is one of its own, which
``twin export fmu`` finds beside the module. Both share the compiled crates, so that both have the
cargo profile of the build arguments: ``--profile dist``, or ``release`` without one. The cargo feature
``ci`` is one of both.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import maturin
from maturin import (
    build_editable,
    build_sdist,
    get_maturin_pep517_args,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

COMMAND = (
    "cargo build --locked --profile {} --package twinrig-fmu --features={} "
    "--message-format json-render-diagnostics"
)
PACKAGE = Path(__file__).parent / "python" / "twinrig"


def build_wheel(
    wheel_directory: str,
    config_settings: Mapping[str, Any] | None = None,
    metadata_directory: str | None = None,
) -> str:
    """Build the wheel, with the library in the package while it is packed."""
    built = library(*options(get_maturin_pep517_args(config_settings)))
    place = PACKAGE / built.name
    shutil.copyfile(built, place)
    try:
        wheel: str = maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
        return wheel
    finally:
        place.unlink()


def options(arguments: list[str]) -> tuple[str, str]:
    """Return the cargo profile of the arguments of maturin, and the features of the library."""
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("--profile", default="release")
    parser.add_argument("--features", default="")
    found = parser.parse_known_args(arguments)[0]
    return found.profile, "ci" if "ci" in found.features.split(",") else ""


def library(profile: str, features: str) -> Path:
    """Build the library of FMUs and return its path, which depends on cargo's configuration."""
    command = COMMAND.format(profile, features)
    try:
        done = subprocess.run(command.split(), stdout=subprocess.PIPE, text=True, check=False)
    except FileNotFoundError:
        sys.exit("the package is built with Rust, and cargo is not on the PATH: https://rustup.rs")
    if done.returncode != 0:
        sys.exit(f"`{command}` failed")
    for line in done.stdout.splitlines():
        message = json.loads(line)
        if message.get("reason") == "compiler-artifact":
            if message["target"]["name"] == "twinrig_fmu":
                return Path(message["filenames"][0])
    sys.exit(f"`{command}` made no library")
