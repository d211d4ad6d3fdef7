"""An oscillator, x'' = u - x, exact for constant inputs."""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Oscillator(Fmi2Slave):
    """The FMU."""

    def __init__(self, **options):
        super().__init__(**options)
        self.u, self.x, self.v = 0.0, 1.0, 0.0
        for name in ("x", "v"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        continuous = Fmi2Variability.continuous
        self.register_variable(
            Real("u", causality=Fmi2Causality.input, variability=continuous, start=0.0)
        )

    def do_step(self, current_time, step_size):
        cos, sin = math.cos(step_size), math.sin(step_size)
        x, v = self.x - self.u, self.v
        self.x, self.v = self.u + cos * x + sin * v, cos * v - sin * x
        return True
