"""Fits of the linear characteristic with saturation by scipy.optimize.

Reads a list of {"loads", "conductances", "start"} from standard input, in units in which all
numbers are of order 1. Prints parameters and sum of squares of each fit.
"""

import json
import sys

import numpy as np
from scipy import optimize

fits = []
for case in json.load(sys.stdin):
    loads, conductances = np.array(case["loads"]), np.array(case["conductances"])

    def residuals(p):
        return np.clip(p[0] * loads + p[1], 0.0, p[2]) - conductances

    fit = optimize.least_squares(residuals, case["start"], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    fits.append({"parameters": fit.x.tolist(), "residual": 2.0 * fit.cost})
json.dump(fits, sys.stdout)
