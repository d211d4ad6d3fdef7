"""The examples of the documentation run, in the order of the page."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT


@pytest.mark.parametrize("page", ["docs/python.md"])
def test_examples_run(page: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("scenarios", "robots"):
        (folder / name).symlink_to(ROOT / name)
    monkeypatch.chdir(folder)
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.M | re.S)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)


def test_search_of_gaits_prints_the_speeds_of_the_page(tmp_path: Path) -> None:
    page = (ROOT / "docs/gymnasium.md").read_text(encoding="utf-8")
    program, printed = re.findall(r"^```(?:python|text)\n(.*?)^```", page, re.M | re.S)[:2]
    script = tmp_path / "search.py"
    script.write_text(program, encoding="utf-8")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, cwd=ROOT)
    assert (done.stdout, done.stderr) == (printed, "")
