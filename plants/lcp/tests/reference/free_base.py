#!/usr/bin/env python3
"""The whole robot, free in space, as point masses: trajectories of a tumbling flight, and states for the Pinocchio check.

    python3 free_base.py            every scene by DOP853 and by Radau; writes golden/*.json, prints how far they differ
    python3 free_base.py --check    compares with golden/*.json

Coordinates: place of the trunk's centre of mass, attitude as a quaternion, relative joint angles; velocities (v, ω) in
trunk axes and joint rates. The trunk itself is six point masses on its axes. Inertia is the sum of m JᵀJ over all points.
"""

import json
import sys
import time

import numpy as np

from hybrid import Hybrid
from passive import GOLDEN, MACHINES_AGREE, of_events, short, tell, triples, write
from point_masses import STOPS, PlanarLeg
from robot_file import GRAVITY, ROBOTS, Robot, cheetah_cub


def turn(quaternion):
    """Rotation matrix of (w, x, y, z)."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class FreeRobot:
    """Stops of all legs, no ground."""

    ground = None

    def __init__(self, robot, toe=False, stops=True):
        self.robot, self.legs = robot, [PlanarLeg(leg, toe=toe, stops=stops) for leg in robot.legs]
        self.joints = self.legs[0].joints
        self.size = 6 + self.joints * len(self.legs)
        self.stop_names = [f"{name} {stop}" for name in robot.names for stop in STOPS] if stops else []
        # Six points on the axes have the trunk's moments: Σ m x² = (Iyy + Izz − Ixx) / 2, and so on.
        spread = np.sum(robot.inertia) / 2 - np.array(robot.inertia)
        reach = np.sqrt(spread * 3 / robot.mass)
        self.body = np.vstack([np.diag(reach), -np.diag(reach)])
        self.masses = np.concatenate([np.full(6, robot.mass / 6), *(leg.masses for leg in self.legs)])
        self.damping = np.concatenate([np.zeros(6), *(leg.damping for leg in self.legs)])

    def of_leg(self, number):
        return slice(6 + number * self.joints, 6 + (number + 1) * self.joints)

    def split(self, q, u):
        """Joint angles and rates, leg by leg."""
        count = len(self.legs)
        return q[7:].reshape(count, -1), u[6:].reshape(count, -1)

    def points(self, angles, rates):
        """In trunk axes: places, velocities and Jacobians against the trunk, accelerations at constant rates."""
        places, speeds, bends = [self.body], [np.zeros((6, 3))], [np.zeros((6, 3))]
        jacobians = [np.zeros((6, 3, self.size))]
        for number, (leg, q, u) in enumerate(zip(self.legs, angles, rates)):
            place, speed, bend, jacobian = self.points_of(number, leg.combination, q, u)
            places.append(place), speeds.append(speed), bends.append(bend), jacobians.append(jacobian)
        return (np.concatenate(parts) for parts in (places, speeds, bends, jacobians))

    def points_of(self, number, rows, q, u):
        leg, count = self.legs[number], len(rows)

        def in_space(planar):
            return np.stack([planar[:, 0], np.zeros(count), planar[:, 1]], axis=1)

        jacobian = np.zeros((count, 3, self.size))
        jacobian[:, 0, self.of_leg(number)], jacobian[:, 2, self.of_leg(number)] = leg.jacobians(rows, q)
        place = self.robot.hips[number] + in_space(leg.place(rows, q))
        return place, jacobian[:, :, self.of_leg(number)] @ u, in_space(leg.drift(rows, q, u)), jacobian

    @staticmethod
    def with_trunk(places, jacobians):
        """Jacobians of velocities in space, in trunk axes: v + ω × r + ṙ."""
        jacobians = jacobians.copy()
        jacobians[:, :, :3] = np.eye(3)
        for axis, unit in enumerate(np.eye(3)):
            jacobians[:, :, 3 + axis] = np.cross(unit, places)
        return jacobians

    def all_points(self, q, u):
        angles, rates = self.split(q, u)
        places, speeds, bends, jacobians = self.points(angles, rates)
        v, omega = u[:3], u[3:6]
        drifts = np.cross(omega, v) + np.cross(omega, np.cross(omega, places)) + 2 * np.cross(omega, speeds) + bends
        return places, self.with_trunk(places, jacobians), drifts

    def inertia_and_bias(self, q, u):
        _, jacobians, drifts = self.all_points(q, u)
        weighted = jacobians * self.masses[:, None, None]
        inertia = np.tensordot(weighted, jacobians, axes=((0, 1), (0, 1)))
        up = turn(q[3:7])[2]
        return inertia, np.tensordot(weighted, drifts + GRAVITY * up, axes=((0, 1), (0, 1)))

    def inertia(self, q):
        return self.inertia_and_bias(q, np.zeros(self.size))[0]

    def dynamics(self, q, u):
        inertia, bias = self.inertia_and_bias(q, u)
        force = -bias - self.damping * u
        for number, (leg, angles) in enumerate(zip(self.legs, self.split(q, u)[0])):
            force[self.of_leg(number)] -= leg.spring_gradient(angles)
        return inertia, force

    def friction_power(self, u):
        return self.damping @ u**2

    def rates(self, q, u):
        w, x, y, z = q[3:7]
        by_omega = 0.5 * np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
        return np.concatenate([turn(q[3:7]) @ u[:3], by_omega @ u[3:6], u[6:]])

    def gaps(self, q):
        return np.concatenate([leg.gaps(angles) for leg, angles in zip(self.legs, q[7:].reshape(len(self.legs), -1))])

    def constraints(self, q, u):
        angles, rates = self.split(q, u)
        rows, drifts = np.zeros((len(self.stop_names), self.size)), []
        for number, leg in enumerate(self.legs):
            own, drift = leg.constraints(angles[number], rates[number])
            rows[len(drifts) : len(drifts) + len(own), self.of_leg(number)] = own
            drifts.extend(drift)
        return rows, np.array(drifts)

    def energies(self, q, u):
        places, jacobians, _ = self.all_points(q, u)
        speeds = jacobians @ u
        kinetic = 0.5 * self.masses @ (speeds**2).sum(axis=1)
        spring = sum(leg.energies(a, b)[1] for leg, a, b in zip(self.legs, *self.split(q, u)))
        heights = q[2] + places @ turn(q[3:7])[2]
        return kinetic, spring, GRAVITY * self.masses @ heights

    def momenta(self, q, u):
        """Linear, and angular about the centre of mass, in world axes."""
        places, jacobians, _ = self.all_points(q, u)
        attitude = turn(q[3:7])
        places, speeds = places @ attitude.T, (jacobians @ u) @ attitude.T
        centre = self.masses @ places / self.masses.sum()
        return self.masses @ speeds, self.masses @ np.cross(places - centre, speeds)

    def feet(self, q, point=4):
        """What touches the ground (foot, with toe its tip), world; and its Jacobians in world axes. Or, as point 3, the end of
        the third segment."""
        attitude, found = turn(q[3:7]), []
        for number, angles in enumerate(q[7:].reshape(len(self.legs), -1)):
            rows = self.legs[number].special[point : point + 1]
            place, _, _, jacobian = self.points_of(number, rows, angles, np.zeros(self.joints))
            found.append((q[:3] + attitude @ place[0], attitude @ self.with_trunk(place, jacobian)[0]))
        return found


# States for the Pinocchio check.


def absolute(system):
    """Relative velocities from absolute ones."""
    one = np.eye(system.joints) - np.eye(system.joints, k=-1)
    matrix = np.eye(system.size)
    for number in range(len(system.legs)):
        matrix[system.of_leg(number), system.of_leg(number)] = one
    return matrix


def probe(states):
    rng = np.random.default_rng(1)
    for name in ("cheetah-cub", "oncilla"):
        for toe in (False, True):
            system = FreeRobot(Robot(ROBOTS / f"{name}.toml"), toe)
            to_relative = absolute(system)
            yield json.dumps({"robot": name, "toe": toe})
            for _ in range(states):
                joints = rng.uniform([-1, -1.9, 0.3, -1], [1, -0.3, 2.4, 1], (len(system.legs), 4))[:, : system.joints]
                attitude = rng.normal(size=4)
                q = np.concatenate([rng.normal(size=3), attitude / np.linalg.norm(attitude), joints.ravel()])
                u = rng.normal(size=system.size) * ([1.0] * 3 + [5.0] * (system.size - 3))
                inertia, bias = system.inertia_and_bias(q, u)
                kinetic, spring, gravity = system.energies(q, u)
                feet = system.feet(q)
                acceleration = np.linalg.solve(*system.dynamics(q, u))
                yield json.dumps(
                    {
                        "position": list(q[:3]),
                        "orientation": list(q[3:7]),
                        "angles": [list(np.cumsum(angles)) for angles in joints],
                        "velocity": list(np.linalg.solve(to_relative, u)),
                        "inertia": list((to_relative.T @ inertia @ to_relative).ravel()),
                        "bias": list(to_relative.T @ bias),
                        "kinetic": kinetic,
                        "spring": spring,
                        "gravity": gravity,
                        "feet": [list(place) for place, _ in feet],
                        "jacobians": [list((jacobian @ to_relative).ravel()) for _, jacobian in feet],
                        "acceleration": list(np.linalg.solve(to_relative, acceleration)),
                    }
                )




# Trajectories.

# How exactly the two methods must agree [m, 1]: by 58 events one after the other, errors grow.
METHODS_AGREE = 1e-10

TIMES = np.arange(0, 301, 20) / 1000.0
# Three legs of four, so that the trunk turns about every axis; all start alike, the trunk level and at rest.
LEGS = ["LF", "RF", "RH"]
START = {"angles_deg": [10.0, -25.0, 37.0], "rates": [30.0, -10.0, 12.0]}
BETWEEN = {"preload_m": -4e-3, "travel_m": 14e-3}

SCENES = {
    # Springs whose rest lies between the stops, none of which is reached: nothing happens but smooth motion.
    "tumble": {**BETWEEN},
    "tumble-undamped": {**BETWEEN, "damping": 0.0},
    "tumble-toe": {**BETWEEN, "toe": True},
    # The robot as it is: one leg, whose stops the trunk feels, and three, whose stops knock each other open.
    "tumble-leg": {"legs": ["LF"]},
    "tumble-stops": {},
}
CHEAP = ["tumble-toe"]


class Scene:
    def __init__(self, name):
        self.name, self.given = name, SCENES[name]
        robot = cheetah_cub()
        kept = [robot.names.index(name) for name in self.given.get("legs", LEGS)]
        robot.names, robot.legs = [robot.names[k] for k in kept], [robot.legs[k] for k in kept]
        robot.hips = robot.hips[kept]
        for leg in robot.legs:
            leg.travel = self.given.get("travel_m", leg.travel)
            leg.preload_d = leg.preload_p = self.given.get("preload_m", leg.preload_d)
            leg.friction = [value * self.given.get("damping", 1.0) for value in leg.friction]
        self.system = FreeRobot(robot, self.given.get("toe", False))

    def start(self):
        system = self.system
        angles = [leg.joint_coordinates(*np.radians(START["angles_deg"]), leg.leg.toe_rest) for leg in system.legs]
        rates = [[*START["rates"], 0.0][: system.joints]] * len(system.legs)
        q = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], *angles])
        # The lowest foot starts at height zero.
        q[2] = -min(place[2] for place, _ in system.feet(q))
        return q, np.concatenate([np.zeros(6), *rates])

    def run(self, method):
        hybrid = Hybrid(self.system, method=method, rtol=1e-12, atol=(1e-14, 1e-12))
        return hybrid, *hybrid.run(*self.start(), TIMES)

    def record(self, hybrid, states, held, lost):
        system = self.system
        parts = [(y[: -system.size - 1], y[-system.size - 1 : -1], y[-1]) for y in states]
        energies = [system.energies(q, u) for q, u, _ in parts]
        momenta = [system.momenta(q, u) for q, u, _ in parts]
        fall = GRAVITY * system.masses.sum() * TIMES
        books = [sum(e) + part[2] + loss for e, part, loss in zip(energies, parts, lost)]
        drift = {
            "energy books [J]": np.ptp(books),
            "momentum [N·s]": np.abs([p[0] + [0, 0, f] - momenta[0][0] for p, f in zip(momenta, fall)]).max(),
            "angular momentum [N·m·s]": np.abs([p[1] - momenta[0][1] for p in momenta]).max(),
            "norm of the quaternion": max(abs(np.linalg.norm(q[3:7]) - 1) for q, _, _ in parts),
        }
        leg = system.legs[0]
        return {
            "scene": self.name,
            "robot": system.robot.name,
            "legs": system.robot.names,
            "preload_m": leg.leg.preload_d,
            "travel_m": leg.leg.travel,
            "friction": leg.leg.friction,
            "toe": leg.toe,
            "start": START,
            "step_s": float(TIMES[1]),
            "position": [list(q[:3]) for q, _, _ in parts],
            "orientation": [list(q[3:7] / np.linalg.norm(q[3:7])) for q, _, _ in parts],
            "feet": [[list(place) for place, _ in system.feet(q, point=3)] for q, _, _ in parts],
            "energy": [sum(e) for e in energies],
            "dissipated": [d for _, _, d in parts],
            "impact": list(lost),
            "angular_momentum": [list(p[1]) for p in momenta[:1]],
            "events": triples(hybrid.events),
        }, drift


def differences(one, other):
    """Greatest of places [m] and quaternions [1], and of the times of events [s]."""
    place = max(np.abs(np.subtract(one[key], other[key])).max() for key in ("position", "orientation", "feet"))
    return place, of_events(one, other)


def write_all(names):
    for name in names:
        scene, records = Scene(name), []
        for method in ("DOP853", "Radau"):
            began = time.monotonic()
            run = scene.run(method)
            record, drift = scene.record(*run)
            records.append(record)
            print(f"{name} {method} {time.monotonic() - began:.1f} s, {run[0].evaluations} evaluations; drift: ", end="")
            print(", ".join(f"{key} {value:.1e}" for key, value in drift.items()), flush=True)
        place, instant = differences(*records)
        print(f"{name}: the two differ by {place:.1e} m or 1, events by {instant:.1e} s")
        tell(records[0])
        assert place < METHODS_AGREE
        records[0]["methods_differ_m"] = float(f"{place:.1e}")
        write(name, records[0])


def check(names):
    for name in names:
        scene = Scene(name)
        record, _ = scene.record(*scene.run("DOP853"))
        golden = json.loads((GOLDEN / f"{name}.json").read_text(encoding="utf-8"))
        place, instant = differences(short(record), golden)
        print(f"golden/{name}.json: off by {place:.1e} m or 1, events by {instant:.1e} s")
        assert place < MACHINES_AGREE and instant < 1e-9, name


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        check(CHEAP)
    else:
        write_all([name for name in sys.argv[1:] if name in SCENES] or SCENES)
