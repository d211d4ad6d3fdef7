#!/usr/bin/env python3
"""Free robot as point masses: trajectories of a tumbling flight, and states for the Pinocchio check.

    python3 free_base.py            all cases by DOP853 and Radau; writes golden/*.json, prints the
                                    differences
    python3 free_base.py --check    compares with golden/*.json

Coordinates: position of the centre of mass of the trunk, attitude as a quaternion, relative joint
angles; velocities (v, ω) in trunk axes and joint rates. The trunk is six point masses on its axes.
Inertia is the sum of m JᵀJ over all points.
"""

import json
import sys
import time

import numpy as np

from hybrid import Hybrid
from passive import GOLDEN, MACHINES_AGREE, event_differences, rounded, print_events, event_triples, write
from point_masses import STOPS, PlanarLeg
from robot_file import GRAVITY, ROBOTS, Robot, cheetah_cub


def rotation_matrix(quaternion):
    """Returns the rotation matrix of (w, x, y, z)."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class FreeRobot:
    """Free robot with the stops of all legs, without ground."""

    ground = None

    def __init__(self, robot, toe=False, stops=True):
        self.robot, self.legs = robot, [PlanarLeg(leg, toe=toe, stops=stops) for leg in robot.legs]
        self.joints = self.legs[0].joints
        self.size = 6 + self.joints * len(self.legs)
        self.stop_names = [f"{name} {stop}" for name in robot.names for stop in STOPS] if stops else []
        # Six points on the axes reproduce the moments of the trunk: Σ m x² = (Iyy + Izz − Ixx) / 2,
        # and cyclically.
        spread = np.sum(robot.inertia) / 2 - np.array(robot.inertia)
        reach = np.sqrt(spread * 3 / robot.mass)
        self.body = np.vstack([np.diag(reach), -np.diag(reach)])
        self.masses = np.concatenate([np.full(6, robot.mass / 6), *(leg.masses for leg in self.legs)])
        self.damping = np.concatenate([np.zeros(6), *(leg.damping for leg in self.legs)])

    def of_leg(self, number):
        return slice(6 + number * self.joints, 6 + (number + 1) * self.joints)

    def split(self, q, u):
        """Returns joint angles and rates, leg by leg."""
        count = len(self.legs)
        return q[7:].reshape(count, -1), u[6:].reshape(count, -1)

    def points(self, angles, rates):
        """Returns positions, velocities, accelerations at constant rates and Jacobians of all points
        relative to the trunk, in trunk axes."""
        positions, speeds, accelerations = [self.body], [np.zeros((6, 3))], [np.zeros((6, 3))]
        jacobians = [np.zeros((6, 3, self.size))]
        for number, (leg, q, u) in enumerate(zip(self.legs, angles, rates)):
            position, speed, acceleration_of_leg, jacobian = self.points_of(number, leg.combination, q, u)
            positions.append(position), speeds.append(speed), accelerations.append(acceleration_of_leg), jacobians.append(jacobian)
        return (np.concatenate(parts) for parts in (positions, speeds, accelerations, jacobians))

    def points_of(self, number, rows, q, u):
        leg, count = self.legs[number], len(rows)

        def in_space(planar):
            return np.stack([planar[:, 0], np.zeros(count), planar[:, 1]], axis=1)

        jacobian = np.zeros((count, 3, self.size))
        jacobian[:, 0, self.of_leg(number)], jacobian[:, 2, self.of_leg(number)] = leg.jacobians(rows, q)
        position = self.robot.hips[number] + in_space(leg.positions(rows, q))
        return position, jacobian[:, :, self.of_leg(number)] @ u, in_space(leg.drift(rows, q, u)), jacobian

    @staticmethod
    def with_trunk(positions, jacobians):
        """Returns Jacobians of absolute velocities, in trunk axes: v + ω × r + ṙ."""
        jacobians = jacobians.copy()
        jacobians[:, :, :3] = np.eye(3)
        for axis, unit in enumerate(np.eye(3)):
            jacobians[:, :, 3 + axis] = np.cross(unit, positions)
        return jacobians

    def all_points(self, q, u):
        angles, rates = self.split(q, u)
        positions, speeds, accelerations, jacobians = self.points(angles, rates)
        v, omega = u[:3], u[3:6]
        drifts = np.cross(omega, v) + np.cross(omega, np.cross(omega, positions)) + 2 * np.cross(omega, speeds) + accelerations
        return positions, self.with_trunk(positions, jacobians), drifts

    def inertia_and_bias(self, q, u):
        _, jacobians, drifts = self.all_points(q, u)
        weighted = jacobians * self.masses[:, None, None]
        inertia = np.tensordot(weighted, jacobians, axes=((0, 1), (0, 1)))
        up = rotation_matrix(q[3:7])[2]
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
        return np.concatenate([rotation_matrix(q[3:7]) @ u[:3], by_omega @ u[3:6], u[6:]])

    def gaps(self, q):
        return np.concatenate([leg.gaps(angles) for leg, angles in zip(self.legs, q[7:].reshape(len(self.legs), -1))])

    def constraints(self, q, u):
        angles, rates = self.split(q, u)
        rows, drifts = np.zeros((len(self.stop_names), self.size)), []
        for number, leg in enumerate(self.legs):
            leg_rows, leg_drifts = leg.constraints(angles[number], rates[number])
            rows[len(drifts) : len(drifts) + len(leg_rows), self.of_leg(number)] = leg_rows
            drifts.extend(leg_drifts)
        return rows, np.array(drifts)

    def energies(self, q, u):
        positions, jacobians, _ = self.all_points(q, u)
        speeds = jacobians @ u
        kinetic = 0.5 * self.masses @ (speeds**2).sum(axis=1)
        spring = sum(leg.energies(a, b)[1] for leg, a, b in zip(self.legs, *self.split(q, u)))
        heights = q[2] + positions @ rotation_matrix(q[3:7])[2]
        return kinetic, spring, GRAVITY * self.masses @ heights

    def momenta(self, q, u):
        """Returns linear momentum, and angular momentum about the centre of mass, in world axes."""
        positions, jacobians, _ = self.all_points(q, u)
        attitude = rotation_matrix(q[3:7])
        positions, speeds = positions @ attitude.T, (jacobians @ u) @ attitude.T
        centre = self.masses @ positions / self.masses.sum()
        return self.masses @ speeds, self.masses @ np.cross(positions - centre, speeds)

    def feet(self, q, point=4):
        """Returns the contact points (foot, or tip of the toe) and their Jacobians, in world axes; with
        `point` = 3 the ends of the third segments."""
        attitude, found = rotation_matrix(q[3:7]), []
        for number, angles in enumerate(q[7:].reshape(len(self.legs), -1)):
            rows = self.legs[number].special[point : point + 1]
            position, _, _, jacobian = self.points_of(number, rows, angles, np.zeros(self.joints))
            found.append((q[:3] + attitude @ position[0], attitude @ self.with_trunk(position, jacobian)[0]))
        return found


# States for the Pinocchio check.


def absolute(system):
    """Returns the matrix from absolute to relative velocities."""
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
                        "feet": [list(position) for position, _ in feet],
                        "jacobians": [list((jacobian @ to_relative).ravel()) for _, jacobian in feet],
                        "acceleration": list(np.linalg.solve(to_relative, acceleration)),
                    }
                )




# Trajectories.

# Tolerance for the two methods [m, 1]: errors grow over 58 successive events.
METHODS_AGREE = 1e-10

TIMES = np.arange(0, 301, 20) / 1000.0
# Three of four legs, so that the trunk rotates about every axis; all start equally, with the trunk
# level and at rest.
LEGS = ["LF", "RF", "RH"]
START = {"angles_deg": [10.0, -25.0, 37.0], "rates": [30.0, -10.0, 12.0]}
BETWEEN = {"preload_m": -4e-3, "travel_m": 14e-3}

CASES = {
    # Springs with their equilibrium between the stops, none of which is reached: smooth motion only.
    "tumble": {**BETWEEN},
    "tumble-undamped": {**BETWEEN, "damping": 0.0},
    "tumble-toe": {**BETWEEN, "toe": True},
    # Nominal robot: one leg, whose stops act on the trunk, and three, whose impacts open stops of
    # other legs.
    "tumble-leg": {"legs": ["LF"]},
    "tumble-stops": {},
}
CHEAP = ["tumble-toe"]


class Case:
    def __init__(self, name):
        self.name, self.parameters = name, CASES[name]
        robot = cheetah_cub()
        selected = [robot.names.index(name) for name in self.parameters.get("legs", LEGS)]
        robot.names, robot.legs = [robot.names[k] for k in selected], [robot.legs[k] for k in selected]
        robot.hips = robot.hips[selected]
        for leg in robot.legs:
            leg.travel = self.parameters.get("travel_m", leg.travel)
            leg.preload_d = leg.preload_p = self.parameters.get("preload_m", leg.preload_d)
            leg.friction = [value * self.parameters.get("damping", 1.0) for value in leg.friction]
        self.system = FreeRobot(robot, self.parameters.get("toe", False))

    def start(self):
        system = self.system
        angles = [leg.joint_coordinates(*np.radians(START["angles_deg"]), leg.leg.toe_rest) for leg in system.legs]
        rates = [[*START["rates"], 0.0][: system.joints]] * len(system.legs)
        q = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], *angles])
        # The lowest foot starts at height zero.
        q[2] = -min(position[2] for position, _ in system.feet(q))
        return q, np.concatenate([np.zeros(6), *rates])

    def run(self, method):
        hybrid = Hybrid(self.system, method=method, rtol=1e-12, atol=(1e-14, 1e-12))
        return hybrid, *hybrid.run(*self.start(), TIMES)

    def record(self, hybrid, states, active, losses):
        system = self.system
        parts = [(y[: -system.size - 1], y[-system.size - 1 : -1], y[-1]) for y in states]
        energies = [system.energies(q, u) for q, u, _ in parts]
        momenta = [system.momenta(q, u) for q, u, _ in parts]
        fall = GRAVITY * system.masses.sum() * TIMES
        balance = [sum(e) + part[2] + loss for e, part, loss in zip(energies, parts, losses)]
        deviations = {
            "energy balance [J]": np.ptp(balance),
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
            "feet": [[list(position) for position, _ in system.feet(q, point=3)] for q, _, _ in parts],
            "energy": [sum(e) for e in energies],
            "dissipated": [d for _, _, d in parts],
            "impact": list(losses),
            "angular_momentum": [list(p[1]) for p in momenta[:1]],
            "events": event_triples(hybrid.events),
        }, deviations


def differences(one, other):
    """Returns the greatest differences of positions [m] or quaternions [1], and of event times [s]."""
    position = max(np.abs(np.subtract(one[key], other[key])).max() for key in ("position", "orientation", "feet"))
    return position, event_differences(one, other)


def write_all(names):
    for name in names:
        case, records = Case(name), []
        for method in ("DOP853", "Radau"):
            start_time = time.monotonic()
            run = case.run(method)
            record, deviations = case.record(*run)
            records.append(record)
            print(f"{name} {method} {time.monotonic() - start_time:.1f} s, {run[0].evaluations} evaluations; deviations: ", end="")
            print(", ".join(f"{key} {value:.1e}" for key, value in deviations.items()), flush=True)
        position, instant = differences(*records)
        print(f"{name}: methods differ by {position:.1e} m or 1, events by {instant:.1e} s")
        print_events(records[0])
        assert position < METHODS_AGREE
        records[0]["methods_differ_m"] = float(f"{position:.1e}")
        write(name, records[0])


def check(names):
    for name in names:
        case = Case(name)
        record, _ = case.record(*case.run("DOP853"))
        golden = json.loads((GOLDEN / f"{name}.json").read_text(encoding="utf-8"))
        position, instant = differences(rounded(record), golden)
        print(f"golden/{name}.json: differs by {position:.1e} m or 1, events by {instant:.1e} s")
        assert position < MACHINES_AGREE and instant < 1e-9, name


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        check(CHEAP)
    else:
        write_all([name for name in sys.argv[1:] if name in CASES] or CASES)
