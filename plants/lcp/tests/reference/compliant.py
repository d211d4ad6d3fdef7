#!/usr/bin/env python3
"""Robot with compliant stops, cables and soles: Newton's law of point masses in the world frame.

    python3 compliant.py < CASE    integrates a case (JSON) and prints its trajectory (JSON)

Every body is point masses: a thin rod three, the trunk six. With the position of a point relative to
the trunk's centre of mass s = R r(q), the velocity u = (v, ω, q̇) in *world* axes and relative joint
angles q, the acceleration of a point is

    J u̇ + ω × (ω × s) + 2 ω × R ṙ + R r̈    J = (1, −s×, R ∂r/∂q)    r̈ at constant q̇

and the projection of m a = m g + F on the columns of J gives u̇. Springs, stops and cables are pairs of
opposite forces F on two points of the mechanism; the sole is a force on the foot. The mechanism is
described at `point_masses.rows_of_leg`.

One-sided element, of depth x, stiffness k, damping c and toe region δ, with t = clamp(x, 0, δ) and
p = max(x, 0):

    F = max(0, k (t²/2δ + p − t) + c (t/δ) ẋ)

    extended     x = a (u − u(l_d,max))      pulls the ends of the diagonal together
    bottomed     x = b (1/u − 1/u(l_d,min))  pushes them apart
    open         x = l_p − l₂ − travel       pulls the ends of the parallel rod together
    closed       x = l_Δ (θ₁ − θ₃)           torques ∓l_Δ F on the first and the third segment
    dead-centre  x = l_Δ (W²/w − W), w < W   torques −F ∂x/∂q on the joints
    cable        x = l_c − l_c,max + rφ      pulls ankle and hip together, and brakes the pulley by r F
    sole         x = −z                      pushes the foot up

Extended and bottomed, here as functions of the diagonal, u² = (l_d² − (l₂ − l_Δ)²)/((l₂ + l_Δ)² − l_d²);
a and b give each depth the slope ±1 with respect to l_d at its limit. Rod and third segment are in one
line where w = sin q₃ + (l_Δ/l₂) sin(q₂ + q₃) is zero; W = 0.1.

Friction of the sole, with the velocity v along the ground, the bristle z, and the elastic part F_e of
the normal force F:

    F_t = −µ b z/max(|z|, z_s) − µ (F − b) v/√(v² + v₀²)
    ż = r v − (max(r |v|/z_s, h⁺) − h⁻ (1 − min(|z|/z_s, 1)²) + (1 − g)/τ) z
    S = F_e + k δ/8   b = g min(F, S)   r = (b/S) z_s/max(|z|, z_s)   h = Ṡ/2S = h⁺ − h⁻
    g = clamp(x/0.5 δ, 0, 1)   τ = 2 ms   v₀ = 50 mm/s

Servo, with set-point s, lag T and the torque line |τ| ≤ τ_max clamp(1 ∓ q̇/q̇_max, 0, 1): q̈ =
(4/T) (clamp((s − q)/T, ±q̇_max) − q̇) as long as torque and load permit.
"""

import json
import sys

import numpy as np
from scipy.integrate import solve_ivp

from free_base import rotation_matrix
from point_masses import rows_of_leg
from robot_file import GRAVITY, cheetah_cub

ENGAGEMENT, RELAXATION, SLOW = 0.5, 2e-3, 5e-2
LEAST = 0.1
NAMED = ["hip", "inner", "outer", "ankle", "foot"]
ELEMENTS = ["extended", "bottomed", "open", "closed", "dead-centre", "cable", "sole"]
# Whether the trunk moves along x, y, z, and turns about these axes.
BASES = {"fixed": [0, 0, 0, 0, 0, 0], "planar": [1, 0, 1, 0, 1, 0], "free": [1, 1, 1, 1, 1, 1]}


def elastic_force(element, depth):
    """Returns the elastic part of the force of one-sided elements."""
    pressed = np.maximum(depth, 0.0)
    toe = np.minimum(pressed, element.toe_region)
    return element.stiffness * (toe**2 / (2 * element.toe_region) + pressed - toe)


def press(element, depth, rate):
    """Returns the force of one-sided elements."""
    toe = np.clip(depth, 0.0, element.toe_region) / element.toe_region
    return np.maximum(elastic_force(element, depth) + element.damping * toe * rate, 0.0)


def knee(leg, length):
    """Returns u of a length of the diagonal, and its derivative."""
    least, most = length**2 - (leg.l2 - leg.ld) ** 2, (leg.l2 + leg.ld) ** 2 - length**2
    u = np.sqrt(least / most)
    return u, length * (least + most) / (most**2 * u)


def cross_matrices(s):
    """Returns the matrices −s× of vectors."""
    x, y, z = s.T
    o = np.zeros_like(x)
    return np.stack([o, z, -y, -z, o, x, y, -x, o], axis=-1).reshape(-1, 3, 3)


class Servo:
    def __init__(self, values):
        self.lag, self.speed, self.torque, self.inertia = (values[key] for key in ("lag", "speed", "torque", "inertia"))

    def acceleration(self, set_point, position, rate):
        return 4 / self.lag * (np.clip((set_point - position) / self.lag, -self.speed, self.speed) - rate)

    def limited(self, torque, rate):
        upper = self.torque * np.clip(1 - rate / self.speed, 0, 1)
        lower = -self.torque * np.clip(1 + rate / self.speed, 0, 1)
        return np.clip(torque, lower, upper)


class CompliantRobot:
    """The robot of a case. State: position and attitude of the trunk (w, x, y, z), u, joint angles,
    pulley angles and rates, and bristles, each of all legs in turn."""

    def __init__(self, case):
        robot = cheetah_cub()
        chosen = [robot.names.index(name) for name in case["legs"]]
        self.leg, self.hips, self.legs = robot.legs[0], robot.hips[chosen], len(chosen)
        for name, value in case["leg"].items():
            setattr(self.leg, name, value)
        self.size = 6 + 3 * self.legs
        self.moves = np.ones(self.size, bool)
        self.moves[:6] = BASES[case["base"]]
        self.friction = case["friction"]
        self.servo = Servo(case["servo"]) if case["servo"] else None
        rows, masses, named = rows_of_leg(self.leg, toe=False)
        self.rows = np.vstack([rows, [named[name] for name in NAMED]])
        # Six points on the axes with the moments of inertia of the trunk, as in free_base.py.
        reach = np.sqrt((np.sum(robot.inertia) / 2 - np.array(robot.inertia)) * 3 / robot.mass)
        self.body = np.vstack([np.diag(reach), -np.diag(reach)])
        leg_masses = np.append(masses, np.zeros(len(NAMED)))
        self.masses = np.concatenate([np.full(6, robot.mass / 6), np.tile(leg_masses, self.legs)])
        self.damping = np.array(self.leg.friction[:3])
        # Greatest depths, and evaluations with a hip at the limit of its torque.
        self.depths, self.saturated = {name: -np.inf for name in ELEMENTS}, 0

    def start(self, state, names):
        """Returns the state of a plant state: world axes, but angular velocity in trunk axes, and the
        angles of segments from the trunk's downward axis."""

        def of_legs(key):
            return np.array([state[f"leg/{name}/{key}"] for name in names])

        attitude = np.array(state["body/orientation"])
        turning = rotation_matrix(attitude) @ state["body/angular_velocity"]
        joints, rates = (np.diff(of_legs(key), axis=1, prepend=0.0) for key in ("angles", "rates"))
        pulleys = of_legs("knee/position").ravel(), of_legs("knee/rate").ravel()
        parts = [state["body/position"], attitude, state["body/velocity"], turning, rates.ravel(), joints.ravel()]
        return np.concatenate([*parts, *pulleys, np.zeros(2 * self.legs)])

    def split(self, y):
        n, legs = self.size, self.legs
        u, rest = y[7 : 7 + n], y[7 + n :]
        joints, rest = rest[: 3 * legs].reshape(legs, 3), rest[3 * legs :]
        return y[:3], y[3:7], u, joints, rest[:legs], rest[legs : 2 * legs], rest[2 * legs :].reshape(legs, 2)

    def points(self, joints, rates):
        """Returns positions, velocities, accelerations at constant rates and ∂r/∂q of the points of all
        legs, in trunk axes."""
        angles, turns = np.cumsum(joints, axis=1), np.cumsum(rates, axis=1)[:, :, None]
        sine, cosine, zero = np.sin(angles), np.cos(angles), np.zeros_like(angles)
        e, n = np.stack([sine, zero, -cosine], axis=-1), np.stack([cosine, zero, sine], axis=-1)
        # A joint turns all segments beyond it.
        by_segment = self.rows[None, :, :, None] * n[:, None]
        by_joint = by_segment[:, :, ::-1].cumsum(axis=2)[:, :, ::-1]
        return self.hips[:, None] + self.rows @ e, self.rows @ (n * turns), self.rows @ (-e * turns**2), by_joint

    def pressed(self, name, element, depth, rate):
        self.depths[name] = max(self.depths[name], float(np.max(depth)))
        return press(element, depth, rate)

    def internal_forces(self, r, r_dot, joints, rates, pulley, pulley_rate):
        """Returns forces on the named points in trunk axes, joint torques and the tension of cables."""
        leg, forces = self.leg, np.zeros((self.legs, len(NAMED), 3))

        def span(start, end):
            first, last = r[:, NAMED.index(start)], r[:, NAMED.index(end)]
            length = np.linalg.norm(last - first, axis=1)
            direction = (last - first) / length[:, None]
            rate = np.sum(direction * (r_dot[:, NAMED.index(end)] - r_dot[:, NAMED.index(start)]), axis=1)
            return length, rate, direction

        def pull(start, end, tension, direction):
            forces[:, NAMED.index(start)] += tension[:, None] * direction
            forces[:, NAMED.index(end)] -= tension[:, None] * direction

        length, rate, direction = span("inner", "ankle")
        tension = leg.k_d * (length - (leg.diagonal_max + leg.preload_d))
        u, slope = knee(leg, length)
        limit, limit_slope = knee(leg, leg.diagonal_max)
        slope_out = slope / limit_slope
        tension += slope_out * self.pressed("extended", leg.stops, (u - limit) / limit_slope, slope_out * rate)
        limit, limit_slope = knee(leg, leg.diagonal_min)
        scale = limit**2 / limit_slope
        slope_in = scale * slope / u**2
        tension -= slope_in * self.pressed("bottomed", leg.stops, scale * (1 / u - 1 / limit), -slope_in * rate)
        pull("inner", "ankle", tension, direction)

        length, rate, direction = span("inner", "outer")
        tension = leg.k_p * (length - (leg.l2 - leg.preload_p))
        tension += self.pressed("open", leg.stops, length - (leg.l2 + leg.travel), rate)
        pull("inner", "outer", tension, direction)

        # θ₁ − θ₃ = −(q₂ + q₃).
        opening, opening_rate = joints[:, 1] + joints[:, 2], rates[:, 1] + rates[:, 2]
        closed = self.pressed("closed", leg.stops, -leg.ld * opening, -leg.ld * opening_rate)
        torques = -self.damping * rates
        torques[:, 1:] += leg.ld * closed[:, None]

        ratio, bent = leg.ld / leg.l2, joints[:, 1] + joints[:, 2]
        w = np.sin(joints[:, 2]) + ratio * np.sin(bent)
        slope = -leg.ld * LEAST**2 / w**2
        by_joint = slope[:, None] * np.stack([ratio * np.cos(bent), np.cos(joints[:, 2]) + ratio * np.cos(bent)], axis=1)
        rate = np.sum(by_joint * rates[:, 1:], axis=1)
        kept = self.pressed("dead-centre", leg.stops, leg.ld * (LEAST**2 / w - LEAST), rate)
        torques[:, 1:] -= by_joint * kept[:, None]

        cable = np.zeros(self.legs)
        if self.servo:
            length, rate, direction = span("hip", "ankle")
            longest = np.sqrt(leg.l1**2 + leg.l2**2 + 2 * leg.l1 * leg.l2 * np.cos(leg.q2_ref))
            depth = length - longest + leg.pulley_radius * pulley
            cable = self.pressed("cable", leg.cable, depth, rate + leg.pulley_radius * pulley_rate)
            pull("hip", "ankle", cable, direction)
        return forces, torques, cable

    def ground(self, feet, velocities, bristles):
        """Returns the forces of level ground at height zero, and the rates of the bristles."""
        sole, limit = self.leg.sole, self.leg.slip_deflection
        depth, sinking, slip = -feet[:, 2], -velocities[:, 2], velocities[:, :2]
        normal = self.pressed("sole", sole, depth, sinking)
        scale = elastic_force(sole, depth) + sole.stiffness * sole.toe_region / 8
        h = sole.stiffness * np.clip(depth / sole.toe_region, 0, 1) * sinking / (2 * scale)
        g = np.clip(depth / (ENGAGEMENT * sole.toe_region), 0, 1)
        borne = g * np.minimum(normal, scale)
        stretch, speed = np.linalg.norm(bristles, axis=1), np.linalg.norm(slip, axis=1)
        held = borne / np.maximum(stretch, limit)
        forces = np.zeros((self.legs, 3))
        forces[:, 2] = normal
        viscous = (normal - borne) / np.sqrt(speed**2 + SLOW**2)
        forces[:, :2] = -self.friction * (held[:, None] * bristles + viscous[:, None] * slip)
        r = limit * held / scale
        decay = np.maximum(r * speed / limit, np.maximum(h, 0)) + (1 - g) / RELAXATION
        decay -= np.maximum(-h, 0) * (1 - np.minimum(stretch / limit, 1) ** 2)
        return forces, r[:, None] * slip - decay[:, None] * bristles

    def slope(self, y, hip_set_points, knee_set_points):
        """Returns the time derivative of a state."""
        position, attitude, u, joints, pulley, pulley_rate, bristles = self.split(y)
        rates, omega = u[6:].reshape(self.legs, 3), u[3:6]
        rotation = rotation_matrix(attitude)
        r, r_dot, r_ddot, by_joint = self.points(joints, rates)

        def in_world(body, of_legs):
            return np.vstack([body, of_legs.reshape(-1, 3)]) @ rotation.T

        s, s_dot, s_ddot = in_world(self.body, r), in_world(0 * self.body, r_dot), in_world(0 * self.body, r_ddot)
        jacobian = np.zeros((len(s), 3, self.size))
        jacobian[:, :, :3] = np.eye(3)
        jacobian[:, :, 3:6] = cross_matrices(s)
        for leg, columns in enumerate(by_joint @ rotation.T):
            first = 6 + leg * len(columns)
            jacobian[first : first + len(columns), :, 6 + 3 * leg : 9 + 3 * leg] = columns.swapaxes(1, 2)
        turning = -cross_matrices(omega[None])[0]
        bias = (s @ turning.T + 2 * s_dot) @ turning.T + s_ddot

        forces, torques, cable = self.internal_forces(r[:, -len(NAMED) :], r_dot[:, -len(NAMED) :], joints, rates, pulley, pulley_rate)
        forces, bristle_rates = forces @ rotation.T, np.zeros_like(bristles)
        if self.friction is not None:
            feet = np.arange(1, self.legs + 1) * len(self.rows) + 5
            ground, bristle_rates = self.ground(position + s[feet], jacobian[feet] @ u, bristles)
            forces[:, -1] += ground
        applied = -self.masses[:, None] * (bias + [0.0, 0.0, GRAVITY])
        applied[6:].reshape(self.legs, -1, 3)[:, -len(NAMED) :] += forces

        flat = jacobian.reshape(-1, self.size)
        inertia = flat.T @ (np.repeat(self.masses, 3)[:, None] * flat)
        force = flat.T @ applied.ravel() + np.concatenate([np.zeros(6), torques.ravel()])
        acceleration = self.accelerations(inertia, force, joints[:, 0], rates[:, 0], hip_set_points)
        winding = np.zeros(self.legs)
        if self.servo:
            servo, load = self.servo, self.leg.pulley_radius * cable
            wanted = servo.acceleration(knee_set_points, pulley, pulley_rate)
            winding = (servo.limited(servo.inertia * wanted + load, pulley_rate) - load) / servo.inertia
        w, i, j, k = attitude
        turned = 0.5 * np.array([[-i, -j, -k], [w, k, -j], [-k, w, i], [j, -i, w]]) @ omega
        return np.concatenate([u[:3], turned, acceleration, u[6:], pulley_rate, winding, bristle_rates.ravel()])

    def accelerations(self, inertia, force, hips, hip_rates, set_points):
        """Solves for u̇. Servos impose the acceleration of the hips; where that takes too much torque, the
        limit acts, on the inertia of the rotor, too."""
        if not self.servo:
            return self.solved(inertia, force, np.zeros(0, int), np.zeros(0))
        columns = 6 + 3 * np.arange(self.legs)
        wanted = self.servo.acceleration(set_points, hips, hip_rates)
        acceleration = self.solved(inertia, force, columns, wanted)
        torque = (inertia @ acceleration - force)[columns] + self.servo.inertia * wanted
        limit = self.servo.limited(torque, hip_rates)
        saturated = limit != torque
        if saturated.any():
            self.saturated += 1
            inertia, force = inertia.copy(), force.copy()
            inertia[columns[saturated], columns[saturated]] += self.servo.inertia
            force[columns[saturated]] += limit[saturated]
            acceleration = self.solved(inertia, force, columns[~saturated], wanted[~saturated])
        return acceleration

    def solved(self, inertia, force, columns, imposed):
        acceleration, is_free = np.zeros(self.size), self.moves.copy()
        acceleration[columns], is_free[columns] = imposed, False
        inertia, force = inertia[is_free], force[is_free]
        acceleration[is_free] = np.linalg.solve(inertia[:, is_free], force - inertia[:, columns] @ imposed)
        return acceleration

    def feet(self, y):
        position, attitude, _, joints, *_ = self.split(y)
        r = self.points(joints, np.zeros_like(joints))[0][:, -1]
        return position + r @ rotation_matrix(attitude).T

    def grips(self, y):
        """Returns |z|/z_s of feet on the ground, −1 of others."""
        share = np.linalg.norm(self.split(y)[-1], axis=1) / self.leg.slip_deflection
        return np.where(self.feet(y)[:, 2] < 0.0, share, -1.0)


def run(case):
    """Integrates a case piecewise between the instants at which its commands change."""
    robot = CompliantRobot(case)
    y = robot.start(case["state"], case["legs"])
    period, commands = case["period_s"], np.array(case["commands"]).reshape(-1, robot.legs, 2)
    before, states = commands[0], [y]
    for command in commands[1:]:
        # A linear set-point goes from the command before to this one.
        start, rate = (before, (command - before) / period) if case["linear"] else (command, 0.0 * command)

        def slope(time, y):
            set_points = start + rate * time
            return robot.slope(y, set_points[:, 0] + robot.leg.hip_ref, set_points[:, 1])

        tolerances = {"rtol": case["tolerance"], "atol": 1e-2 * case["tolerance"], "max_step": 5e-4}
        solution = solve_ivp(slope, (0.0, period), y, method="DOP853", **tolerances)
        assert solution.success, solution.message
        y, before = solution.y[:, -1], command
        states.append(y)
    return {
        "positions": [[y[:3].tolist(), robot.feet(y).tolist()] for y in states[1:]],
        "grips": [robot.grips(y).tolist() for y in states[1:]],
        "pressed": [name for name, depth in robot.depths.items() if depth > 0.0],
        "saturated": robot.saturated,
    }


if __name__ == "__main__":
    json.dump(run(json.load(sys.stdin)), sys.stdout)
