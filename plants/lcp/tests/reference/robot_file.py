"""Robot files as numbers in SI units, read independently of the Rust code."""

import pathlib
import tomllib

import numpy as np

ROBOTS = pathlib.Path(__file__).resolve().parents[4] / "robots"
GRAVITY = 9.81

UNITS = {
    "m": 1.0,
    "mm": 1e-3,
    "kg": 1.0,
    "g": 1e-3,
    "deg": np.pi / 180.0,
    "rad": 1.0,
    "N/m": 1.0,
    "kN/m": 1e3,
    "N·s/m": 1.0,
    "N·m/rad": 1.0,
    "N·m·s/rad": 1.0,
    "kg·m²": 1.0,
}


def si(value):
    """Converts `"44.2 mm"` to SI, in decimal, so that the result is the nearest double.

    Of an assumed value, the interval is ignored.
    """
    if isinstance(value, dict):
        value = value["value"]
    if not isinstance(value, str):
        return float(value)
    number, unit = value.split(" ", 1)
    if UNITS[unit] == 1e-3:
        return float(number + "e-3") if "e" not in number else float(number) / 1e3
    return float(number) * UNITS[unit]


class OneSided:
    """Stiffness k, damping c and toe region δ of a one-sided element."""

    def __init__(self, table):
        self.stiffness, self.damping, self.toe_region = (si(table[key]) for key in ("stiffness", "damping", "toe_region"))


class Leg:
    """Parameters of one leg, and derived lengths."""

    def __init__(self, table):
        self.l1, self.l2, self.l3, self.ld = (si(table[key]) for key in ("l1", "l2", "l3", "l_delta"))
        self.b = self.l3 - self.ld
        self.q2_ref = si(table["q2_ref"])
        self.k_d, self.preload_d = si(table["diagonal"]["stiffness"]), si(table["diagonal"]["preload"])
        self.k_p, self.preload_p = si(table["parallel"]["stiffness"]), si(table["parallel"]["preload"])
        self.travel, self.diagonal_min = si(table["parallel_travel"]), si(table["diagonal_min"])
        self.friction = [si(table["joint_friction"][joint]) for joint in ("hip", "knee", "ankle", "toe")]
        self.masses = [si(table["mass"][part]) for part in ("l1", "l2", "l3", "foot")]
        self.toe_length, self.toe_stiffness, self.toe_rest = (
            si(table["toe"][key]) for key in ("length", "stiffness", "rest")
        )
        self.pulley_radius = si(table["pulley_radius"])
        compliance = table["compliance"]
        self.stops, self.cable, self.sole = (OneSided(compliance[part]) for part in ("stops", "cable", "sole"))
        self.slip_deflection = si(compliance["slip_deflection"])

    @property
    def diagonal_max(self):
        return np.sqrt(self.l2**2 + self.ld**2 + 2 * self.l2 * self.ld * np.cos(self.q2_ref))

    @property
    def hip_ref(self):
        """Absolute angle of the first segment of the extended, closed leg with its foot below the hip."""
        return np.arctan2(self.l2 * np.sin(self.q2_ref), self.l1 + self.b + self.l2 * np.cos(self.q2_ref))

    def parameters(self):
        names = ["l1", "l2", "l3", "ld", "q2_ref", "k_d", "preload_d", "k_p", "preload_p", "travel", "diagonal_min"]
        names += ["friction", "masses", "toe_length", "toe_stiffness", "toe_rest"]
        return {name: getattr(self, name) for name in names}


class Robot:
    def __init__(self, path):
        table = tomllib.loads(pathlib.Path(path).read_text(encoding="utf-8"))
        self.name = table["name"]
        self.mass = si(table["trunk"]["mass"])
        self.inertia = [si(value) for value in table["trunk"]["inertia"]]
        self.names = [mount["name"] for mount in table["mount"]]
        self.hips = np.array([[si(value) for value in mount["hip"]] for mount in table["mount"]])
        self.legs = [Leg(table["leg"][mount["leg"]]) for mount in table["mount"]]


def cheetah_cub():
    return Robot(ROBOTS / "cheetah-cub.toml")
