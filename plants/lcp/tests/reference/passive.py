#!/usr/bin/env python3
"""Trajectories of passive legs on a fixed hip (thesis, section 2.5.1), and harder ones, that no line of the Rust code has
a part in: other coordinates, other derivatives, other integrators.

    python3 passive.py                  every scene by DOP853 and by Radau; writes golden/*.json, prints how far they differ
    python3 passive.py --check          some scenes by DOP853, compared with golden/*.json
    python3 passive.py --modes          what swings how fast at rest
"""

import json
import pathlib
import sys
import time

import numpy as np
from scipy.linalg import eig
from scipy.optimize import fsolve

from hybrid import Hybrid
from point_masses import PlanarLeg
from robot_file import cheetah_cub

GOLDEN = pathlib.Path(__file__).resolve().parent / "golden"
# Every scene runs in stretches of 2 ms; feet are written after each of them or of so many, the rest more sparsely.
GRID_MS, FEET, SPARSE = 2, 5, 10
TIMES = np.arange(0, 301, GRID_MS) / 1000.0
# How exactly two runs of the same scene must agree [m, rad]; between two methods, and between two machines.
METHODS_AGREE, MACHINES_AGREE = 2e-11, 1e-11

REST = {"angles_deg": [10.0, -9.5, 9.5], "rates": [0.0, 0.0, 0.0]}
HARD = {"angles_deg": [20.0, -40.0, 62.0], "rates": [-10.0, 15.0, 30.0]}
SWING = {"angles_deg": [-25.0, -30.0, 34.0], "rates": [14.0, -3.0, 2.0]}
BETWEEN = {"angles_deg": [10.0, -25.0, 37.0], "rates": [6.0, -4.0, 3.0]}
LOOSE = {"angles_deg": [-30.0, -20.0, 24.0], "rates": [20.0, -15.0, 25.0]}

SCENES = {
    "passive": {"start": REST},
    "passive-free": {"start": REST, "stops": False},
    "hard-hit": {"start": HARD},
    "stiff": {"start": REST, "stiffness": 100.0},
    "stiff-free": {"start": REST, "stiffness": 100.0, "stops": False},
    "hard-light": {"start": HARD, "damping": 0.01},
    "undamped": {"start": HARD, "damping": 0.0},
    # Stops that are let go again, not only reached.
    "loose": {"start": LOOSE, "damping": 0.02, "preload_m": 1e-4},
    # Springs whose rest lies between the stops, none of which is reached.
    "between": {"start": BETWEEN, "preload_m": -4e-3, "travel_m": 14e-3, "damping": 0.01},
    "stiff-between": {"start": BETWEEN, "preload_m": -4e-3, "travel_m": 14e-3, "stiffness": 100.0},
    # A toe that starts unloaded.
    "toe": {"start": SWING, "toe": True},
}
DENSE = ["passive", "passive-free", "hard-hit", "stiff", "stiff-free"]
CHEAP = ["passive", "hard-hit", "toe"]


class Scene:
    def __init__(self, name):
        self.name, self.given = name, SCENES[name]
        leg = cheetah_cub().legs[0]
        scale = self.given.get("stiffness", 1.0)
        leg.k_d, leg.k_p = leg.k_d * scale, leg.k_p * scale
        leg.friction = [value * self.given.get("damping", 1.0) for value in leg.friction]
        leg.travel = self.given.get("travel_m", leg.travel)
        leg.preload_d = leg.preload_p = self.given.get("preload_m", leg.preload_d)
        self.leg = leg
        self.system = PlanarLeg(leg, toe=self.given.get("toe", False), stops=self.given.get("stops", True))

    def start(self):
        start = self.given["start"]
        q = self.system.joint_coordinates(*np.radians(start["angles_deg"]), self.leg.toe_rest)
        u = np.array([*start["rates"], 0.0][: self.system.joints])
        return q, u

    def run(self, method):
        rough = (1e-15, 1e-13 * self.given.get("stiffness", 1.0))
        hybrid = Hybrid(self.system, method=method, atol=rough)
        states, held, lost = hybrid.run(*self.start(), TIMES)
        return hybrid, states, lost

    def record(self, hybrid, states, lost):
        size = self.system.size
        every = 1 if self.name in DENSE else FEET
        feet = [self.system.foot(y[:size]) for y in states[::every]]
        sparse = states[::SPARSE]
        start = sum(self.system.energies(states[0][:size], states[0][size:-1]))
        energies = [self.system.energies(y[:size], y[size:-1]) for y in sparse]
        dissipated = [y[-1] for y in sparse]
        # Losses of impacts within the grid are known at its instants.
        residual = [sum(e) + d + loss - start - lost[0] for e, d, loss in zip(energies, dissipated, lost[::SPARSE])]
        return {
            "scene": self.name,
            "leg": self.leg.parameters(),
            "toe": self.system.toe,
            "stops": bool(self.system.stop_names),
            "start": self.given["start"],
            "step_s": every * GRID_MS / 1000.0,
            "foot": [list(foot) for foot, _ in feet],
            **({"tip": [list(tip) for _, tip in feet]} if self.system.toe else {}),
            "sparse_step_s": SPARSE * GRID_MS / 1000.0,
            "angles": [list(self.system.absolute(y[:size])) for y in sparse],
            "kinetic": [e[0] for e in energies],
            "spring": [e[1] for e in energies],
            "gravity": [e[2] for e in energies],
            "dissipated": dissipated,
            "impact": list(lost[::SPARSE]),
            "events": triples(hybrid.events),
        }, max(abs(value) for value in residual)


def short(value):
    """13 decimals."""
    if isinstance(value, dict):
        return {key: short(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [short(item) for item in value]
    if isinstance(value, (bool, str)):
        return value
    return round(float(value), 13) + 0.0


def write(name, record):
    """JSON with a line for every key."""
    lines = [f'"{key}": {json.dumps(value, separators=(",", ":"))}' for key, value in short(record).items()]
    GOLDEN.mkdir(exist_ok=True)
    (GOLDEN / f"{name}.json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def differences(one, other):
    """Greatest of positions [m] and angles [rad], and of the times of events [s]."""
    place = max(np.abs(np.subtract(one[key], other[key])).max() for key in ("foot", "tip", "angles") if key in one)
    return place, of_events(one, other)


def triples(events):
    """Time [s], which gap, what it does."""
    return [[event["time"], event["what"], event["event"]] for event in events]


def of_events(one, other):
    """Greatest difference of times [s]. What happens at one instant has no order."""
    names = [[event[1:] for event in sorted(record["events"])] for record in (one, other)]
    assert names[0] == names[1], f"{one['scene']}: events differ: {names}"
    times = [[event[0] for event in sorted(record["events"])] for record in (one, other)]
    return float(np.abs(np.subtract(*times)).max(initial=0.0))


def tell(record):
    for at, what, event in record["events"]:
        print(f"    {at * 1e3:12.8f} ms  {what} {event}")


def write_all(names):
    for name in names:
        scene, records = Scene(name), []
        for method in ("DOP853", "Radau"):
            began = time.monotonic()
            hybrid, states, lost = scene.run(method)
            record, residual = scene.record(hybrid, states, lost)
            records.append(record)
            print(
                f"{name:14} {method:6} {time.monotonic() - began:5.1f} s, {hybrid.evaluations} evaluations,"
                f" energy books {residual:.1e} J, held gaps drift {hybrid.drift:.1e}",
                flush=True,
            )
        place, instant = differences(*records)
        print(f"{name:14} the two differ by {place:.1e} m or rad, events by {instant:.1e} s")
        tell(records[0])
        assert place < METHODS_AGREE
        records[0]["methods_differ_m"] = float(f"{place:.1e}")
        write(name, records[0])


def check(names):
    for name in names:
        scene = Scene(name)
        record, _ = scene.record(*scene.run("DOP853"))
        golden = json.loads((GOLDEN / f"{name}.json").read_text(encoding="utf-8"))
        assert golden["leg"] == short(record["leg"]), f"{name}: the robot file has changed; write the files anew"
        place, instant = differences(short(record), golden)
        print(f"golden/{name}.json: off by {place:.1e} m or rad, events by {instant:.1e} s")
        assert place < MACHINES_AGREE and instant < 1e-9, name


def modes(stiffness=1.0, closed=False):
    """Frequencies [Hz] and damping ratios of small motions about rest."""
    leg = cheetah_cub().legs[0]
    leg.k_d, leg.k_p = leg.k_d * stiffness, leg.k_p * stiffness
    system = PlanarLeg(leg, stops=False)
    still = np.zeros(3)
    rest = fsolve(lambda q: system.dynamics(q, still)[1], system.joint_coordinates(0.0, 0.0, 0.1), xtol=1e-14)
    step = 1e-6
    stiff = -np.column_stack(
        [(system.dynamics(rest + d, still)[1] - system.dynamics(rest - d, still)[1]) / (2 * step) for d in step * np.eye(3)]
    )
    inertia, zero, one = system.inertia(rest), np.zeros((3, 3)), np.eye(3)
    values = eig(np.block([[zero, one], [-stiff, -np.diag(system.damping)]]), np.block([[one, zero], [zero, inertia]]))[0]
    values = sorted((value for value in values if value.imag >= 0.0), key=abs)
    return rest, [(abs(value) / (2 * np.pi), -value.real / abs(value)) for value in values]


if __name__ == "__main__":
    arguments = sys.argv[1:]
    if "--modes" in arguments:
        for stiffness in (1.0, 100.0):
            rest, found = modes(stiffness)
            print(f"stiffness × {stiffness:g}, joints at rest {np.degrees(rest).round(3)} deg:")
            for frequency, damping in found:
                print(f"    {frequency:8.3f} Hz, damping ratio {damping:.4f}")
    elif "--check" in arguments:
        check(CHEAP)
    else:
        write_all([name for name in arguments if name in SCENES] or SCENES)
