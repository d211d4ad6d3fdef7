"""Total mass, centre of mass, inertia and feet of a URDF in Pinocchio.

Input: {"urdf": text, "legs": [names], "states": [{"joints": {joint: angle}}, ...]}; joints that are
not named are zero. Output, one entry per state, in the frame of the trunk, SI units:
{"mass", "states": [{"centre", "inertia", "points": {frame: [x, y, z]}}], "mimic": [the same, joints
that mimic others following them]}.
"""

import json
import sys

import numpy as np
import pinocchio as pin

FRAMES = ["upper", "middle", "lower", "inner", "outer", "foot"]


def evaluated(model, request):
    data = model.createData()
    for state in request["states"]:
        q = pin.neutral(model)
        for name, angle in state["joints"].items():
            joint = model.joints[model.getJointId(name)]
            if joint.nq == 2:  # continuous: cosine and sine
                q[joint.idx_q : joint.idx_q + 2] = [np.cos(angle), np.sin(angle)]
            elif joint.nq == 1 and joint.shortname() != "JointModelMimic":
                q[joint.idx_q] = angle
        pin.framesForwardKinematics(model, data, q)
        # The trunk is fixed to the universe: its mass is that of the universe.
        total = model.inertias[0].copy()
        for number in range(1, model.njoints):
            total += data.oMi[number].act(model.inertias[number])
        points = {
            f"{leg}_{frame}": data.oMf[model.getFrameId(f"{leg}_{frame}")].translation.tolist()
            for leg in request["legs"]
            for frame in FRAMES
        }
        yield {
            "mass": total.mass,
            "centre": total.lever.tolist(),
            "inertia": total.inertia.tolist(),
            "points": points,
        }


request = json.load(sys.stdin)
free = pin.buildModelFromXML(request["urdf"])
closed = pin.buildModelFromXML(request["urdf"], mimic=True)
legs = len(request["legs"])
# Legs that abduct have a joint more.
abductions = sum(name.endswith("_abduction") for name in free.names)
expected = (3 * legs + abductions, 2 * legs + abductions)
assert (free.nv, closed.nv) == expected, (free.nv, closed.nv)
json.dump({"free": list(evaluated(free, request)), "closed": list(evaluated(closed, request))}, sys.stdout)
