"""Opens the page of `twin live` in Chromium, steers the run, and checks what a visitor sees.

Usage: check_live.py WORD…, the words of the program, such as `target/release/twin`.

The gamepad is one that the page is told of: no browser without a window has another.
"""

import json
import re
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from reader import WIDTHS, Reader, chromium, difference

ROOT = Path(__file__).resolve().parents[3]
TROT = ROOT / "scenarios/trot.toml"
# Period of the plant and of the controller, and the frequency that is the default of the latter.
PERIOD_S = 2e-3
FREQUENCY = 3.0
SIDE = "canvas[data-view=side]"

# A gamepad with two axes and three buttons, which `pad` moves, and the instants [ms] of requests.
PAD = """
const given = { id: "", index: 0, connected: true, mapping: "", axes: [0, 0],
  buttons: [0, 1, 2].map(() => ({ pressed: false, value: 0 })) };
navigator.getGamepads = () => [null, given.connected ? given : null];
globalThis.pad = {
  connect: (id) => {
    Object.assign(given, { id, connected: true });
    dispatchEvent(new Event("gamepadconnected"));
  },
  disconnect: () => { given.connected = false; },
  move: (axis, to) => { given.axes[axis] = to; },
  press: (button, pressed) => { given.buttons[button] = { pressed, value: Number(pressed) }; },
};
globalThis.instants = [];
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (message) {
  if (typeof message !== "string") instants.push(performance.now());
  send.call(this, message);
};
"""

# By the clock of the page, which may be late: it has read the gamepad several times, and no request
# waits for its answer or for its turn, if requests end at all.
REST = """async () => {
  for (let [count, quiet] = [0, 0]; quiet < 3 && count < 50; count += 1) {
    await new Promise((done) => setTimeout(done, 60));
    quiet = twinrig.connection.calls.size ? 0 : quiet + 1;
  }
}"""
# Time after which what is waited for counts as missing.
WAIT_MS = 10_000


@contextmanager
def served(words, folder):
    """Yields a program and the place of its page."""
    options = ["--set", "duration=100 s", "--socket", "0", "--page", "0", "--json"]
    command = [*words, "live", TROT, *options, "--out", folder]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        yield process, json.loads(process.stdout.readline())
    finally:
        process.kill()
        process.communicate()


class Visitor(Reader):
    """A page of a run that goes on, with the requests that it sends."""

    def __init__(self, browser, served):
        self.requests = []
        places = (served["page"].rstrip("/") + "/", served["socket"].rstrip("/") + "/")
        super().__init__(browser, served["page"], places=places, script=PAD)
        self.page.set_default_timeout(WAIT_MS)

    def request(self, request):
        super().request(request)
        if request.url.startswith("ws:"):
            request.on("framesent", self.sent)

    def sent(self, payload):
        # Calls of services are binary, with JSON behind the name of its encoding.
        if isinstance(payload, bytes):
            self.requests.append(json.loads(payload[payload.index(b"json") + 4 :]))

    def wait(self, condition, argument=None):
        """Waits until a condition on the state holds."""
        self.page.wait_for_function(f"(arg) => (({condition})(twinrig.state(), arg))", arg=argument)

    def wait_value(self, name, value, key="target"):
        """Waits until a process variable has a value, but for rounding."""
        self.wait(
            "(it, [name, value, key]) => Math.abs(it.variables.find((at) => at.name === name)[key]"
            " - value) < 1e-9",
            [name, value, key],
        )

    def value(self, name):
        variables = self.page.evaluate("twinrig.state().variables")
        return next(it["target"] for it in variables if it["name"] == name)

    def pause(self):
        self.page.get_by_label("Pause (space)").click()
        self.wait("(it) => it.status === 'paused'")

    def play(self):
        self.page.get_by_label("Play (space)").click()
        self.wait("(it) => it.status === 'playing'")

    def rest(self):
        """Waits until the page has done what follows from what was done to it."""
        self.page.evaluate(REST)

    def check_silence(self):
        """Nothing is sent for a while."""
        self.rest()
        self.requests.clear()
        self.rest()
        assert self.requests == [], self.requests


def check_motion(visitor):
    """The robot moves while time goes on, and stands still while it does not."""
    page = visitor.page
    begin, image = visitor.now, visitor.image(SIDE)
    visitor.wait("(it, begin) => it.now_s > begin + 0.4", begin)
    moved = difference(image, visitor.image(SIDE))
    assert visitor.now > begin + 0.4, "the clock"
    assert moved > 0.003, f"the robot: {moved:.4f}"
    visitor.pause()
    now, image = visitor.now, visitor.image(SIDE)
    visitor.rest()
    # The instant of a pose is that of the step before.
    assert abs(visitor.now - now) < PERIOD_S, "it plays on"
    assert difference(image, visitor.image(SIDE)) < 0.003, "it moves on"
    page.keyboard.press(".")
    visitor.wait("(it, [from, to]) => from < it.now_s && it.now_s < to", [now, now + 2 * PERIOD_S])
    visitor.play()


def check_tables(visitor):
    """All expectations, branches and signals are shown."""
    page = visitor.page
    count = page.evaluate("twinrig.state().expectations.length")
    assert page.locator("#expectations tbody tr").count() == count > 10
    assert page.locator("#variables .variable").count() == len(
        page.evaluate("twinrig.state().variables")
    )
    assert page.locator("#branches tbody tr").count() == 1
    assert page.locator("#signals canvas").count() == 1
    legend = page.locator("#signals .u-value", has_text=re.compile(r"\d"))
    legend.first.wait_for()
    visitor.wait("(it) => it.events.length > 0 && document.querySelector('#events li')")


def check_variables(visitor):
    """A slider changes a variable, by pointer and by key; a number out of range is refused."""
    page = visitor.page
    slider = page.get_by_label("frequency", exact=True)
    slider.fill("4")
    visitor.wait_value("frequency", 4, "value")
    slider.press("ArrowRight")
    visitor.wait_value("frequency", 4.01, "value")
    number = page.get_by_label("frequency, number")
    number.fill("-1")
    number.press("Enter")
    page.wait_for_selector("#message.bad")
    text = page.locator("#message").inner_text()
    assert "frequency = -1 is not in [0, ∞[" in text, text
    assert number.get_attribute("aria-invalid") == "true"
    assert visitor.value("frequency") == 4.01
    number.fill("3.5")
    number.press("Enter")
    visitor.wait_value("frequency", 3.5, "value")
    page.wait_for_selector("#message:not(.bad)", state="attached")
    assert number.get_attribute("aria-invalid") == "false"
    page.get_by_label("Reset frequency to").click()
    visitor.wait_value("frequency", FREQUENCY)


def check_sets(visitor, folder):
    """Values are saved under a name, and recalled."""
    page = visitor.page
    page.get_by_label("frequency, number").fill("3.2")
    page.get_by_label("frequency, number").press("Enter")
    visitor.wait_value("frequency", 3.2)
    page.get_by_label("Name of the set to save").fill("slow")
    page.get_by_label("Name of the set to save").press("Enter")
    recall = page.get_by_label("Recall the set slow")
    recall.wait_for()
    assert 'frequency = "3.2 Hz"' in (folder / "sets/slow.toml").read_text()
    page.get_by_label("Reset frequency to").click()
    visitor.wait_value("frequency", FREQUENCY)
    recall.click()
    visitor.wait_value("frequency", 3.2)


def check_branch(visitor, folder):
    """A change in the past, where the slider of time leads, begins a branch."""
    page = visitor.page
    visitor.pause()
    front = visitor.now
    page.get_by_label("Instant").fill("0.5")
    visitor.wait("(it) => it.now_s === 0.5")
    visitor.settle()
    assert visitor.now == 0.5
    page.get_by_label("frequency", exact=True).press("ArrowRight")
    visitor.wait("(it) => it.variables[0].target > it.variables[0].value")
    visitor.play()
    rows = page.locator("#branches tbody tr")
    rows.nth(1).wait_for()
    texts = rows.nth(1).inner_text()
    assert "1 (shown)" in texts, texts
    assert "0.500 s" in texts, texts
    assert (folder / "trot-1.toml").is_file()
    visitor.wait("(it) => it.branches[1].reached_s > 0.7")
    page.get_by_label("Compare branch 0").click()
    page.wait_for_selector("#branches [aria-live] p")
    page.get_by_label("Go to branch 0").click()
    visitor.wait("(it) => it.branch === 0")
    assert "0 (shown)" in rows.nth(0).inner_text()
    assert visitor.now >= front
    visitor.pause()


def deflect(visitor, axis, to):
    visitor.page.evaluate("([axis, to]) => pad.move(axis, to)", [axis, to])


def press(visitor, button):
    for is_down in [True, False]:
        visitor.page.evaluate("([button, to]) => pad.press(button, to)", [button, is_down])
        visitor.rest()


def check_gamepad(visitor):
    """Axes move variables by position and by rate, buttons recall sets; rest sends nothing."""
    page = visitor.page
    assert not page.locator("#gamepads").is_visible()
    connect(visitor, "Test pad")
    page.get_by_label("Reset frequency to").click()
    visitor.wait_value("frequency", FREQUENCY)
    # A stick that is held while it is chosen does nothing before it was at rest.
    deflect(visitor, 0, 0.5)
    page.get_by_label("axis 0: process variable").select_option("frequency")
    visitor.check_silence()
    deflect(visitor, 0, 0.09)
    visitor.check_silence()
    assert page.get_by_label("axis 0: change at full deflection").input_value() == "0.75"

    # Half of the way from the dead zone to the end, and beyond the end.
    deflect(visitor, 0, 0.55)
    visitor.wait_value("frequency", 1.125 * FREQUENCY)
    visitor.check_silence()
    deflect(visitor, 0, -1.2)
    visitor.wait_value("frequency", 0.75 * FREQUENCY)
    deflect(visitor, 0, -0.09)
    visitor.wait_value("frequency", FREQUENCY)
    assert visitor.value("frequency") == FREQUENCY
    visitor.check_silence()

    # The end of a range: a duty factor is below 1.
    page.get_by_label("axis 1: process variable").select_option("duty_factor/fore")
    page.get_by_label("axis 1: change at full deflection").fill("2")
    page.get_by_label("axis 1: change at full deflection").press("Enter")
    visitor.check_silence()
    deflect(visitor, 1, 1)
    visitor.rest()
    highest = visitor.requests[-1]["value"]
    assert 0.99 < highest < 1, highest
    visitor.wait_value("duty_factor/fore", highest)
    deflect(visitor, 1, 0)
    visitor.wait_value("duty_factor/fore", 0.509)

    check_rate(visitor)
    page.get_by_label("axis 0: how it acts").select_option("position")
    page.get_by_label("button 1: action").select_option("recall slow")
    visitor.check_silence()
    press(visitor, 1)
    visitor.wait_value("frequency", 3.2)
    assert visitor.requests == [{"name": "slow"}], visitor.requests
    # From there, not from where it was chosen.
    deflect(visitor, 0, 1)
    visitor.wait_value("frequency", 3.2 + 0.8)
    deflect(visitor, 0, 0)
    visitor.wait_value("frequency", 3.2)
    page.get_by_label("button 2: action").select_option("toggle")
    press(visitor, 2)
    visitor.wait("(it) => it.status === 'playing'")
    press(visitor, 2)
    visitor.wait("(it) => it.status === 'paused'")


def check_rate(visitor):
    """A variable rises at the rate of the deflection, and stays."""
    page = visitor.page
    page.get_by_label("axis 0: how it acts").select_option("rate")
    page.get_by_label("axis 0: change at full deflection").fill("0.8")
    page.get_by_label("axis 0: change at full deflection").press("Enter")
    visitor.check_silence()
    begin = time.monotonic()
    page.evaluate("instants.splice(0)")
    deflect(visitor, 0, 1)
    visitor.wait("(it) => it.variables[0].name === 'frequency' && it.variables[0].target > 3.3")
    deflect(visitor, 0, 0)
    visitor.rest()
    passed = time.monotonic() - begin
    risen = visitor.requests[-1]["value"]
    visitor.wait_value("frequency", risen)
    assert 3.3 < risen < FREQUENCY + 0.8 * passed, f"{risen} after {passed} s"
    # At most 20 in a second, but for the rounding of the clock.
    gaps = np.diff(page.evaluate("instants"))
    assert len(gaps) >= 2 and gaps.min() > 48, gaps
    visitor.check_silence()
    assert visitor.value("frequency") == risen


def check_mapping(visitor):
    """Garbage in the place of a mapping is none; a mapping survives a reload."""
    page = visitor.page
    for name, garbage in enumerate(["{", '{"axes": 5, "buttons": {"0": 3}}', "[null]"]):
        key = f"gamepad of trot: {name}"
        page.evaluate("([key, text]) => localStorage.setItem(key, text)", [key, garbage])
        connect(visitor, str(name))
        variable = page.locator(".pad").last.get_by_label("axis 0: process variable")
        assert variable.input_value() == "", garbage
    page.reload()
    page.wait_for_selector("html[data-ready]")
    connect(visitor, "Test pad")
    assert page.get_by_label("axis 0: process variable").input_value() == "frequency"
    assert page.get_by_label("button 1: action").input_value() == "recall slow"
    visitor.check_silence()
    deflect(visitor, 0, 1)
    visitor.wait_value("frequency", 3.2 + 0.8)


def connect(visitor, name):
    visitor.page.evaluate("(name) => pad.connect(name)", name)
    visitor.page.locator(".pad", has_text=f"Gamepad {name} connected").wait_for()


def check_disconnection(visitor):
    """A gamepad that is gone sends nothing, and the variable stays where it was."""
    page = visitor.page
    page.evaluate("pad.disconnect()")
    page.locator(".pad", has_text="not connected").wait_for()
    deflect(visitor, 0, -1)
    visitor.check_silence()
    assert visitor.value("frequency") == 4
    # It comes back held, and waits for rest.
    connect(visitor, "Test pad")
    visitor.check_silence()
    assert visitor.value("frequency") == 4


def check_looks(visitor):
    """Nothing but tables is wider than the screen; light and dark differ."""
    page = visitor.page
    papers = []
    for scheme in ["dark", "light"]:
        page.emulate_media(color_scheme=scheme)
        visitor.settle()
        papers.append(sum(visitor.paper))
    assert papers[0] < papers[1], papers
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 900})
        visitor.settle()
        visitor.check_width()


def check_loss(visitor, process):
    """A server that is gone is said, and the last state stays."""
    process.kill()
    visitor.page.locator("#connection", has_text="not connected").wait_for()
    assert visitor.page.locator(".pad").is_visible()
    visitor.page.get_by_label("frequency, number").fill("3")
    visitor.page.get_by_label("frequency, number").press("Enter")
    visitor.page.locator("#message.bad", has_text="not connected").wait_for()
    # Chromium reports each attempt to connect.
    visitor.problems = [it for it in visitor.problems if "ERR_CONNECTION_REFUSED" not in it]


def main():
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        folder = Path(folder)
        with served(sys.argv[1:], folder) as (process, places):
            visitor = Visitor(browser, places)
            check_motion(visitor)
            check_tables(visitor)
            check_variables(visitor)
            check_sets(visitor, folder)
            check_branch(visitor, folder)
            check_gamepad(visitor)
            check_mapping(visitor)
            check_disconnection(visitor)
            check_looks(visitor)
            assert not visitor.problems, visitor.problems
            check_loss(visitor, process)
            visitor.close()
    passed = time.monotonic() - begin
    print(f"live page: robot, variables, sets, branches, gamepad, looks and loss in {passed:.0f} s")


if __name__ == "__main__":
    main()
