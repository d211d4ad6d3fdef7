"""An oscillator, x'' = u - x, exact for constant inputs."""

import math
from typing import Any

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Oscillator(Fmi2Slave):  # type: ignore[misc]
    """The FMU."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.u, self.x, self.v = 0.0, 1.0, 0.0
        for name in ("x", "v"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        continuous = Fmi2Variability.continuous
        self.register_variable(
            Real("u", causality=Fmi2Causality.input, variability=continuous, start=0.0)
        )

    def do_step(self, current_time: float, step_size: float) -> bool:
        cos, sin = math.cos(step_size), math.sin(step_size)
        x, v = self.x - self.u, self.v
        self.x, self.v = self.u + cos * x + sin * v, cos * v - sin * x
        return True
