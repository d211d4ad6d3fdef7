"""Opens the page of `ci/playground` in Chromium, and runs scenarios there.

Usage: page_check.py PAGE PROGRAM

Fingerprints are compared with those of the program. No request leaves the page.
"""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.append(str(ROOT / "twin/view/tests"))

from reader import WIDTHS, Reader, chromium  # noqa: E402

# Workers and pages that the page makes are its own.
PLACES = ("file:", "blob:")

# A trot, boards on a bus, and the full dynamics with impacts.
SCENARIOS = ["trot", "bench-stall", "leg-drop"]
# A run long enough to be stopped.
LONG = "trot-damped"


def fingerprint(program, name):
    command = [program, "run", f"scenarios/{name}.toml", "--json", "--no-record"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=False)
    return json.loads(done.stdout)["fingerprint"]


def choose(page, name):
    page.locator("#scenario").select_option(name)


def check_runs(page, program):
    """The digits are those of the program, also under the keyboard, and the frame has the run."""
    for name in SCENARIOS:
        choose(page, name)
        page.locator("#text").press("Control+Enter")
        expected = fingerprint(program, name)
        page.locator("#result .fingerprint", has_text=expected).wait_for()
        assert page.locator("#result .pass").count() == 1, name
        frame = page.frame_locator("#page")
        frame.locator("html[data-ready]").wait_for(state="attached")
        assert expected in frame.locator("body").inner_text(), name
        assert page.locator("#save-page").get_attribute("download") == f"{name}.html"


def check_mistakes(page):
    """A mistake is shown at its line while one writes, and is gone when it is mended."""
    choose(page, "trot")
    text = page.locator("#text")
    right = text.input_value()
    line = right[: right.index("duration")].count("\n") + 1
    text.fill(right.replace("duration", "durration", 1))
    wrong = page.locator("#lines .wrong")
    wrong.wait_for()
    before = wrong.evaluate("(it) => [it.textContent, it.previousSibling.textContent]")
    assert [int(it) for it in before] == [line, line - 1], before
    shown = page.locator("#mistake pre").inner_text()
    assert "did you mean `duration`" in shown, shown
    page.get_by_role("button", name=f"go to line {line}").click()
    at = page.evaluate("document.getElementById('text').selectionStart")
    assert right[:at].count("\n") + 1 == line and right[at:].startswith("duration"), at
    page.locator("#run").click()
    page.locator("#status", has_text="not run").wait_for()
    assert not page.locator("#page").is_visible()
    # It outlasts the page.
    page.reload()
    page.wait_for_selector("html[data-ready]")
    assert "durration" in text.input_value()
    page.locator("#lines .wrong", has_text=str(line)).wait_for()
    page.locator("#reset").click()
    page.locator("#mistake").wait_for(state="hidden")
    assert text.input_value() == right


def check_stop(page, program):
    """A run is stopped in the middle, and the next one is whole."""
    choose(page, LONG)
    page.locator("#run").click()
    page.wait_for_function("document.getElementById('progress').value > 0")
    page.locator("#stop").click()
    page.locator("#status", has_text="stopped").wait_for()
    assert page.evaluate("document.getElementById('progress').value") < 1
    check_runs(page, program)


def check(page_path, program, browser):
    address = page_path.as_uri()
    reader = Reader(browser, address, places=PLACES)
    check_runs(reader.page, program)
    check_mistakes(reader.page)
    check_stop(reader.page, program)
    reader.close()
    for width, scheme in zip(WIDTHS, ["dark", "light", "dark"]):
        reader = Reader(browser, address, width=width, scheme=scheme, places=PLACES)
        wide = reader.page.evaluate("document.documentElement.scrollWidth")
        assert wide <= width, f"{wide} px on a screen of {width}"
        reader.close()


def main():
    page_path, program = (Path(word).resolve() for word in sys.argv[1:3])
    with chromium() as browser:
        check(page_path, program, browser)
    size = page_path.stat().st_size / 1e6
    print(f"playground: {len(SCENARIOS)} runs, mistakes, stop and screens; a page of {size:.2f} MB")


if __name__ == "__main__":
    main()
