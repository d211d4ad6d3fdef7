"""Tables of notebooks: every object that is shown has one, and its texts are escaped."""

from __future__ import annotations

import xml.etree.ElementTree as Xml
from pathlib import Path

import pytest
import twinrig
from test_commands import SPEC, STAND


def cells(html: str) -> list[list[str]]:
    """Return the texts of the rows of all tables, which must be well-formed."""
    rows = Xml.fromstring(f"<body>{html}</body>").iter("tr")
    return [[cell.text or "" for cell in row] for row in rows]


def test_results_are_tables(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    expect = [{"name": "a < b & c", "body": {"height": {"min": "10 cm"}}}]
    run = twinrig.run({**STAND, "expect": expect}, record=folder)
    recording = twinrig.read(run.recording or "")
    names = [row[:2] for row in cells(recording._repr_html_())]
    assert names == [["expectation", "verdict"], ["a < b & c", "pass"]]
    position = run.signals["body/position"]
    rows = cells(position._repr_html_())
    assert rows[0] == ["", "x", "y", "z"] and rows[2][0] == "last"
    assert float(rows[2][3]) == float(f"{position[-1][2]:.5g}")
    assert len(cells(position[:0]._repr_html_())) == 1
    assert ["body/position", "3", "m"] in cells(run.signals._repr_html_())
    sweep = twinrig.sweep(STAND, {**SPEC, "share": [{"of": "verdict", "min": "50 %"}]}, out=folder)
    assert ["verdict", "undecided", "3 of 3"] == cells(sweep._repr_html_())[1][:3]


def test_page_is_a_frame(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The frame has the whole page as its text; a run without a recording has none."""
    monkeypatch.chdir(folder)
    run = twinrig.run(STAND, record=folder)
    page = twinrig.page(run)
    assert page.path == (run.recording or folder).with_suffix(".html")
    (frame,) = Xml.fromstring(f"<body>{page._repr_html_()}</body>").iter("iframe")
    # A parser of XML reads a line break in an attribute as a blank.
    text = page.path.read_text(encoding="utf-8")
    assert (frame.get("srcdoc") or "").split() == text.split()
    other = twinrig.page(twinrig.read(run.recording or ""), out=folder / "other.html")
    assert other.path.read_text(encoding="utf-8") == text
    with pytest.raises(ValueError, match="has no recording"):
        twinrig.page(twinrig.run(STAND))
    with pytest.raises(twinrig.RecordingError):
        twinrig.page(folder / "none.mcap")


def test_rigs_show_their_variables() -> None:
    with twinrig.Rig("scenarios/trot.toml") as rig:
        rows = cells(rig._repr_html_())
        assert ["frequency", "Hz"] in [[row[0], row[2]] for row in rows]
    assert "closed" in rig._repr_html_()
