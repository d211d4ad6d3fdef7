"""Leg as point masses on links, in *relative* joint angles; a thin rod equals three point masses.

Coordinates of a planar mechanism: optionally x, z and pitch of a trunk, then hip, knee, ankle (and
toe) angle, each relative to the previous link. Every point is a constant combination of the unit
vectors of the links; inertia is the sum of m JᵀJ (Kane's method); spring forces and directions of
stops are complex-step derivatives of lengths.
"""

import numpy as np

from robot_file import GRAVITY

STOPS = ["closed", "open", "extended", "bottomed"]
STEP = 1e-30


def rows_of_leg(leg, toe):
    """Returns mass points, masses, and named points, as combinations of the link unit vectors."""
    l1, l2, b, ld = leg.l1, leg.l2, leg.b, leg.ld
    hip, knee, ankle = np.zeros(4), np.array([l1, 0, 0, 0]), np.array([l1, l2, 0, 0])
    foot = np.array([l1, l2, b, 0])
    tip = np.array([l1, l2, b, leg.toe_length])
    inner, outer = np.array([l1 - ld, 0, 0, 0]), np.array([l1, l2, -ld, 0])
    points, masses = [], []
    m1, m2, m3, mf = leg.masses

    def rod(start, end, mass):
        points.extend([start, (start + end) / 2, end])
        masses.extend([mass / 6, 4 * mass / 6, mass / 6])

    rod(hip, knee, m1)
    rod(knee, ankle, m2)
    rod(outer, foot, m3)
    if toe:
        rod(foot, tip, mf)
    else:
        points.append(foot)
        masses.append(mf)
    links = 4 if toe else 3
    named = {"hip": hip, "knee": knee, "ankle": ankle, "foot": foot, "tip": tip, "inner": inner, "outer": outer}
    return np.array(points)[:, :links], np.array(masses), {name: row[:links] for name, row in named.items()}


class PlanarLeg:
    """One leg on a fixed hip, or with `trunk` (mass, inertia about y, x of the hip) on a trunk that
    moves in x, z and pitch.

    `ground` is the height of the ground, if any. World x forward, z up; angles are zero straight
    down and positive forward, pitch is positive nose down.
    """

    def __init__(self, leg, toe=False, trunk=None, stops=True, ground=None):
        self.leg, self.toe, self.trunk, self.ground = leg, toe, trunk, ground
        self.stop_names = STOPS if stops else []
        self.joints = 4 if toe else 3
        self.free = 3 if trunk else 0
        self.size = self.free + self.joints
        points, masses, self.named = rows_of_leg(leg, toe)
        # Link angles by coordinates: cumulative sums of joint angles, minus the pitch.
        self.by = np.hstack([np.zeros((self.joints, self.free)), np.tril(np.ones((self.joints, self.joints)))])
        self.at = np.zeros(self.joints)
        names = ["inner", "outer", "ankle", "foot", "tip" if toe else "foot"]
        special = np.array([self.named[name] for name in names])
        if trunk:
            mass, inertia, hip_x = trunk
            self.by[:, 2] = -1.0
            # A link along the trunk: straight down, rotated by a quarter turn forward.
            self.by = np.vstack([self.by, np.zeros(self.size)])
            self.by[-1, 2] = -1.0
            self.at = np.append(self.at, np.pi / 2)

            def with_trunk_link(rows):
                return np.hstack([rows, np.full((len(rows), 1), hip_x)])

            radius = np.sqrt(inertia / mass)
            body = np.zeros((2, self.joints + 1))
            body[:, -1] = [radius, -radius]
            points, special = np.vstack([with_trunk_link(points), body]), with_trunk_link(special)
            masses = np.append(masses, [mass / 2, mass / 2])
        self.combination, self.masses, self.special = points, masses, special
        self.damping = np.zeros(self.size)
        self.damping[self.free :] = leg.friction[: self.joints]

    # Kinematics of points.

    def positions(self, rows, q):
        angles = self.by @ q + self.at
        positions = rows @ np.stack([np.sin(angles), -np.cos(angles)], axis=1)
        return positions + q[:2] if self.trunk else positions

    def jacobians(self, rows, q):
        """Returns the Jacobians of x and of z, each points × coordinates."""
        angles = self.by @ q + self.at
        x, z = (rows * np.cos(angles)) @ self.by, (rows * np.sin(angles)) @ self.by
        if self.trunk:
            x[:, 0] += 1.0
            z[:, 1] += 1.0
        return x, z

    def drift(self, rows, q, u):
        """Returns accelerations of points at constant rates."""
        angles, squares = self.by @ q + self.at, (self.by @ u) ** 2
        return -rows @ np.stack([np.sin(angles) * squares, -np.cos(angles) * squares], axis=1)

    # Lengths, springs, stops.

    def lengths(self, q):
        """Returns lengths of diagonal and parallel rod, for a pose or rows of poses, real or complex."""
        angles = q @ self.by.T + self.at
        e = np.stack([np.sin(angles), -np.cos(angles)], axis=-1)
        inner, outer, ankle = (np.tensordot(row, e, axes=(0, -2)) for row in self.special[:3])
        diagonal, parallel = ankle - inner, outer - inner
        return np.stack([np.sqrt((diagonal**2).sum(-1)), np.sqrt((parallel**2).sum(-1))], axis=-1)

    def slopes(self, q):
        """Returns gradients of the two lengths, by the complex step: 2 × coordinates."""
        return (self.lengths(q + 1j * STEP * np.eye(self.size)).imag / STEP).T

    def stretches(self, q):
        leg, (diagonal, parallel) = self.leg, self.lengths(q)
        return diagonal - (leg.diagonal_max + leg.preload_d), parallel - (leg.l2 - leg.preload_p)

    def gaps(self, q):
        """Returns the gaps of the stops, and the height of the foot over the ground."""
        leg, gaps = self.leg, []
        if self.stop_names:
            diagonal, parallel = self.lengths(q)
            opening = q[self.free + 1] + q[self.free + 2]
            gaps = [opening, leg.l2 + leg.travel - parallel, leg.diagonal_max - diagonal, diagonal - leg.diagonal_min]
        if self.ground is not None:
            gaps.append(self.positions(self.special[4:], q)[0, 1] - self.ground)
        return np.array(gaps)

    def constraints(self, q, u):
        """Returns directions and drifts of all gaps, then of the tangential motion of the foot."""
        rows, drifts = [], []
        if self.stop_names:
            opening = np.zeros(self.size)
            opening[self.free + 1 : self.free + 3] = 1.0
            d, p = self.slopes(q)
            curved = self.curvatures(q, u)
            rows, drifts = [opening, -p, -d, d], [0.0, -curved[1], -curved[0], curved[0]]
        if self.ground is not None:
            x, z = self.jacobians(self.special[4:], q)
            drift = self.drift(self.special[4:], q, u)[0]
            rows, drifts = [*rows, z[0], x[0]], [*drifts, drift[1], drift[0]]
        return np.array(rows).reshape(-1, self.size), np.array(drifts)

    def curvatures(self, q, u):
        """Returns second derivatives of both lengths at constant rates."""
        special = self.special[:3]
        positions, (x, z), drift = self.positions(special, q), self.jacobians(special, q), self.drift(special, q, u)
        rates = np.stack([x @ u, z @ u], axis=1)
        found = []
        for end in (2, 1):
            span, rate, acceleration = positions[end] - positions[0], rates[end] - rates[0], drift[end] - drift[0]
            length = np.sqrt(span @ span)
            speed = span @ rate / length
            found.append((rate @ rate + span @ acceleration - speed**2) / length)
        return found

    # Dynamics.

    def inertia(self, q):
        x, z = self.jacobians(self.combination, q)
        return x.T @ (self.masses[:, None] * x) + z.T @ (self.masses[:, None] * z)

    def dynamics(self, q, u):
        """Returns inertia and force: inertia · acceleration = force + constraint forces."""
        x, z = self.jacobians(self.combination, q)
        drift = self.drift(self.combination, q, u) * self.masses[:, None]
        inertia = x.T @ (self.masses[:, None] * x) + z.T @ (self.masses[:, None] * z)
        force = -x.T @ drift[:, 0] - z.T @ (drift[:, 1] + GRAVITY * self.masses)
        return inertia, force - self.spring_gradient(q) - self.damping * u

    def spring_gradient(self, q):
        leg, (d, p), slopes = self.leg, self.stretches(q), self.slopes(q)
        gradient = leg.k_d * d * slopes[0] + leg.k_p * p * slopes[1]
        if self.toe:
            gradient[-1] += leg.toe_stiffness * (q[-1] - leg.toe_rest)
        return gradient

    def friction_power(self, u):
        return self.damping @ u**2

    def rates(self, q, u):
        return u

    def energies(self, q, u):
        leg, (d, p) = self.leg, self.stretches(q)
        spring = 0.5 * leg.k_d * d**2 + 0.5 * leg.k_p * p**2
        if self.toe:
            spring += 0.5 * leg.toe_stiffness * (q[-1] - leg.toe_rest) ** 2
        gravity = GRAVITY * self.masses @ self.positions(self.combination, q)[:, 1]
        return 0.5 * u @ self.inertia(q) @ u, spring, gravity

    # Poses.

    def joint_coordinates(self, q1, q2, q3, toe=0.0):
        """Returns joint coordinates from thesis angles, zero for the extended, closed leg."""
        leg = self.leg
        joints = [q1 + leg.hip_ref, q2 - leg.q2_ref, q3 + leg.q2_ref, toe]
        return np.array(joints[: self.joints])

    def absolute(self, q):
        """Returns the angles of the links against the trunk."""
        return np.cumsum(q[self.free :])

    def foot(self, q):
        """Returns the foot (end of the third segment) and the contact point (tip of the toe, if any)."""
        positions = self.positions(self.special, q)
        return positions[3], positions[4]
