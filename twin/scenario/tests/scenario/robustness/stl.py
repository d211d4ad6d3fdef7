"""Robustness of claims by rtamt, a monitor of Signal Temporal Logic. Reads a list of claims with their samples from
standard input, and prints for each its robustness and those of the windows of one sample less and more.

Times are whole milliseconds, at each of which one of both signals is sampled at least; the other one is held.
"""

import json
import math
import sys

import rtamt

INFINITE = 1e300


def robustness(formula, traces):
    monitor = rtamt.StlDiscreteTimeSpecification()
    for name in [*traces, "robustness"]:
        monitor.declare_var(name, "float")
    monitor.spec = "robustness = " + formula
    monitor.parse()
    length = len(next(iter(traces.values())))
    return monitor.evaluate({"time": list(range(length)), **traces})[0][1]


def held(samples, length):
    values, last = dict(samples), None
    trace = []
    for at in range(length):
        last = values.get(at, last)
        trace.append(last)
    return trace


def margins(condition, samples, length):
    """The condition's own robustness at each time; none before its first sample."""

    def margin(value):
        if value is None:
            return None
        value = abs(value) if condition["absolute"] else value
        upper, lower = condition["max"], condition["min"]
        above = INFINITE if upper is None else upper - value
        below = INFINITE if lower is None else value - lower
        return min(above, below)

    return [margin(value) for value in held(samples, length)]


def truth(trace):
    return [INFINITE if margin >= 0 else -INFINITE for margin in trace]


def formula(kind, window, length):
    last = length - 1
    least, most = math.floor(window), math.ceil(window)
    return {
        "always": "always(p)",
        "eventually": "eventually(p)",
        "eventually within": f"eventually[0:{least}](p)",
        "until": "p until q",
        "settles": f"always[{most}:{last}](p)",
        "response": f"always[0:{last - most}](p -> eventually[0:{least}](q))",
        "precedence within": f"always[{most}:{last}](p -> once[0:{least}](q))",
        "precedence": "always(p -> once(q))",
    }[kind]


def of_claim(claim):
    kind, length, window = claim["kind"], claim["length"], claim["window"]
    p = margins(claim["p"], claim["samples"][0], length)
    q = margins(claim["q"], claim["samples"][1], length)
    if kind == "settles":
        final = claim["samples"][0][-1][1]
        p = [claim["within"] - abs(value - final) for value in held(claim["samples"][0], length)]
    start = next(at for at in range(length) if p[at] is not None and q[at] is not None)
    p, q = p[start:], q[start:]
    # A condition in another unit than that of the claim is true or false.
    if not claim["one_unit"]:
        if kind == "until":
            q = truth(q)
        else:
            p = truth(p)
    return [
        robustness(formula(kind, window + shift, len(p)), {"p": p, "q": q})
        for shift in (0, -1, 1)
    ]


print(json.dumps([of_claim(claim) for claim in json.load(sys.stdin)]))
