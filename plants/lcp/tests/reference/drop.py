#!/usr/bin/env python3
"""Landing of a trunk with one leg: impact, stick, slip, stops and lift-off with exact event times.

    python3 drop.py            all cases by DOP853 and Radau; writes golden/*.json, prints the
                               differences
    python3 drop.py --check    compares with golden/*.json

The trunk moves in x, z and pitch, the hip is at its centre of mass and has no drive, the foot is a
point (friction 0.6, restitution 0). Initially the trunk is level and at rest, the foot at height
zero, and the ground lower.
"""

import json
import sys
import time

import numpy as np

from hybrid import Hybrid
from passive import FEET, GOLDEN, GRID_MS, MACHINES_AGREE, METHODS_AGREE, SPARSE, TIMES, event_differences, rounded, print_events, event_triples, write
from point_masses import PlanarLeg
from robot_file import cheetah_cub

FRICTION = 0.6
CASES = {
    # Lands while a stop is closed, sticks, slides, sticks, lifts off while sliding back.
    "drop": {"angles_deg": [-5.0, -20.0, 22.0], "rates": [0.0, 0.0, 0.0], "fall_m": 0.01},
    # The leg swings back, touches the ground briefly, and lands again later.
    "stride": {"angles_deg": [20.0, -30.0, 34.0], "rates": [-40.0, 0.0, 0.0], "fall_m": 0.004},
}
CHEAP = ["drop"]


class Case:
    def __init__(self, name):
        self.name, self.parameters = name, CASES[name]
        robot = cheetah_cub()
        self.system = PlanarLeg(robot.legs[0], trunk=(robot.mass, robot.inertia[1], 0.0), ground=-self.parameters["fall_m"])

    def start(self):
        parameters, system = self.parameters, self.system
        q = np.concatenate([np.zeros(3), system.joint_coordinates(*np.radians(parameters["angles_deg"]))])
        q[1] = -system.foot(q)[1][1]
        return q, np.array([0.0, 0.0, 0.0, *parameters["rates"]])

    def run(self, method):
        hybrid = Hybrid(self.system, friction=FRICTION, method=method)
        return hybrid, *hybrid.run(*self.start(), TIMES)

    def record(self, hybrid, states, active, losses):
        system = self.system
        parts = [(y[: system.size], y[system.size : -1], y[-1]) for y in states]
        energies = [sum(system.energies(q, u)) for q, u, _ in parts]
        sparse = parts[::SPARSE]
        return {
            "scene": self.name,
            "friction": FRICTION,
            "start": self.parameters,
            "step_s": FEET * GRID_MS / 1000.0,
            "trunk": [list(q[:3]) for q, _, _ in parts[::FEET]],
            "foot": [list(system.foot(q)[1]) for q, _, _ in parts[::FEET]],
            "sparse_step_s": SPARSE * GRID_MS / 1000.0,
            "angles": [list(system.absolute(q)) for q, _, _ in sparse],
            "energy": energies[::SPARSE],
            "joint_friction": [d for _, _, d in sparse],
            "impact": list(losses[::SPARSE]),
            "events": event_triples(hybrid.events),
        }


def differences(one, other):
    position = max(np.abs(np.subtract(one[key], other[key])).max() for key in ("trunk", "foot", "angles"))
    return position, event_differences(one, other)


def write_all(names):
    for name in names:
        case, records = Case(name), []
        for method in ("DOP853", "Radau"):
            start_time = time.monotonic()
            run = case.run(method)
            records.append(case.record(*run))
            figures = f"{time.monotonic() - start_time:.1f} s, {run[0].evaluations} evaluations, violation of closed gaps {run[0].max_violation:.1e}"
            print(f"{name} {method} {figures}", flush=True)
        position, instant = differences(*records)
        print(f"{name}: methods differ by {position:.1e} m or rad, events by {instant:.1e} s")
        print_events(records[0])
        assert position < METHODS_AGREE
        records[0]["methods_differ_m"] = float(f"{position:.1e}")
        write(name, records[0])


def check(names):
    for name in names:
        case = Case(name)
        record = rounded(case.record(*case.run("DOP853")))
        golden = json.loads((GOLDEN / f"{name}.json").read_text(encoding="utf-8"))
        position, instant = differences(record, golden)
        print(f"golden/{name}.json: differs by {position:.1e} m or rad, events by {instant:.1e} s")
        assert position < MACHINES_AGREE and instant < 1e-9, name


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        check(CHEAP)
    else:
        write_all([name for name in sys.argv[1:] if name in CASES] or CASES)
