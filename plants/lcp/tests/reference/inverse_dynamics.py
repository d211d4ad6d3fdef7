"""Generalised forces of a motion of a robot, by the inverse dynamics of Pinocchio.

Input: {"urdf": text, "states": [{"attitude": [x, y, z, w], "velocity": [6 numbers], "acceleration":
[6 numbers], "joints": {name: [angle, rate, acceleration]}}, …]}, where velocity and acceleration
are those of the coordinates (v, ω) of the trunk in trunk axes. Output: for each state, {"trunk": [6
numbers], "joints": {name: torque}}, SI units.
"""

import json
import sys

import numpy as np
import pinocchio as pin

request = json.load(sys.stdin)
model = pin.buildModelFromXML(request["urdf"], pin.JointModelFreeFlyer())
data = model.createData()
found = []
for state in request["states"]:
    q, v, a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    q[3:7] = state["attitude"]
    v[:6], a[:6] = state["velocity"], state["acceleration"]
    # The joints of the URDF, the trunk's own, and the universe.
    assert len(state["joints"]) == model.njoints - 2, list(model.names)
    joints = {name: model.joints[model.getJointId(name)] for name in state["joints"]}
    for name, (angle, rate, acceleration) in state["joints"].items():
        joint = joints[name]
        # A continuous joint has cosine and sine.
        q[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(angle), np.sin(angle)] if joint.nq == 2 else [angle]
        v[joint.idx_v], a[joint.idx_v] = rate, acceleration
    force = pin.rnea(model, data, q, v, a)
    torques = {name: force[joint.idx_v] for name, joint in joints.items()}
    found.append({"trunk": force[:6].tolist(), "joints": torques})
json.dump(found, sys.stdout)
