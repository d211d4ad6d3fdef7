#!/usr/bin/env python3
"""Butterworth filters, transitions of the charge amplifier and identifications by scipy.

Reads {"task": …, …} as JSON and prints the result of that task.
"""

import json
import sys

import numpy as np
import scipy.integrate
import scipy.linalg
import scipy.optimize
import scipy.signal
import scipy.stats


def butterworth(task):
    sos = scipy.signal.butter(task["order"], task["cutoff_hz"], fs=task["rate_hz"], output="sos")
    samples = np.array(task["samples"])
    settled, _ = scipy.signal.sosfilt(sos, samples, zi=scipy.signal.sosfilt_zi(sos) * samples[0])
    b, a = scipy.signal.butter(task["order"], task["cutoff_hz"], fs=task["rate_hz"])
    # The phase of the sections: the polynomial of order 8 has lost its digits at 0 Hz.
    step = 1e-4 * task["cutoff_hz"]
    _, response = scipy.signal.freqz_sos(sos, worN=[step], fs=task["rate_hz"])
    return {
        "sos": sos.tolist(),
        "causal": scipy.signal.sosfilt(sos, samples).tolist(),
        "settled": settled.tolist(),
        "zero_phase": scipy.signal.sosfiltfilt(sos, samples).tolist(),
        "delay_s": float(-np.angle(response[0]) / (2 * np.pi * step)),
    }


def generator(k, t1, t2):
    m = np.zeros((5, 5))
    m[0, 1] = m[1, 2] = 1.0
    m[3, 1], m[3, 3] = 1 / t2, -1 / t2
    m[4, 3], m[4, 4] = -k / t1, -1 / t1
    return m


def white_noise(m, k, dt, shortest):
    """Covariance of white noise of unit density on the third state over dt."""
    # Scaled so that all parts have the same order of magnitude.
    scale = np.array([dt**2, dt, 1.0, dt, k * dt])
    scaled = m * scale / scale[:, None]
    if dt < 10 * shortest:
        noise = np.zeros((5, 5))
        noise[2, 2] = 1.0
        exponential = scipy.linalg.expm(np.block([[-scaled, noise], [np.zeros((5, 5)), scaled.T]]) * dt)
        q = exponential[5:, 5:].T @ exponential[:5, 5:]
    else:
        # Van Loan's exponential overflows where a step is long against a time constant.

        def column(s):
            c = scipy.linalg.expm(scaled * s)[:, 2]
            return np.outer(c, c).ravel()

        q = scipy.integrate.quad_vec(column, 0, dt, epsabs=0, epsrel=1e-12, norm="max", limit=2000)[0].reshape(5, 5)
    return q * np.outer(scale, scale)


def transitions(task):
    """Transitions with their noise."""
    results = []
    for k, t1, t2, dt in task["cases"]:
        m = generator(k, t1, t2)
        noise = white_noise(m, k, dt, min(t1, t2))
        results.append({"transition": scipy.linalg.expm(m * dt).ravel().tolist(), "noise": noise.ravel().tolist()})
    return results


def voltages(task):
    """Response of the transfer function to forces that are straight lines between samples."""
    k, t1, t2 = task["amplifier"]
    system = scipy.signal.TransferFunction([-k, 0], np.polymul([t1, 1], [t2, 1]))
    _, voltage, _ = scipy.signal.lsim(system, np.array(task["forces"]), np.array(task["times"]), interp=True)
    return voltage.tolist()


def sigmoid(x, a, b, c, d):
    return a / (1 + np.exp(b * (x + c))) + d


def hysteresis(task):
    force, rate, voltage = (np.array(task[name]) for name in ("forces", "rates", "voltages"))

    def model(_, a1, b1, c1, d1, a2, b2, c2, d2, switch):
        weight = 1 / (1 + np.exp(-switch * rate))
        return weight * sigmoid(force, a1, b1, c1, d1) + (1 - weight) * sigmoid(force, a2, b2, c2, d2)

    found, _ = scipy.optimize.curve_fit(model, force, voltage, p0=task["start"], ftol=1e-15, xtol=1e-15, gtol=1e-15, maxfev=100000)
    residual = voltage - model(None, *found)
    return {"parameters": found.tolist(), "r_squared": 1 - residual.var() / voltage.var()}


def coefficients(task):
    planes = []
    for run in task["runs"]:
        matrix = np.column_stack([run["rates"], run["accelerations"], np.ones(len(run["rates"]))])
        planes.append(np.linalg.lstsq(matrix, np.array(run["voltages"]), rcond=None)[0])
    planes = np.array(planes)
    hz = np.array([run["hz"] for run in task["runs"]])
    decays = []
    for column in range(2):
        found, _ = scipy.optimize.curve_fit(
            lambda f, value, scale: value * np.exp(-f / scale), hz, planes[:, column], p0=[planes[0, column], 2.0], ftol=1e-15, xtol=1e-15
        )
        decays.append(found.tolist())
    return {"planes": planes.tolist(), "decays": decays}


def amplifier(task):
    """The parameters of lsim's response, an offset and a free motion, that fit voltages."""
    times, forces = np.array(task["times"]), np.array(task["forces"])

    def model(_, k, log_t1, log_t2, bias, slow, fast):
        t1, t2 = np.exp([log_t1, log_t2])
        system = scipy.signal.TransferFunction([-k, 0], np.polymul([t1, 1], [t2, 1]))
        forced = scipy.signal.lsim(system, forces - forces[0], times, interp=True)[1]
        return forced + bias + slow * np.exp(-times / t1) + fast * np.exp(-times / t2)

    # By logarithms: steps to time constants below zero end in other minima on some machines.
    k, t1, t2, bias = task["start"]
    start = [k, np.log(t1), np.log(t2), bias, 0.0, 0.0]
    found, _ = scipy.optimize.curve_fit(model, times, np.array(task["voltages"]), p0=start, ftol=1e-15, xtol=1e-15, gtol=1e-15, maxfev=10000)
    return [found[0], *np.exp(found[1:3]).tolist(), found[3]]


def quantiles(task):
    """Two-sided 95 % intervals of chi-squared."""
    return [scipy.stats.chi2.ppf([0.025, 0.975], count).tolist() for count in task["degrees"]]


TASKS = {task.__name__: task for task in (quantiles, butterworth, transitions, voltages, hysteresis, coefficients, amplifier)}

TASK = json.load(sys.stdin)
json.dump(TASKS[TASK["task"]](TASK), sys.stdout)
