"""Smooth motion between events, events where they happen, impulses at them.

A phase has a set of constraints that hold; they are kept on the level of accelerations, with their multipliers, and nothing
is projected: how far a gap drifts while it should be closed is a measure of the error. A phase ends where another gap
closes, where a multiplier of a stop or the ground vanishes, where friction is used up, or where a slide stops. Each event is
found by Newton's method on its time, every iterate integrated anew from the last output: no dense output enters.
"""

import itertools

import numpy as np
from scipy.integrate import solve_ivp

# A gap [m, rad] and a rate [m/s, rad/s] below which a gap counts as closed and as standing still. What opens at such a rate
# and is pushed back would be shut again within some 1e-8 s, having opened by 1e-14: that is not resolved.
CLOSED = 1e-10
STILL = 1e-6


class Hybrid:
    """`atol`: of places and angles [m, rad], of their rates [m/s, rad/s]; the latter feel the rounding of great forces."""

    def __init__(self, system, friction=0.0, method="DOP853", rtol=1e-13, atol=(1e-15, 1e-13), max_step=5e-4):
        self.system, self.mu = system, friction
        self.settings = {"method": method, "rtol": rtol, "max_step": max_step}
        self.atol = atol
        self.names = list(system.stop_names) + (["ground"] if system.ground is not None else [])
        self.ground = len(self.names) - 1 if system.ground is not None else None
        self.events, self.lost, self.drift, self.evaluations = [], 0.0, 0.0, 0

    # What holds: a stop's index maps to "on"; the ground's to "stick" or to +1, -1, the direction of its slide.

    def rows(self, held, rows):
        """Directions that are kept still, and directions of the forces that do so."""
        still, pulls = [], []
        for index, how in held.items():
            if how == "on":
                still.append(rows[index])
                pulls.append(rows[index])
            elif how == "stick":
                still.extend([rows[index], rows[index + 1]])
                pulls.extend([rows[index], rows[index + 1]])
            else:
                still.append(rows[index])
                pulls.append(rows[index] - self.mu * how * rows[index + 1])
        size = self.system_size
        return np.array(still).reshape(-1, size), np.array(pulls).reshape(-1, size)

    def places(self, held, values):
        """`values` laid out as `rows` gives its rows."""
        found = []
        for index, how in held.items():
            found.extend([values[index], values[index + 1]] if how == "stick" else [values[index]])
        return np.array(found)

    @property
    def system_size(self):
        return self.system.size

    def motion(self, q, u, held):
        """Accelerations and multipliers."""
        self.evaluations += 1
        inertia, force = self.system.dynamics(q, u)
        if not held:
            return np.linalg.solve(inertia, force), np.zeros(0)
        rows, drifts = self.system.constraints(q, u)
        still, pulls = self.rows(held, rows)
        free = np.linalg.solve(inertia, np.column_stack([force, pulls.T]))
        forces = np.linalg.solve(still @ free[:, 1:], -self.places(held, drifts) - still @ free[:, 0])
        return free[:, 0] + free[:, 1:] @ forces, forces

    def split(self, y):
        size = self.system_size
        return y[: len(y) - size - 1], y[len(y) - size - 1 : -1]

    def derivative(self, held):
        def of(_, y):
            q, u = self.split(y)
            acceleration, _ = self.motion(q, u, held)
            return np.concatenate([self.system.rates(q, u), acceleration, [self.system.friction_power(u)]])

        return of

    # Events of a phase: functions that are positive inside of it.

    def watched(self, held):
        def gap(index):
            return lambda _, y: self.system.gaps(self.split(y)[0])[index]

        def multiplier(place):
            return lambda _, y: self.motion(*self.split(y), held)[1][place]

        def reserve(place, sign):
            def of(_, y):
                forces = self.motion(*self.split(y), held)[1]
                return self.mu * forces[place] + sign * forces[place + 1]

            return of

        def slide(direction):
            def of(_, y):
                q, u = self.split(y)
                return direction * (self.system.constraints(q, u)[0][-1] @ u)

            return of

        found = [(("reached", index), gap(index)) for index in range(len(self.names)) if index not in held]
        place = 0
        for index, how in held.items():
            found.append((("released", index), multiplier(place)))
            if how == "stick":
                found += [(("slips", sign), reserve(place, sign)) for sign in (1, -1)]
                place += 1
            elif how != "on":
                found.append((("stops", index), slide(how)))
            place += 1
        return found

    # Impulses, and what holds afterwards.

    def choices(self, candidates, speed=0.0):
        """Every way in which the candidates can hold or not."""
        ways = []
        for index in candidates:
            if index != self.ground:
                ways.append([None, "on"])
            elif speed > STILL:
                ways.append([None, 1])
            elif speed < -STILL:
                ways.append([None, -1])
            else:
                ways.append([None, "stick", 1, -1])
        for way in itertools.product(*ways):
            yield {index: how for index, how in zip(candidates, way) if how is not None}

    def violation(self, held, forces, values, candidates, scale):
        """How far signs of forces, of what the gaps do where nothing holds them, and of slides are missed; none if by too
        much for rounding."""
        slack, place, worst = scale * 1e-11, 0, 0.0
        for index, how in held.items():
            if forces[place] < 0.0:
                return None
            if how == "stick":
                if abs(forces[place + 1]) > self.mu * forces[place]:
                    return None
                place += 1
            elif how != "on":
                worst = max(worst, -how * values[index + 1])
            place += 1
        worst = max([worst, *(-values[index] for index in candidates if index not in held)])
        return worst if worst <= slack else None

    @staticmethod
    def best(answers, different):
        """The answer that misses least; they must all be the same but for rounding."""
        assert answers, "nothing fits"
        answers = sorted(answers, key=lambda answer: answer[0])
        assert max(np.abs(answer[1] - answers[0][1]).max() for answer in answers) < different, "more than one way fits"
        return answers[0][1:]

    def impact(self, q, u, candidates):
        """Velocities after the impulses of all gaps that are closed: 0 ≤ P ⊥ J u⁺ ≥ 0, Coulomb's cone on the ground's."""
        inertia = self.system.inertia(q)
        rows, _ = self.system.constraints(q, u)
        answers = []
        for held in self.choices(candidates):
            still, pulls = self.rows(held, rows)
            moved = np.linalg.solve(inertia, pulls.T)
            try:
                impulses = np.linalg.solve(still @ moved, -still @ u)
            except np.linalg.LinAlgError:
                continue
            after = u + moved @ impulses
            missed = self.violation(held, impulses, rows @ after, candidates, 1.0 + np.abs(rows @ u).max())
            if missed is not None:
                answers.append((missed, after))
        (after,) = self.best(answers, 1e-6)
        lost = 0.5 * u @ inertia @ u - 0.5 * after @ inertia @ after
        assert lost > -1e-15, "an impact gains energy"
        self.lost += lost
        return after

    def holding(self, q, u):
        """Which of the closed gaps that do not move stay closed: 0 ≤ λ ⊥ acceleration ≥ 0."""
        rows, drifts = self.system.constraints(q, u)
        gaps = self.system.gaps(q)
        candidates = [i for i in range(len(gaps)) if abs(gaps[i]) < CLOSED and abs(rows[i] @ u) < STILL]
        speed = rows[-1] @ u if self.ground in candidates else 0.0
        inertia, force = self.system.dynamics(q, u)
        scale = np.abs(rows @ np.linalg.solve(inertia, force)).max() if candidates else 1.0
        answers = []
        for held in self.choices(candidates, speed):
            try:
                acceleration, forces = self.motion(q, u, held)
            except np.linalg.LinAlgError:
                continue
            values = rows @ acceleration + drifts
            if abs(speed) > STILL and self.ground in held:
                values[self.ground + 1] = held[self.ground]
            missed = self.violation(held, forces, values, candidates, scale)
            if missed is not None:
                answers.append((missed, acceleration, held))
        return self.best(answers, 1e-6 * scale)[1]

    def stopped(self, q, u, held):
        """Velocities without what the held gaps still have."""
        inertia = self.system.inertia(q)
        still, pulls = self.rows(held, self.system.constraints(q, u)[0])
        moved = np.linalg.solve(inertia, pulls.T)
        after = u - moved @ np.linalg.solve(still @ moved, still @ u)
        self.lost += 0.5 * u @ inertia @ u - 0.5 * after @ inertia @ after
        return after

    def note(self, time, index, what):
        self.events.append({"time": time, "what": index if isinstance(index, str) else self.names[index], "event": what})

    def settle(self, time, q, u, before):
        """Impulses where gaps close, then what holds; notes what has changed."""
        rows, _ = self.system.constraints(q, u)
        gaps = self.system.gaps(q)
        closed = [index for index in range(len(gaps)) if abs(gaps[index]) < CLOSED]
        assert all(index in closed for index in before), "a gap that was held has drifted"
        if any(rows[index] @ u < -STILL for index in closed):
            u = self.impact(q, u, closed)
        held = self.holding(q, u) if closed else {}
        if held:
            u = self.stopped(q, u, held)
        for index in before.keys() - held.keys():
            self.note(time, index, "released")
        for index in closed:
            if index in held and index not in before:
                self.note(time, index, "reached, holds")
            elif index not in held and index not in before and time > 0.0 and rows[index] @ u >= -STILL:
                self.note(time, index, "reached, leaves")
        if self.ground in held:
            self.note(time, index=self.ground, what=slide_name(held[self.ground]))
        return u, held

    # A run.

    def run(self, q, u, times):
        """States at `times`, the first of which is the start."""
        u, held = self.settle(times[0], q, u, {})
        y = np.concatenate([q, u, [0.0]])
        found, kept = [y], [dict(held)]
        losses = [self.lost]
        for start, end in zip(times[:-1], times[1:]):
            y, held = self.segment(start, end, y, held)
            gaps = self.system.gaps(self.split(y)[0])
            assert len(gaps) == 0 or gaps.min() > -1e-9, f"a gap is {gaps.min()} at {end}"
            self.drift = max([self.drift, *(abs(gaps[index]) for index in held)])
            found.append(y)
            kept.append(dict(held))
            losses.append(self.lost)
        return np.array(found), kept, np.array(losses)

    def solve(self, start, end, y, held, events=()):
        size = self.system_size
        atol = np.array([self.atol[0]] * (len(y) - size - 1) + [self.atol[1]] * size + [1e-16])
        of = self.derivative(held)
        solution = solve_ivp(of, (start, end), y, events=events, dense_output=bool(events), atol=atol, **self.settings)
        assert solution.success, solution.message
        return solution

    def segment(self, start, end, y, held):
        left = {}
        while start < end:
            # A gap that has just been left begins at zero: no sign change tells when it closes again. So it is let go
            # unwatched for a while that is too short for it to come back.
            until = min([end, *(start + moment for moment in left.values())])
            watched = [entry for entry in self.watched(held) if entry[0] not in left]
            events = [ending(function) for _, function in watched]
            solution = self.solve(start, until, y, held, events)
            dip = self.dip(solution, [index for (kind, index), _ in watched if kind == "reached"])
            if dip is not None:
                # To where it is closed; there the signs tell.
                solution = self.solve(start, dip, y, held, events)
                assert solution.status == 1, "a gap that closes and opens again is lost"
            if solution.status == 0:
                start, y, left = until, solution.y[:, -1], {}
                continue
            which = next(i for i, times in enumerate(solution.t_events) if len(times))
            (kind, index), function = watched[which]
            time, at = self.locate(start, until, y, held, function, solution)
            q, u = self.split(at)
            if kind == "released":
                held = {i: how for i, how in held.items() if i != index}
                self.note(time, index, "released")
            elif kind == "slips":
                held = {**held, self.ground: int(index)}
                self.note(time, self.ground, slide_name(int(index)))
            else:
                u, held = self.settle(time, q, u, held)
            start, y = time, np.concatenate([q, u, at[-1:]])
            left = self.just_left(q, u, held)
        return y, held

    def dip(self, solution, indices):
        """The first of some instants within the steps at which a gap is closed that is open at their ends; if there is one."""
        if not indices:
            return None
        ends = solution.t
        for start, end in zip(ends[:-1], ends[1:]):
            for part in (0.2, 0.4, 0.6, 0.8):
                time = start + part * (end - start)
                if self.system.gaps(self.split(solution.sol(time))[0])[indices].min() < -1e-13:
                    return time
        return None

    def just_left(self, q, u, held):
        """What begins at zero and opens, with a time in which it does not come back [s]."""
        rows, drifts = self.system.constraints(q, u)
        changes = rows @ self.motion(q, u, held)[0] + drifts
        found, gaps = {}, self.system.gaps(q)
        for index, gap in enumerate(gaps):
            if abs(gap) < CLOSED and index not in held:
                found["reached", index] = moment(rows[index] @ u, changes[index])
        if held.get(self.ground) in (1, -1) and abs(rows[-1] @ u) < STILL:
            found["stops", self.ground] = moment(0.0, abs(changes[-1]))
        return found

    def locate(self, start, end, y, held, function, solution):
        """Time of the event and state there."""
        time = solution.t[-1]
        reach = 1e-7
        back, ahead = max(start, time - reach), min(end, time + reach)
        slope = (function(ahead, solution.sol(ahead)) - function(back, solution.sol(back))) / (ahead - back)
        at = y
        for _ in range(12):
            at = self.solve(start, time, y, held).y[:, -1] if time > start else y
            change = function(time, at) / slope
            if abs(change) < 1e-16 + 1e-16 * abs(time):
                break
            time = max(start, time - change)
        return time, at


def moment(rate, change):
    """Half of the time in which something that opens at `rate` is stopped by `change`, and not long at all."""
    return 1e-5 if change >= 0.0 or rate < STILL else min(1e-5, 0.5 * rate / -change)


def ending(function):
    """An event of `solve_ivp` that ends a phase where `function` falls through zero."""

    def of(t, y):
        return function(t, y)

    of.terminal, of.direction = True, -1
    return of


def slide_name(how):
    return "sticks" if how == "stick" else ("slides forward" if how > 0 else "slides backward")
