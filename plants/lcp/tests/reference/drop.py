#!/usr/bin/env python3
"""A trunk with one leg that lands on the ground: impact, stick, slip, stops, lift-off, each at its instant.

    python3 drop.py            every scene by DOP853 and by Radau; writes golden/*.json, prints how far they differ
    python3 drop.py --check    compares with golden/*.json

The trunk moves in x, z and pitch, the hip hangs at its centre of mass and has no drive, the foot is a point (friction 0.6,
restitution 0). Trunk level and at rest at the start, the foot at height zero, the ground lower.
"""

import json
import sys
import time

import numpy as np

from hybrid import Hybrid
from passive import FEET, GOLDEN, GRID_MS, MACHINES_AGREE, METHODS_AGREE, SPARSE, TIMES, of_events, short, tell, triples, write
from point_masses import PlanarLeg
from robot_file import cheetah_cub

FRICTION = 0.6
SCENES = {
    # Lands while a stop is closed, stands, slides, stands, lifts off while it slides back.
    "drop": {"angles_deg": [-5.0, -20.0, 22.0], "rates": [0.0, 0.0, 0.0], "fall_m": 0.01},
    # The leg swings back, brushes the ground, and lands again later.
    "stride": {"angles_deg": [20.0, -30.0, 34.0], "rates": [-40.0, 0.0, 0.0], "fall_m": 0.004},
}
CHEAP = ["drop"]


class Scene:
    def __init__(self, name):
        self.name, self.given = name, SCENES[name]
        robot = cheetah_cub()
        self.system = PlanarLeg(robot.legs[0], trunk=(robot.mass, robot.inertia[1], 0.0), ground=-self.given["fall_m"])

    def start(self):
        given, system = self.given, self.system
        q = np.concatenate([np.zeros(3), system.joint_coordinates(*np.radians(given["angles_deg"]))])
        q[1] = -system.foot(q)[1][1]
        return q, np.array([0.0, 0.0, 0.0, *given["rates"]])

    def run(self, method):
        hybrid = Hybrid(self.system, friction=FRICTION, method=method)
        return hybrid, *hybrid.run(*self.start(), TIMES)

    def record(self, hybrid, states, held, lost):
        system = self.system
        parts = [(y[: system.size], y[system.size : -1], y[-1]) for y in states]
        energies = [sum(system.energies(q, u)) for q, u, _ in parts]
        sparse = parts[::SPARSE]
        return {
            "scene": self.name,
            "friction": FRICTION,
            "start": self.given,
            "step_s": FEET * GRID_MS / 1000.0,
            "trunk": [list(q[:3]) for q, _, _ in parts[::FEET]],
            "foot": [list(system.foot(q)[1]) for q, _, _ in parts[::FEET]],
            "sparse_step_s": SPARSE * GRID_MS / 1000.0,
            "angles": [list(system.absolute(q)) for q, _, _ in sparse],
            "energy": energies[::SPARSE],
            "joint_friction": [d for _, _, d in sparse],
            "impact": list(lost[::SPARSE]),
            "events": triples(hybrid.events),
        }


def differences(one, other):
    place = max(np.abs(np.subtract(one[key], other[key])).max() for key in ("trunk", "foot", "angles"))
    return place, of_events(one, other)


def write_all(names):
    for name in names:
        scene, records = Scene(name), []
        for method in ("DOP853", "Radau"):
            began = time.monotonic()
            run = scene.run(method)
            records.append(scene.record(*run))
            figures = f"{time.monotonic() - began:.1f} s, {run[0].evaluations} evaluations, held gaps drift {run[0].drift:.1e}"
            print(f"{name} {method} {figures}", flush=True)
        place, instant = differences(*records)
        print(f"{name}: the two differ by {place:.1e} m or rad, events by {instant:.1e} s")
        tell(records[0])
        assert place < METHODS_AGREE
        records[0]["methods_differ_m"] = float(f"{place:.1e}")
        write(name, records[0])


def check(names):
    for name in names:
        scene = Scene(name)
        record = short(scene.record(*scene.run("DOP853")))
        golden = json.loads((GOLDEN / f"{name}.json").read_text(encoding="utf-8"))
        place, instant = differences(record, golden)
        print(f"golden/{name}.json: off by {place:.1e} m or rad, events by {instant:.1e} s")
        assert place < MACHINES_AGREE and instant < 1e-9, name


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        check(CHEAP)
    else:
        write_all([name for name in sys.argv[1:] if name in SCENES] or SCENES)
