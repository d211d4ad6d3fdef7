#!/usr/bin/env python3
"""The filters F1, F2 and F3 by filterpy, with gradients by complex steps and transitions by scipy.

Reads a list of {"filter": "linear" | "extended", "settings": …, "times": […], "channels": [[…], …]} as JSON: times [ns] and the
values of every channel at each. Prints the states and covariances after each time of each.

"linear": filterpy's KalmanFilter with both cells in one update. "extended": its ExtendedKalmanFilter, one channel after the other.
"""

import json
import sys

import numpy as np
import scipy.linalg
from filterpy.kalman import ExtendedKalmanFilter, KalmanFilter

STEP = 1e-30


class Setup:
    def __init__(self, settings):
        self.settings = settings
        (self.kind, self.model), = settings["model"].items()
        states = self.model["states"]
        self.size = len(states)
        self.x = np.array([state["initial"] for state in states])
        self.p = np.diag([state["variance"] for state in states])
        self.noise = np.array([state["noise"] for state in states]) / settings["period_s"]

    def generator(self):
        """The continuous model x' = M x, and the row of its white noise."""
        m = np.zeros((self.size, self.size))
        m[0, 1] = 1.0
        if self.kind == "F1":
            return m, 1
        m[1, 2] = 1.0
        if self.kind == "F3":
            amplifier = self.model["amplifier"]
            k, t1, t2 = (amplifier[name] for name in ("sensitivity", "feedback_s", "lag_s"))
            m[3, 1], m[3, 3] = 1 / t2, -1 / t2
            m[4, 3], m[4, 4] = -k / t1, -1 / t1
        return m, 2

    def transition(self, dt):
        """Van Loan's exponential."""
        m, row = self.generator()
        n = self.size
        noise = np.zeros((n, n))
        noise[row, row] = self.settings["white"]
        block = np.block([[-m, noise], [np.zeros((n, n)), m.T]]) * dt
        exponential = scipy.linalg.expm(block)
        a = exponential[n:, n:].T
        return a, a @ exponential[:n, n:] + np.diag(self.noise) * dt

    def piezoresistive(self, x):
        response = self.settings["piezoresistive"]["response"]
        if "Linear" in response:
            return response["Linear"]["gain"] * x[0] + response["Linear"]["offset"]
        cell = response["Hysteresis"]

        def sigmoid(c, force):
            return c["a"] / (1 + np.exp(c["b"] * (force + c["c"]))) + c["d"]

        weight = 1 / (1 + np.exp(-cell["switch"] * x[1]))
        return weight * sigmoid(cell["loading"], x[0]) + (1 - weight) * sigmoid(cell["unloading"], x[0])

    def piezoelectric(self, x):
        if self.kind == "F1":
            return self.model["gain"] * x[1] + x[2]
        if self.kind == "F3":
            return x[4] + x[5]
        hz = x[3] / (2 * np.pi)
        a, b = (self.model[name]["value"] * np.exp(-hz / self.model[name]["scale_hz"]) for name in ("rate", "acceleration"))
        return a * x[1] + b * x[2] + x[4]

    def channels(self):
        """Measurement functions with their noise."""
        settings = self.settings
        functions = [(self.piezoresistive, settings["piezoresistive"]["variance"]), (self.piezoelectric, settings["piezoelectric"])]
        if self.kind == "F2":
            functions.append((lambda x: x[3], settings["frequency"]))
        return functions

    def gradient(self, function, x):
        rows = []
        for i in range(self.size):
            shifted = x.astype(complex)
            shifted[i] += 1j * STEP
            rows.append(function(shifted).imag / STEP)
        return np.array([rows])


def linear(setup, times, channels):
    kalman = KalmanFilter(dim_x=setup.size, dim_z=2)
    kalman.x, kalman.P = setup.x.reshape(-1, 1), setup.p
    functions = setup.channels()
    kalman.H = np.vstack([setup.gradient(function, setup.x) for function, _ in functions])
    kalman.R = np.diag([variance for _, variance in functions])
    offsets = np.array([function(np.zeros(setup.size)) for function, _ in functions])
    last = times[0]
    for at, values in zip(times, channels):
        if at != last:
            kalman.F, kalman.Q = setup.transition((at - last) * 1e-9)
            kalman.predict()
        last = at
        kalman.update((np.array(values) - offsets).reshape(-1, 1))
        yield kalman.x.ravel(), kalman.P


def extended(setup, times, channels):
    kalman = ExtendedKalmanFilter(dim_x=setup.size, dim_z=1)
    kalman.x, kalman.P = setup.x, setup.p
    last = times[0]
    for at, values in zip(times, channels):
        if at != last:
            kalman.F, kalman.Q = setup.transition((at - last) * 1e-9)
            kalman.predict()
        last = at
        for (function, variance), value in zip(setup.channels(), values):
            kalman.update(np.array([value]), lambda x: setup.gradient(function, x), lambda x: np.array([function(x)]), R=variance)
        yield kalman.x, kalman.P


def main():
    json.dump([run(task) for task in json.load(sys.stdin)], sys.stdout)


def run(task):
    steps = {"linear": linear, "extended": extended}[task["filter"]]
    results = [(x.tolist(), p.ravel().tolist()) for x, p in steps(Setup(task["settings"]), task["times"], task["channels"])]
    return {"states": [x for x, _ in results], "covariances": [p for _, p in results]}


main()
