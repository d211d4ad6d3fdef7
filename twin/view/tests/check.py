"""Opens pages of `twin report` in Chromium and checks what a reader sees.

Usage: check.py PROGRAM [--update]

The robot is compared with the samples of the recording, as read by the package `mcap`, and with
screenshots in `screens/`, which --update makes anew. Other than in a browser of a person, no
request leaves the machine: one that is made is a failure.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from PIL import Image
from reader import WIDTHS, Reader, chromium, difference

ROOT = Path(__file__).resolve().parents[3]
SCREENS = Path(__file__).with_name("screens")

# Frames of the page, every third sample of 2 ms, and the rounding of positions: 1/65534 of 2 m.
FRAME_S = 6e-3
AT_FRAME_M = 5e-5
# Poses between two frames are linear, from which a foot of 200 m/s², as at touch-down, departs by
# an eighth of that times the square of the period.
BETWEEN_FRAMES_M = 1e-3

# Instant of the screenshots.
INSTANT_S = 1.0


# Expectations that the trot violates at two instants, the later one first.
TOO_FAR = """
[[expect]]
name = "stays within 0.6 m"
signal = { name = "body/position", component = "x", always = { max = "0.6 m" } }

[[expect]]
name = "stays within 0.3 m"
signal = { name = "body/position", component = "x", always = { max = "0.3 m" } }
"""


def recorded_feet(path, instant_s):
    """Returns the positions of the feet in a recording at the sample nearest to an instant."""
    nanos = round((instant_s + 1.0) * 1e9)  # recordings begin at 1 s
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        found = reader.iter_decoded_messages(topics=["/plant"])
        sample = min(found, key=lambda it: abs(it[2].log_time - nanos))
    legs = ["lf", "rf", "lh", "rh"]
    return {leg.upper(): list(getattr(sample[3], f"leg_{leg}_foot_position")) for leg in legs}


def check_robot(reader, recording):
    """The feet of the figure are where the recording has them."""
    at_frames = [(FRAME_S * count, AT_FRAME_M) for count in [0, 67, 166, 283]]
    for instant, tolerance in [*at_frames, (INSTANT_S, BETWEEN_FRAMES_M)]:
        feet = recorded_feet(recording, instant)
        pose = reader.page.evaluate("(t) => twinrig.pose(0, t)", instant)
        assert len(pose["legs"]) == 4
        for leg in pose["legs"]:
            apart = np.abs(np.subtract(leg["points"][3], feet[leg["name"]])).max()
            assert apart < tolerance, f"{leg['name']} at {instant} s: {apart} m"


def check_screens(reader, scheme, update):
    """Robot and gait look as before; a stride later they do not."""
    for name in ["side", "perspective"]:
        selector = f"canvas[data-view={name}]"
        reader.go(INSTANT_S)
        image = reader.image(selector)
        kept = SCREENS / f"{name}-{scheme}.png"
        if update:
            image.save(kept, optimize=True)
        reader.go(INSTANT_S + 0.04)
        moved = difference(Image.open(kept), reader.image(selector))
        same = difference(Image.open(kept), image)
        # Letters of other fonts are a few pixels.
        assert same < 0.003 < moved, f"{name}, {scheme}: {same:.4f}, and {moved:.4f} once moved"


def check_controls(reader):
    """Slider, keys, events and links move the robot."""
    page = reader.page
    first = page.evaluate("twinrig.clock.events[0].at")
    reader.go(0.0)
    still = reader.image("canvas[data-view=side]")
    page.locator("#slider").focus()
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    reader.settle()
    assert abs(reader.now - 0.2) < 1e-9, reader.now
    assert difference(still, reader.image("canvas[data-view=side]")) > 0.005
    reader.go(0.0)
    page.keyboard.press(".")
    assert abs(reader.now - first) < 1e-6, "the first event"
    page.get_by_label("Event before").click()
    assert reader.now == 0.0
    link = page.locator("td a[href^='#t=']").last
    link.click()
    wanted = float(link.get_attribute("href").split("=")[1])
    page.wait_for_function("(t) => Math.abs(twinrig.clock.now - t) < 1e-9", arg=wanted)
    name = page.locator("td a[href='#expectation-1']")
    name.click()
    page.wait_for_function(
        "(text) => document.getElementById('course-title').textContent === text",
        arg=name.inner_text(),
    )
    page.keyboard.press(" ")
    page.wait_for_function("(t) => twinrig.clock.now > t", arg=reader.now)
    page.keyboard.press(" ")
    before = reader.now
    page.wait_for_timeout(100)
    assert reader.now == before, "it plays on"


def check_plots(reader):
    """A signal that is added by its name is plotted, with its values at the instant."""
    page = reader.page
    search = page.locator("input[type=search]")
    search.fill("body/position.z")
    search.dispatch_event("change")
    reader.go(INSTANT_S)
    legend = page.locator("#signals .u-series", has_text="body/position.z")
    assert "m" in legend.locator(".u-value").inner_text()
    assert page.locator("#signals canvas").count() == 1


def check_widths(browser, path):
    """Nothing but tables is wider than the screen."""
    for width in WIDTHS:
        reader = Reader(browser, path.as_uri(), width=width)
        reader.check_width()
        reader.close()


def check_print(reader):
    reader.page.emulate_media(media="print")
    assert not reader.page.locator(".controls").is_visible()
    assert reader.page.locator("canvas[data-view=side]").is_visible()
    reader.page.emulate_media(media="screen")


def check_tables(reader):
    """Every part that scripts draw has a label, and the tables have their heads."""
    page = reader.page
    parts = page.locator("[role=group]")
    assert parts.count() >= 3
    for part in parts.all():
        assert len(part.get_attribute("aria-label")) > 20
    tables = page.locator(".scroll table")
    assert tables.count() == page.locator(".scroll table thead").count() > 2


def run(program, folder, name, *arguments):
    """Returns recording and page of a run."""
    out = folder / name
    command = [program, "run", *arguments, "--out", out, "--report", "--json"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=False)
    report = json.loads(done.stdout)
    return report, out / Path(report["recording"]).name, out / Path(report["page"]).name


def check(program, folder, browser, update):
    trot = ["scenarios/trot.toml", "--until", "2 s"]
    report, recording, page = run(program, folder, "trot", *trot)
    assert report["verdict"] == "pass", report
    for scheme in ["light", "dark"]:
        reader = Reader(browser, page.as_uri(), scheme=scheme)
        check_screens(reader, scheme, update)
        reader.close()
    reader = Reader(browser, page.as_uri())
    assert reader.now == 0.0
    check_robot(reader, recording)
    check_controls(reader)
    check_plots(reader)
    check_tables(reader)
    check_print(reader)
    reader.close()
    check_widths(browser, page)

    # A page of a run that fails opens at its first decisive instant.
    far = folder / "far.toml"
    far.write_text((ROOT / "scenarios/trot.toml").read_text() + TOO_FAR)
    report, failed, page = run(program, folder, "fails", far, *trot[1:])
    instants = [it["first_violation_s"] for it in report["expectations"] if it["verdict"] == "fail"]
    assert len(instants) == 2, report
    reader = Reader(browser, page.as_uri())
    assert reader.now == min(instants) < max(instants), reader.now
    reader.close()

    # Two runs.
    both = folder / "both.html"
    subprocess.run([program, "report", recording, failed, "--out", both], check=True,
                   stdout=subprocess.DEVNULL)
    reader = Reader(browser, both.as_uri())
    assert reader.page.locator("canvas.figure").count() == 6
    reader.go(INSTANT_S)
    reader.close()

    # Boards on a bus: frames are decoded around the instant.
    oncilla = ["scenarios/oncilla-trot.toml", "--until", "1 s"]
    _, _, page = run(program, folder, "oncilla", *oncilla)
    reader = Reader(browser, f"{page.as_uri()}#t=0.9")
    assert reader.now == 0.9
    rows = reader.page.locator("#strip tbody tr").all_inner_texts()
    assert any("LF low-latency" in row for row in rows), rows
    assert any("LF ok" in row for row in rows), rows
    reader.close()
    return page.stat().st_size


def main():
    program = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        size = check(program, Path(folder), browser, "--update" in sys.argv[2:])
    print(f"pages: robot, screens, controls, plots, buses and two runs; {size / 1e6:.2f} MB with a bus")


if __name__ == "__main__":
    main()
