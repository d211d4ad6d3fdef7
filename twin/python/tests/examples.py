"""Parts in Python for tests, with known behaviour."""

from __future__ import annotations

from typing import Any

import numpy as np
import twinrig
from twinrig import Input, Output, Variable

LEGS = ("LF", "RF", "LH", "RH")
COMMANDS = [Output(f"leg/{leg}/{joint}/command", "rad") for leg in LEGS for joint in ("hip", "knee")]


class Swing:
    """Hips swing in phase; the knees are still."""

    ports = [*COMMANDS, Input("body/rpy", "rad", 3)]
    variables = [Variable("amplitude", "rad", 0.2, min=0.0, max=0.5)]
    amplitude: float

    def __init__(self) -> None:
        self.time = 0.0

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        self.time += elapsed
        outputs[0::2] = self.amplitude * np.sin(4.0 * np.pi * self.time)
        outputs[1::2] = 0.05


class Cart:
    """Cart of 1 kg at 1 m: symplectic Euler, from one actuation or observation to the next."""

    ports = [Input("cart/force", "N"), Output("cart/position", "m"), Output("cart/speed", "m/s")]

    def __init__(self) -> None:
        self.time, self.position, self.speed = 0.0, 1.0, 0.0

    def advance(self, to: float, inputs: Any) -> None:
        elapsed = to - self.time
        self.speed += elapsed * inputs[0]
        self.position += elapsed * self.speed
        self.time = to

    def observe(self, outputs: Any) -> None:
        outputs[:] = self.position, self.speed


class Spring:
    """Spring of 4 N/m towards the origin."""

    ports = [Output("cart/force", "N"), Input("cart/position", "m")]

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        outputs[0] = -4.0 * inputs[0]


CART: dict[str, Any] = {
    "duration": "5 s",
    "plant": {"model": "cart"},
    "controller": {"kind": "spring", "period": "1 ms"},
    "observe": {"period": "1 ms"},
    "expect": [
        {"name": "stays", "signal": {"name": "cart/position", "always": {"max": "1.01 m"}}}
    ],
}
"""Scenario of a cart at a spring, both in Python."""

SWING: dict[str, Any] = {"controller": {"kind": "swing", "period": "2 ms"}, "expect": []}
"""Settings that replace the controller of a scenario by `Swing`."""


def cart_rig(**parts: Any) -> twinrig.Rig:
    """Return a rig of the cart, with other parts if given."""
    return twinrig.Rig(
        CART,
        plants={"cart": parts.get("plant", Cart)},
        controllers={"spring": parts.get("controller", Spring)},
    )
