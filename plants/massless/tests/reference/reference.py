#!/usr/bin/env python3
"""Reference trajectories of the robot with massless legs, independent of the Rust code.

The model is written in joint space: the coordinates are the trunk's x, z and pitch and, per leg, the
absolute angles of its second and third segment; the hip follows the equation of its servo. Spring
energies are trigonometric formulas with gradients by the complex step, friction is Rayleigh's
dissipation function, and a foot on the ground is pinned by a Lagrange multiplier. The plant uses foot
positions as coordinates, vectors for energies and impulses for forces: only the physics is shared.
DOP853 integrates to 1e-12.

No event occurs in these cases, which is checked here (margins of stops, cable, ground and friction
cone).

To regenerate the files of ci/golden/massless (numpy and scipy, any recent version):

    python3 plants/massless/tests/reference/reference.py ci/golden/massless
"""

import pathlib
import sys

import numpy as np
from scipy.integrate import solve_ivp

# Cheetah-cub's leg as in `twinrig_robot::Leg::example()`, with a longer travel of the parallel rod.
L1, L2, L3, LD = 0.0442, 0.0714, 0.0544, 0.015
B = L3 - LD
Q2_REF = np.radians(35.0)
KD, KP = 4400.0, 1800.0
TRAVEL, DIAGONAL_MIN = 0.014, 0.063
C_HIP, C_KNEE, C_ANKLE = 1e-3, 1e-3, 1e-3
M_FOOT = 0.03
# Trunk, and the mass of each leg at its hip (20 g).
M_TRUNK, I_TRUNK, M_HUNG, X_HIP = 0.9, 3.2176e-3, 0.02, 0.1
SERVO_INERTIA = 1e-3
G = 9.81

A = L1 + B
LENGTH_MAX = np.sqrt(A**2 + L2**2 + 2 * A * L2 * np.cos(Q2_REF))
HIP_REF = np.arccos((A**2 + LENGTH_MAX**2 - L2**2) / (2 * A * LENGTH_MAX))
DIAGONAL_MAX = np.sqrt(L2**2 + LD**2 + 2 * L2 * LD * np.cos(Q2_REF))


def along(angle):
    """Unit vector of a link: zero points down, positive swings forward."""
    return np.array([np.sin(angle), -np.cos(angle)])


def across(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def lengths(a1, a2, a3):
    """Diagonal, parallel rod and hip-to-ankle by the law of cosines."""
    diagonal = np.sqrt(L2**2 + LD**2 + 2 * L2 * LD * np.cos(a2 - a1))
    parallel = np.sqrt(
        L2**2 + 2 * LD**2 + 2 * L2 * LD * (np.cos(a2 - a1) - np.cos(a3 - a2)) - 2 * LD**2 * np.cos(a3 - a1)
    )
    cable = np.sqrt(L1**2 + L2**2 + 2 * L1 * L2 * np.cos(a2 - a1))
    return diagonal, parallel, cable


CABLE_MAX = lengths(0.0, -Q2_REF, 0.0)[2]


class Case:
    """`hips`: x of each hip; `command`: hip commands at a time, relative to the reference pose."""

    def __init__(self, name, hips, planar, pinned, preload, lag, command):
        self.name, self.hips, self.planar, self.pinned = name, hips, planar, pinned
        self.preload, self.lag, self.command = preload, lag, command
        self.n = len(hips)
        self.dof = 3 + 2 * self.n
        self.mass = M_TRUNK + M_HUNG * self.n
        self.inertia = I_TRUNK + sum(M_HUNG * x * x for x in hips)

    def energy(self, q, hips):
        """Energy of springs and gravity, also for complex arguments."""
        _, z, pitch = q[:3]
        total = self.mass * G * z
        rest_d, rest_p = DIAGONAL_MAX + self.preload, L2 - self.preload
        for k in range(self.n):
            a1, a2, a3 = hips[k] - pitch, q[3 + 2 * k], q[4 + 2 * k]
            diagonal, parallel, _ = lengths(a1, a2, a3)
            total = total + 0.5 * KD * (diagonal - rest_d) ** 2 + 0.5 * KP * (parallel - rest_p) ** 2
            foot_z = z - self.hips[k] * np.sin(pitch) - L1 * np.cos(a1) - L2 * np.cos(a2) - B * np.cos(a3)
            total = total + M_FOOT * G * foot_z
        return total

    def gradient(self, q, hips):
        """Gradient with respect to coordinates and hip angles, by the complex step."""
        variables = np.concatenate([q, hips]).astype(complex)
        slopes = np.empty(len(variables))
        for i in range(len(variables)):
            moved = variables.copy()
            moved[i] += 1e-30j
            slopes[i] = self.energy(moved[: self.dof], moved[self.dof :]).imag / 1e-30
        return slopes

    def foot(self, k, q, hip):
        pitch = q[2]
        return (
            q[:2]
            + self.hips[k] * np.array([np.cos(pitch), -np.sin(pitch)])
            + L1 * along(hip - pitch)
            + L2 * along(q[3 + 2 * k])
            + B * along(q[4 + 2 * k])
        )

    def foot_jacobian(self, k, q, hip):
        """Jacobian with respect to the coordinates, and to the hip angle."""
        pitch = q[2]
        jacobian = np.zeros((2, self.dof))
        jacobian[0, 0] = jacobian[1, 1] = 1.0
        jacobian[:, 2] = self.hips[k] * np.array([-np.sin(pitch), -np.cos(pitch)]) - L1 * across(hip - pitch)
        jacobian[:, 3 + 2 * k] = L2 * across(q[3 + 2 * k])
        jacobian[:, 4 + 2 * k] = B * across(q[4 + 2 * k])
        return jacobian, L1 * across(hip - pitch)

    def foot_bias(self, k, q, v, hip, hip_rate):
        """Acceleration of a foot at constant rates."""
        pitch = q[2]
        return (
            -self.hips[k] * np.array([np.cos(pitch), -np.sin(pitch)]) * v[2] ** 2
            - L1 * along(hip - pitch) * (hip_rate - v[2]) ** 2
            - L2 * along(q[3 + 2 * k]) * v[3 + 2 * k] ** 2
            - B * along(q[4 + 2 * k]) * v[4 + 2 * k] ** 2
        )

    def split(self, y):
        n, d = self.n, self.dof
        return y[:d], y[d : 2 * d], y[2 * d : 2 * d + n], y[2 * d + n :]

    def accelerations(self, t, y):
        """Accelerations of coordinates and hips, torques of the hips, ground forces on pinned feet."""
        q, v, hips, hip_rates = self.split(y)
        commands = np.array(self.command(t)) + HIP_REF
        hip_acc = 4.0 / self.lag * ((commands - hips) / self.lag - hip_rates)
        slopes = self.gradient(q, hips)
        mass = np.zeros((self.dof, self.dof))
        mass[0, 0] = mass[1, 1] = self.mass
        mass[2, 2] = self.inertia
        force = -slopes[: self.dof]
        torque = slopes[self.dof :] + SERVO_INERTIA * hip_acc + C_HIP * hip_rates
        feet = []
        for k in range(self.n):
            jacobian, by_hip = self.foot_jacobian(k, q, hips[k])
            bias = self.foot_bias(k, q, v, hips[k], hip_rates[k]) + by_hip * hip_acc[k]
            mass += M_FOOT * jacobian.T @ jacobian
            force -= M_FOOT * jacobian.T @ bias
            knee = C_KNEE * (v[3 + 2 * k] - hip_rates[k] + v[2])
            ankle = C_ANKLE * (v[4 + 2 * k] - v[3 + 2 * k])
            force[2] -= knee
            force[3 + 2 * k] -= knee - ankle
            force[4 + 2 * k] -= ankle
            torque[k] -= knee
            feet.append((jacobian, by_hip, bias))
        free = list(range(0 if self.planar else 3, self.dof))
        acc = np.zeros(self.dof)
        ground = np.zeros((self.n, 2))
        if self.pinned:
            rows = np.vstack([jacobian for jacobian, _, _ in feet])[:, free]
            size = len(rows)
            system = np.block([[mass[np.ix_(free, free)], -rows.T], [rows, np.zeros((size, size))]])
            right = np.concatenate([force[free], -np.concatenate([bias for _, _, bias in feet])])
            solution = np.linalg.solve(system, right)
            acc[free] = solution[: len(free)]
            ground = solution[len(free) :].reshape(self.n, 2)
        else:
            acc[free] = np.linalg.solve(mass[np.ix_(free, free)], force[free])
        for k, (jacobian, by_hip, bias) in enumerate(feet):
            torque[k] += by_hip @ (M_FOOT * (jacobian @ acc + bias) - ground[k])
        return acc, hip_acc, torque, ground

    def derivative(self, t, y):
        _, v, _, hip_rates = self.split(y)
        acc, hip_acc, _, _ = self.accelerations(t, y)
        return np.concatenate([v, acc, hip_rates, hip_acc])

    def start(self):
        hips = np.array(self.command(0.0)) + HIP_REF
        q = np.zeros(self.dof)
        for k in range(self.n):
            q[3 + 2 * k], q[4 + 2 * k] = hips[k] - Q2_REF, hips[k]
        q[1] = -min(self.foot(k, q, hips[k])[1] for k in range(self.n))
        return np.concatenate([q, np.zeros(self.dof), hips, np.zeros(self.n)])

    def margins(self, t, y):
        """Margins of closed, open, extended, bottomed and cable [m], and of the friction cone [1]."""
        q, _, hips, _ = self.split(y)
        least = [np.inf] * 6
        for k in range(self.n):
            diagonal, parallel, cable = lengths(hips[k] - q[2], q[3 + 2 * k], q[4 + 2 * k])
            gaps = [parallel - L2, L2 + TRAVEL - parallel, DIAGONAL_MAX - diagonal, diagonal - DIAGONAL_MIN, CABLE_MAX - cable]
            if self.pinned:
                x, z = self.accelerations(t, y)[3][k]
                gaps.append(1.0 - abs(x) / z if z > 0 else -1.0)
            least[: len(gaps)] = np.minimum(least[: len(gaps)], gaps)
        return least

    def run(self):
        times = np.arange(0, 301, 20) * 1e-3
        middles = times[1:] - 0.5e-3
        every = np.unique(np.concatenate([np.arange(1, 601) * 0.5e-3, times, middles]))
        solution = solve_ivp(
            self.derivative, (0.0, 0.3), self.start(), method="DOP853", t_eval=every, rtol=1e-12, atol=1e-13, max_step=1e-3
        )
        assert solution.success, solution.message
        least = np.min([self.margins(t, y) for t, y in zip(solution.t, solution.y.T) if t > 2e-3], axis=0)
        print(self.name, "least margins:", np.array2string(least, precision=2))
        assert min(least) > 0.0
        at = {round(t * 1e7): y for t, y in zip(solution.t, solution.y.T)}
        header = ["time_s", "x", "z", "pitch"]
        for k in range(self.n):
            header += [f"foot{k}_x", f"foot{k}_z", f"torque{k}_before", f"force{k}_x_before", f"force{k}_z_before"]
        lines = [",".join(header)]
        for time in times[1:]:
            q, _, hips, _ = self.split(at[round(time * 1e7)])
            _, _, torque, ground = self.accelerations(time - 0.5e-3, at[round((time - 0.5e-3) * 1e7)])
            row = [time, *q[:3]]
            for k in range(self.n):
                row += [*self.foot(k, q, hips[k]), torque[k], *ground[k]]
            lines.append(",".join(f"{value if abs(value) > 1e-14 else 0.0:.13g}" for value in row))
        return "\n".join(lines) + "\n"


CASES = [
    # Stretched springs without preload: in the air the foot swings about a pose between the stops.
    Case("swing", [X_HIP], False, False, -0.004, 5e-3, lambda t: [0.1 + 0.25 * (1 - np.cos(15 * t))]),
    Case(
        "flight", [X_HIP, -X_HIP], True, False, -0.004, 5e-3,
        lambda t: [0.1 + 0.2 * np.sin(12 * t), -0.2 - 0.15 * np.sin(9 * t)],
    ),
    # Feet on the ground; the trunk bounces and sways.
    Case(
        "stance", [X_HIP, -X_HIP], True, True, 0.0, 5e-3,
        lambda t: [0.06 * (1 - np.cos(20 * t)), 0.06 * (1 - np.cos(20 * t))],
    ),
]

if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1])
    for case in CASES:
        (folder / f"{case.name}.csv").write_text(case.run())
