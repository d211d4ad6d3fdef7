"""Voltage of a piezoelectric cell with its charge amplifier, by scipy.signal.

Reads {"gain", "amplifier_time", "silicone_time", "period", "force"} from standard input; the load
is linear between its samples. Prints the voltages at the samples.
"""

import json
import sys

import numpy as np
from scipy import signal

case = json.load(sys.stdin)
t1, t2 = case["amplifier_time"], case["silicone_time"]
system = signal.TransferFunction([-case["gain"], 0.0], [t1 * t2, t1 + t2, 1.0])
force = np.array(case["force"])
time = case["period"] * np.arange(len(force))
_, volts, _ = signal.lsim(system, force, time, interp=True)
json.dump({"volts": volts.tolist()}, sys.stdout)
