#!/usr/bin/env python3
"""Comparison of the dynamics of the full plant with Pinocchio, state by state.

    cargo run --release -p twinrig-lcp --example probe | python3 pinocchio_check.py [FILE]

builds the robot for Pinocchio from a URDF generated from the robot file, and compares inertia, bias,
energies, feet and accelerations. Fails (exit code 1) on a deviation of more than 1e-10 of the scale.

Input: one JSON object per line. For every model first

    {"robot": "cheetah-cub", "toe": false}

then any number of states, in SI units, with legs in the order of the robot file, absolute link angles
(against the trunk; zero straight down, positive forward), n = 6 + legs · (3, with toe 4):

    {"position": [x, y, z],             of the trunk's centre of mass, world
     "orientation": [w, x, y, z],       trunk to world
     "angles": [[θ1, θ2, θ3], …],       of each leg, with toe also θ4
     "velocity": [n numbers],           (v, ω) of the trunk in trunk axes, then θ̇ leg by leg
     "inertia": [n · n numbers],        M, row by row
     "bias": [n numbers],               M u̇ + bias = generalised force; includes gravity,
                                        excludes springs and friction
     "kinetic": T, "spring": V, "gravity": G,
     "feet": [[x, y, z], …],            contact points: foot, or tip of the toe; world
     "jacobians": [[3 · n numbers], …]  of each foot's velocity in the world, row by row
     "acceleration": [n numbers]}       u̇ under springs, joint friction and gravity only

The gravity energy is compared up to one constant per model. `--self` generates states from the point
masses of free_base.py instead, which verifies the check itself.
"""

import json
import sys

import numpy as np
import pinocchio as pin

from robot_file import ROBOTS, Robot

TOLERANCE = 1e-10
JOINTS = ["hip", "knee", "ankle", "toe"]


def rod(name, start, end, mass):
    """Returns a link: a uniform thin rod between two positions on the z axis of its joint."""
    middle, square = (start + end) / 2, mass * (start - end) ** 2 / 12
    return (
        f'<link name="{name}"><inertial><origin xyz="0 0 {middle!r}"/><mass value="{mass!r}"/>'
        f'<inertia ixx="{square!r}" iyy="{square!r}" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(name, kind, parent, child, position):
    x, y, z = (float(value) for value in position)
    axis = '<axis xyz="0 -1 0"/><limit effort="1e3" velocity="1e3" lower="-9" upper="9"/>' if kind == "revolute" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{x!r} {y!r} {z!r}"/>{axis}</joint>'
    )


def urdf(robot, toe):
    """Returns the URDF. Joints are relative, about −y, and zero with all links straight down."""
    ixx, iyy, izz = robot.inertia
    parts = [
        f'<link name="trunk"><inertial><mass value="{robot.mass!r}"/>'
        f'<inertia ixx="{ixx!r}" iyy="{iyy!r}" izz="{izz!r}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    ]

    def add_frame(name, parent, z):
        parts.append(f'<link name="{name}"/>')
        parts.append(joint(f"{name}_at", "fixed", parent, name, (0, 0, z)))

    for name, hip, leg in zip(robot.names, robot.hips, robot.legs):
        m1, m2, m3, foot = leg.masses
        first, second, third, fourth = (f"{name}_{number}" for number in ("first", "second", "third", "foot"))
        parts += [
            joint(f"{name}_hip", "revolute", "trunk", first, hip),
            rod(first, 0.0, -leg.l1, m1),
            joint(f"{name}_knee", "revolute", first, second, (0, 0, -leg.l1)),
            rod(second, 0.0, -leg.l2, m2),
            joint(f"{name}_ankle", "revolute", second, third, (0, 0, -leg.l2)),
            rod(third, leg.ld, -leg.b, m3),
            joint(f"{name}_toe", "revolute" if toe else "fixed", third, fourth, (0, 0, -leg.b)),
            rod(fourth, 0.0, -leg.toe_length if toe else 0.0, foot),
        ]
        add_frame(f"{name}_inner", first, -(leg.l1 - leg.ld))
        add_frame(f"{name}_tip", fourth, -leg.toe_length if toe else 0.0)
        add_frame(f"{name}_outer", third, leg.ld)
    return f'<?xml version="1.0"?><robot name="robot">{"".join(parts)}</robot>'


class PinocchioModel:
    """Pinocchio model of a robot, evaluated in the coordinates of the plant."""

    def __init__(self, robot, toe):
        self.robot, self.toe, self.joints = robot, toe, 4 if toe else 3
        self.model = pin.buildModelFromXML(urdf(robot, toe), pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        self.size = self.model.nv
        # Indices of joints and frames of each leg in the order of Pinocchio.
        self.at = [
            [self.model.joints[self.model.getJointId(f"{name}_{joint}")].idx_v for joint in JOINTS[: self.joints]]
            for name in robot.names
        ]
        self.frames = {
            key: [self.model.getFrameId(f"{name}_{key}") for name in robot.names] for key in ("inner", "outer", "third", "tip")
        }
        # Transformation of velocities from the plant to Pinocchio: joint rates are differences of
        # link rates.
        self.to_relative = np.zeros((self.size, self.size))
        self.to_relative[:6, :6] = np.eye(6)
        relative = np.eye(self.joints) - np.eye(self.joints, k=-1)
        for leg, indices in enumerate(self.at):
            first = 6 + leg * self.joints
            self.to_relative[np.ix_(indices, range(first, first + self.joints))] = relative

    def compare(self, state):
        """Returns relative deviations by quantity, and both gravity energies."""
        model, data = self.model, self.data
        w, x, y, z = state["orientation"]
        q = np.concatenate([state["position"], [x, y, z, w], np.zeros(self.size - 6)])
        for angles, indices in zip(state["angles"], self.at):
            q[np.array(indices) + 1] = np.diff(angles, prepend=0.0)
        u = np.array(state["velocity"])
        v = self.to_relative @ u
        pin.computeAllTerms(model, data, q, v)
        pin.updateFramePlacements(model, data)
        inertia = np.triu(data.M) + np.triu(data.M, 1).T
        inertia, bias = self.to_relative.T @ inertia @ self.to_relative, self.to_relative.T @ data.nle
        kinetic, gravity = pin.computeKineticEnergy(model, data, q, v), pin.computePotentialEnergy(model, data, q)
        feet = [data.oMf[frame].translation for frame in self.frames["tip"]]
        jacobians = [self.linear(q, frame) @ self.to_relative for frame in self.frames["tip"]]
        spring, force = self.springs(q)
        for leg, indices in zip(self.robot.legs, self.at):
            force[indices] -= np.array(leg.friction[: self.joints]) * v[indices]
        # aba requires separate data: it would reuse results of computeAllTerms.
        acceleration = np.linalg.solve(self.to_relative, pin.aba(model, model.createData(), q, v, force))
        shape = inertia.shape
        found = {
            "inertia": deviation(np.reshape(state["inertia"], shape), inertia),
            "bias": deviation(state["bias"], bias),
            "kinetic": deviation(state["kinetic"], kinetic),
            "spring": deviation(state["spring"], spring),
            "feet": deviation(state["feet"], feet),
            "jacobians": deviation(np.reshape(state["jacobians"], np.shape(jacobians)), jacobians),
            "acceleration": deviation(state["acceleration"], acceleration),
        }
        return found, (state["gravity"], gravity)

    def linear(self, q, frame):
        """Returns the Jacobian of the origin of a frame in world axes."""
        return pin.computeFrameJacobian(self.model, self.data, q, frame, pin.LOCAL_WORLD_ALIGNED)[:3]

    def springs(self, q):
        """Returns the spring energy and the generalised force, its negative gradient."""
        energy, force = 0.0, np.zeros(self.size)
        keys = ("inner", "outer", "third")
        for number, (leg, indices) in enumerate(zip(self.robot.legs, self.at)):
            inner, outer, ankle = (self.data.oMf[self.frames[key][number]].translation for key in keys)
            by_inner, by_outer, by_ankle = (self.linear(q, self.frames[key][number]) for key in keys)
            for span, by, stiffness, rest in [
                (ankle - inner, by_ankle - by_inner, leg.k_d, leg.diagonal_max + leg.preload_d),
                (outer - inner, by_outer - by_inner, leg.k_p, leg.l2 - leg.preload_p),
            ]:
                length = np.linalg.norm(span)
                energy += 0.5 * stiffness * (length - rest) ** 2
                force -= stiffness * (length - rest) / length * span @ by
            if self.toe:
                bend = q[indices[-1] + 1] - leg.toe_rest
                energy += 0.5 * leg.toe_stiffness * bend**2
                force[indices[-1]] -= leg.toe_stiffness * bend
        return energy, force


def deviation(found, expected):
    """Returns the greatest deviation relative to the greatest magnitude."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape, f"{found.shape} numbers instead of {expected.shape}"
    assert np.isfinite(found).all(), "a number is not finite"
    return np.abs(found - expected).max() / np.abs(expected).max()


def check(lines):
    """Prints the greatest deviations of every model; returns whether all are within the tolerance."""
    passed, reference, worst, gravity, count = True, None, {}, [], 0

    def report_model():
        nonlocal passed, worst, gravity, count
        if reference is None:
            return
        if count:
            pairs = np.array(gravity)
            worst["gravity"] = np.ptp(pairs[:, 0] - pairs[:, 1]) / np.ptp(pairs[:, 1]) if count > 1 else 0.0
        within_tolerance = count > 0 and max(worst.values()) <= TOLERANCE
        passed = passed and within_tolerance
        figures = ", ".join(f"{key} {value:.1e}" for key, value in worst.items())
        print(f"{reference.robot.name}{' with toe' if reference.toe else ''}: {count} states; worst: {figures}{'' if within_tolerance else '  FAILED'}")
        worst, gravity, count = {}, [], 0

    for line in lines:
        entry = json.loads(line)
        if "robot" in entry:
            report_model()
            reference = PinocchioModel(Robot(ROBOTS / f"{entry['robot']}.toml"), entry["toe"])
            continue
        found, energies = reference.compare(entry)
        worst = {key: max(value, worst.get(key, 0.0)) for key, value in found.items()}
        gravity.append(energies)
        count += 1
    report_model()
    return passed and reference is not None


if __name__ == "__main__":
    if "--self" in sys.argv[1:]:
        from free_base import probe

        source = probe(states=50)
    else:
        source = open(sys.argv[1], encoding="utf-8") if len(sys.argv) > 1 else sys.stdin
    sys.exit(0 if check(source) else 1)
