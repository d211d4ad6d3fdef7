"""Servos on a pendulum bench with hidden parameters, as logs with noise.

Reads {"trials", "seed"} from the standard input; writes a log of JSON for each trial into the
folder of the first argument, and prints the hidden parameters with the Cramér–Rao bounds of their
standard deviations.

The equations are those of the documentation of plants/servo, written again: a controller in counts
at 1 kHz, a winding without inductance, viscous and Coulomb friction, an arm that friction holds.
They are integrated by the rule of Runge and Kutta at 0.2 ms, and the instants at which the arm stops
are located within a step by its mean acceleration.
"""

import json
import pathlib
import sys

import numpy

PARAMETERS = {  # middle of the ranges
    "load.offset": 0.02,
    "motor.resistance": 2.8,
    "motor.torque_constant": 0.37,
    "motor.inertia": 1.7e-3,
    "friction.viscous": 8e-3,
    "friction.coulomb": 1.2e-2,
    "controller.duty_per_count": 4.4e-6,
    "controller.reading_delay": 6e-3,
}
MASS, LENGTH, VOLTAGE, GAIN = 0.49, 0.10, 7.4, 800.0
GRAVITY = 9.80665
COUNT = 2.0 * numpy.pi / 4096
NOISE = 2e-3
DIFFERENCE = 0.01
TICK, STEPS = 1e-3, 5
SECONDS, OFF = 2.0, 1.1


def goal(time):
    """Fast enough for a duty cycle of 1, and twice through the lowest position."""
    return 1.4 * numpy.sin(4.5 * time) + 0.3 * numpy.sin(13.0 * time)


def loop_times(random):
    """Times of a host whose loop takes 5.3 ms, with jitter."""
    times = numpy.cumsum(random.uniform(5.1e-3, 5.5e-3, 600))
    return numpy.concatenate([[0.0], times[times < SECONDS]]).round(9)


def simulate(p, times, goals, enabled):
    """Angles at the ticks, for an array of parameters (8, n): (ticks + 1, n)."""
    offset, resistance, constant, motor, viscous, coulomb, per_count = p[:7]
    inertia = motor + MASS * LENGTH**2
    weight = MASS * GRAVITY * LENGTH
    step = TICK / STEPS
    angle, rate = numpy.zeros(p.shape[1]), numpy.zeros(p.shape[1])
    past = [angle]
    command, on, taken = 0.0, True, 0
    for tick in range(round(SECONDS / TICK)):
        # A command acts from the first tick that is not before it.
        while taken < len(times) and times[taken] <= tick * TICK + 1e-12:
            command, on, taken = goals[taken], enabled[taken], taken + 1
        error = numpy.round(command / COUNT) - numpy.round(angle / COUNT)
        duty = numpy.clip(GAIN * per_count * error, -1.0, 1.0)

        def torque(q, w):
            driving = constant * (duty * VOLTAGE - constant * w) / resistance if on else 0.0
            return driving - viscous * w - weight * numpy.sin(q + offset)

        for _ in range(STEPS):
            held = (rate == 0.0) & (numpy.abs(torque(angle, rate)) <= coulomb)
            sign = numpy.where(rate != 0.0, numpy.sign(rate), numpy.sign(torque(angle, rate)))

            def slope(q, w):
                return (torque(q, w) - sign * coulomb) / inertia

            a1 = slope(angle, rate)
            w2 = rate + 0.5 * step * a1
            a2 = slope(angle + 0.5 * step * rate, w2)
            w3 = rate + 0.5 * step * a2
            a3 = slope(angle + 0.5 * step * w2, w3)
            w4 = rate + step * a3
            a4 = slope(angle + step * w3, w4)
            moved = angle + step / 6.0 * (rate + 2.0 * w2 + 2.0 * w3 + w4)
            faster = rate + step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
            # Where the rate changes its sign, the arm stops within the step; from there it is
            # held, or starts in the other direction.
            turns = (rate != 0.0) & (faster * rate < 0.0)
            part = numpy.where(turns, rate / numpy.where(turns, rate - faster, 1.0), 1.0) * step
            stopped = angle + 0.5 * part * rate
            left, pull = step - part, torque(stopped, 0.0 * rate)
            start = numpy.sign(pull) * numpy.maximum(numpy.abs(pull) - coulomb, 0.0) / inertia
            moved = numpy.where(turns, stopped + 0.5 * start * left**2, moved)
            faster = numpy.where(turns, start * left, faster)
            angle = numpy.where(held, angle, moved)
            rate = numpy.where(held, 0.0, faster)
        past.append(angle)
    return numpy.array(past)


def readings(p, times, goals, enabled):
    """Angles that are read at the times of the loop: (times, n)."""
    past = simulate(p, times, goals, enabled)
    at = numpy.clip(times[:, None] - p[7][None, :], 0.0, None) / TICK
    before = numpy.minimum(at.astype(int), len(past) - 2)
    share = at - before
    # A cubic through four ticks; at the ends, a line.
    columns = numpy.arange(p.shape[1])[None, :]
    inner = (before >= 1) & (before + 2 < len(past))
    y = [past[numpy.clip(before + k, 0, len(past) - 1), columns] for k in (-1, 0, 1, 2)]
    s = share
    cubic = (
        -s * (s - 1) * (s - 2) / 6 * y[0]
        + (s + 1) * (s - 1) * (s - 2) / 2 * y[1]
        - (s + 1) * s * (s - 2) / 2 * y[2]
        + (s + 1) * s * (s - 1) / 6 * y[3]
    )
    return numpy.where(inner, cubic, y[1] + s * (y[2] - y[1]))


def main():
    folder = pathlib.Path(sys.argv[1])
    request = json.load(sys.stdin)
    random = numpy.random.default_rng(request["seed"])
    count = request["trials"]
    middle = numpy.array(list(PARAMETERS.values()))[:, None]
    truths = middle * random.uniform(0.8, 1.25, (len(middle), count))
    times = loop_times(random)
    goals, enabled = goal(times), times < OFF
    # All parameters, then each of them a little greater and smaller.
    shifts = [numpy.zeros_like(truths)]
    for index in range(len(middle)):
        for sign in (1.0, -1.0):
            shifts.append(numpy.zeros_like(truths))
            shifts[-1][index] = sign * DIFFERENCE * truths[index]
    points = numpy.concatenate([truths + shift for shift in shifts], axis=1)
    exact = readings(points, times, goals, enabled)
    exact, *ends = numpy.split(exact, len(shifts), axis=1)
    noisy = exact + random.normal(0.0, NOISE, exact.shape)
    counted = numpy.round(noisy / COUNT) * COUNT

    # Quantisation of noise that is greater than a count adds the variance of an even distribution.
    deviation = numpy.hypot(NOISE, COUNT / numpy.sqrt(12.0))
    pairs = zip(ends[0::2], ends[1::2], truths)
    columns = [(high - low) / (2.0 * DIFFERENCE * truth) for high, low, truth in pairs]
    trials = []
    for trial in range(count):
        jacobian = numpy.stack([column[:, trial] for column in columns], axis=1) / deviation
        scale = numpy.linalg.norm(jacobian, axis=0)
        inverse = numpy.linalg.inv((jacobian / scale).T @ (jacobian / scale))
        bounds = numpy.sqrt(numpy.diag(inverse)) / scale
        trials.append({"truth": truths[:, trial].tolist(), "bound": bounds.tolist()})
        rows = zip(times, counted[:, trial], goals, enabled)
        entries = [
            {"t": t, "position": q, "goal": g, "enable": bool(on)} for t, q, g, on in rows
        ]
        text = json.dumps({"entries": entries})
        (folder / f"trial-{trial:03}.json").write_text(text)
    print(json.dumps({"parameters": PARAMETERS, "trials": trials}))


main()
