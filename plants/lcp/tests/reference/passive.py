#!/usr/bin/env python3
"""Trajectories of passive legs on a fixed hip (thesis, section 2.5.1), and harder cases, independent
of the Rust code: other coordinates, other derivatives, other integrators.

    python3 passive.py            all cases by DOP853 and Radau; writes golden/*.json, prints
                                  the differences
    python3 passive.py --check    some cases by DOP853, compared with golden/*.json
    python3 passive.py --modes    frequencies and damping ratios about the equilibrium
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
# Every case runs in segments of 2 ms. Feet are written after each segment or every FEET segments,
# other quantities every SPARSE segments.
GRID_MS, FEET, SPARSE = 2, 5, 10
TIMES = np.arange(0, 301, GRID_MS) / 1000.0
# Tolerances for two runs of one case [m, rad]: between two methods, and between two machines.
METHODS_AGREE, MACHINES_AGREE = 2e-11, 1e-11

REST = {"angles_deg": [10.0, -9.5, 9.5], "rates": [0.0, 0.0, 0.0]}
HARD = {"angles_deg": [20.0, -40.0, 62.0], "rates": [-10.0, 15.0, 30.0]}
SWING = {"angles_deg": [-25.0, -30.0, 34.0], "rates": [14.0, -3.0, 2.0]}
BETWEEN = {"angles_deg": [10.0, -25.0, 37.0], "rates": [6.0, -4.0, 3.0]}
LOOSE = {"angles_deg": [-30.0, -20.0, 24.0], "rates": [20.0, -15.0, 25.0]}

CASES = {
    "passive": {"start": REST},
    "passive-free": {"start": REST, "stops": False},
    "hard-hit": {"start": HARD},
    "stiff": {"start": REST, "stiffness": 100.0},
    "stiff-free": {"start": REST, "stiffness": 100.0, "stops": False},
    "hard-light": {"start": HARD, "damping": 0.01},
    "undamped": {"start": HARD, "damping": 0.0},
    # Stops that are reached and released.
    "loose": {"start": LOOSE, "damping": 0.02, "preload_m": 1e-4},
    # Springs with their equilibrium between the stops, none of which is reached.
    "between": {"start": BETWEEN, "preload_m": -4e-3, "travel_m": 14e-3, "damping": 0.01},
    "stiff-between": {"start": BETWEEN, "preload_m": -4e-3, "travel_m": 14e-3, "stiffness": 100.0},
    # Toe, initially unloaded.
    "toe": {"start": SWING, "toe": True},
}
DENSE = ["passive", "passive-free", "hard-hit", "stiff", "stiff-free"]
CHEAP = ["passive", "hard-hit", "toe"]


class Case:
    def __init__(self, name):
        self.name, self.parameters = name, CASES[name]
        leg = cheetah_cub().legs[0]
        scale = self.parameters.get("stiffness", 1.0)
        leg.k_d, leg.k_p = leg.k_d * scale, leg.k_p * scale
        leg.friction = [value * self.parameters.get("damping", 1.0) for value in leg.friction]
        leg.travel = self.parameters.get("travel_m", leg.travel)
        leg.preload_d = leg.preload_p = self.parameters.get("preload_m", leg.preload_d)
        self.leg = leg
        self.system = PlanarLeg(leg, toe=self.parameters.get("toe", False), stops=self.parameters.get("stops", True))

    def start(self):
        start = self.parameters["start"]
        q = self.system.joint_coordinates(*np.radians(start["angles_deg"]), self.leg.toe_rest)
        u = np.array([*start["rates"], 0.0][: self.system.joints])
        return q, u

    def run(self, method):
        tolerances = (1e-15, 1e-13 * self.parameters.get("stiffness", 1.0))
        hybrid = Hybrid(self.system, method=method, atol=tolerances)
        states, active, losses = hybrid.run(*self.start(), TIMES)
        return hybrid, states, losses

    def record(self, hybrid, states, losses):
        size = self.system.size
        every = 1 if self.name in DENSE else FEET
        feet = [self.system.foot(y[:size]) for y in states[::every]]
        sparse = states[::SPARSE]
        start = sum(self.system.energies(states[0][:size], states[0][size:-1]))
        energies = [self.system.energies(y[:size], y[size:-1]) for y in sparse]
        dissipated = [y[-1] for y in sparse]
        # Impact losses are recorded at the instants of the grid.
        residual = [sum(e) + d + loss - start - losses[0] for e, d, loss in zip(energies, dissipated, losses[::SPARSE])]
        return {
            "scene": self.name,
            "leg": self.leg.parameters(),
            "toe": self.system.toe,
            "stops": bool(self.system.stop_names),
            "start": self.parameters["start"],
            "step_s": every * GRID_MS / 1000.0,
            "foot": [list(foot) for foot, _ in feet],
            **({"tip": [list(tip) for _, tip in feet]} if self.system.toe else {}),
            "sparse_step_s": SPARSE * GRID_MS / 1000.0,
            "angles": [list(self.system.absolute(y[:size])) for y in sparse],
            "kinetic": [e[0] for e in energies],
            "spring": [e[1] for e in energies],
            "gravity": [e[2] for e in energies],
            "dissipated": dissipated,
            "impact": list(losses[::SPARSE]),
            "events": event_triples(hybrid.events),
        }, max(abs(value) for value in residual)


def rounded(value):
    """Rounds numbers to 13 decimals."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [rounded(item) for item in value]
    if isinstance(value, (bool, str)):
        return value
    return round(float(value), 13) + 0.0


def write(name, record):
    """Writes JSON with one line per key."""
    lines = [f'"{key}": {json.dumps(value, separators=(",", ":"))}' for key, value in rounded(record).items()]
    GOLDEN.mkdir(exist_ok=True)
    (GOLDEN / f"{name}.json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def differences(one, other):
    """Returns the greatest differences of positions [m] or angles [rad], and of event times [s]."""
    position = max(np.abs(np.subtract(one[key], other[key])).max() for key in ("foot", "tip", "angles") if key in one)
    return position, event_differences(one, other)


def event_triples(events):
    """Returns events as (time [s], gap, transition)."""
    return [[event["time"], event["what"], event["event"]] for event in events]


def event_differences(one, other):
    """Returns the greatest difference of times [s], ignoring the order of simultaneous events."""
    names = [[event[1:] for event in sorted(record["events"])] for record in (one, other)]
    assert names[0] == names[1], f"{one['scene']}: events differ: {names}"
    times = [[event[0] for event in sorted(record["events"])] for record in (one, other)]
    return float(np.abs(np.subtract(*times)).max(initial=0.0))


def print_events(record):
    for at, what, event in record["events"]:
        print(f"    {at * 1e3:12.8f} ms  {what} {event}")


def write_all(names):
    for name in names:
        case, records = Case(name), []
        for method in ("DOP853", "Radau"):
            start_time = time.monotonic()
            hybrid, states, losses = case.run(method)
            record, residual = case.record(hybrid, states, losses)
            records.append(record)
            print(
                f"{name:14} {method:6} {time.monotonic() - start_time:5.1f} s, {hybrid.evaluations} evaluations,"
                f" energy residual {residual:.1e} J, violation of closed gaps {hybrid.max_violation:.1e}",
                flush=True,
            )
        position, instant = differences(*records)
        print(f"{name:14} methods differ by {position:.1e} m or rad, events by {instant:.1e} s")
        print_events(records[0])
        assert position < METHODS_AGREE
        records[0]["methods_differ_m"] = float(f"{position:.1e}")
        write(name, records[0])


def check(names):
    for name in names:
        case = Case(name)
        record, _ = case.record(*case.run("DOP853"))
        golden = json.loads((GOLDEN / f"{name}.json").read_text(encoding="utf-8"))
        assert golden["leg"] == rounded(record["leg"]), f"{name}: the robot file has changed; regenerate the golden files"
        position, instant = differences(rounded(record), golden)
        print(f"golden/{name}.json: differs by {position:.1e} m or rad, events by {instant:.1e} s")
        assert position < MACHINES_AGREE and instant < 1e-9, name


def modes(stiffness=1.0, closed=False):
    """Returns the equilibrium, and frequencies [Hz] and damping ratios of small motions about it."""
    leg = cheetah_cub().legs[0]
    leg.k_d, leg.k_p = leg.k_d * stiffness, leg.k_p * stiffness
    system = PlanarLeg(leg, stops=False)
    zero_rates = np.zeros(3)
    rest = fsolve(lambda q: system.dynamics(q, zero_rates)[1], system.joint_coordinates(0.0, 0.0, 0.1), xtol=1e-14)
    step = 1e-6
    stiff = -np.column_stack(
        [(system.dynamics(rest + d, zero_rates)[1] - system.dynamics(rest - d, zero_rates)[1]) / (2 * step) for d in step * np.eye(3)]
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
        write_all([name for name in arguments if name in CASES] or CASES)
