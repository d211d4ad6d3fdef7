"""A page in Chromium, as its reader sees it: shared by the checks of pages."""

import base64
import shutil
import sys
from contextlib import contextmanager
from io import BytesIO

import numpy as np
from PIL import Image
from playwright.sync_api import TimeoutError, sync_playwright

# A browser that is new, and silent on the network.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-quic",
    "--disable-sync",
    "--no-first-run",
    "--hide-scrollbars",
    "--force-device-scale-factor=1",
    "--font-render-hinting=none",
]

# Of a telephone, a tablet and a large screen.
WIDTHS = [400, 800, 2500]


@contextmanager
def chromium():
    """Yields the browser of the system."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        sys.exit("no Chromium; the package of Debian is `chromium`")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


class Reader:
    """A page in a browser. It has a problem if it writes to the console, or if it requests
    anything from another place than `places`."""

    def __init__(self, browser, address, width=1200, scheme="light", places=("file:",), script=""):
        self.problems = []
        self.places = places
        context = browser.new_context(
            viewport={"width": width, "height": 900}, color_scheme=scheme
        )
        if script:
            context.add_init_script(script)
        self.page = context.new_page()
        self.page.on("console", lambda it: self.problems.append(f"console: {it.text}"))
        self.page.on("pageerror", lambda it: self.problems.append(f"error: {it}"))
        self.page.on("request", self.request)
        self.page.on("websocket", self.request)
        self.page.goto(address)
        try:
            self.page.wait_for_selector("html[data-ready]")
        except TimeoutError as error:
            raise AssertionError(f"the page is not ready: {self.problems}") from error
        self.settle()

    def request(self, request):
        if not request.url.startswith(self.places):
            self.problems.append(f"request: {request.url}")

    def settle(self):
        """Waits until the present instant is drawn."""
        self.page.evaluate(
            "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )

    def go(self, instant):
        self.page.evaluate("(t) => twinrig.clock.set(t)", instant)
        self.settle()

    @property
    def now(self):
        return self.page.evaluate("twinrig.clock.now")

    def image(self, selector):
        """Returns a canvas as an image."""
        text = self.page.locator(selector).first.evaluate("(it) => it.toDataURL('image/png')")
        picture = Image.open(BytesIO(base64.b64decode(text.split(",")[1]))).convert("RGBA")
        paper = Image.new("RGBA", picture.size, self.paper)
        return Image.alpha_composite(paper, picture).convert("RGB")

    @property
    def paper(self):
        style = "getComputedStyle(document.querySelector('figure')).backgroundColor"
        numbers = self.page.evaluate(style).split("(")[1].rstrip(")").split(",")
        return tuple(int(number) for number in numbers[:3]) + (255,)

    def check_width(self):
        """Nothing but tables is wider than the screen."""
        width = self.page.viewport_size["width"]
        wide = self.page.evaluate("document.documentElement.scrollWidth")
        assert wide <= width, f"{wide} px on a screen of {width}"

    def close(self):
        self.page.context.close()
        assert not self.problems, self.problems


def difference(a, b):
    """Returns the share of pixels that differ by more than a quarter of the scale in a colour, of
    images that are blurred, so that one pixel beside another is no difference."""
    a, b = (np.asarray(it.resize((it.width // 3, it.height // 3)), dtype=float) for it in (a, b))
    return float(np.mean(np.abs(a - b).max(axis=2) > 64)) if a.shape == b.shape else 1.0
