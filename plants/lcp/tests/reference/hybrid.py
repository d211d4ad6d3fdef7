"""Event-driven integration: smooth motion between events, exact event location, impulses at events.

A phase has a set of active constraints, enforced at the acceleration level with multipliers and
without projection: the drift of a closed gap measures the error. A phase ends where another gap
closes, where the multiplier of a stop or of the ground vanishes, where the friction limit is
reached, or where a slide stops. Each event is located by Newton's method on its time, with every
iterate integrated anew from the last output, without dense output.
"""

import itertools

import numpy as np
from scipy.integrate import solve_ivp

# Gap [m, rad] and rate [m/s, rad/s] below which a gap counts as closed and at rest. A gap that opens
# at such a rate against a closing force would close again within some 1e-8 s, after opening by
# 1e-14: this is not resolved.
CLOSED = 1e-10
STILL = 1e-6


class Hybrid:
    """`atol`: tolerances of positions and angles [m, rad], and of their rates [m/s, rad/s]; the
    latter contain rounding errors of large forces."""

    def __init__(self, system, friction=0.0, method="DOP853", rtol=1e-13, atol=(1e-15, 1e-13), max_step=5e-4):
        self.system, self.mu = system, friction
        self.settings = {"method": method, "rtol": rtol, "max_step": max_step}
        self.atol = atol
        self.names = list(system.stop_names) + (["ground"] if system.ground is not None else [])
        self.ground = len(self.names) - 1 if system.ground is not None else None
        self.events, self.impact_losses, self.max_violation, self.evaluations = [], 0.0, 0.0, 0

    # Active constraints: the index of a stop maps to "on"; that of the ground to "stick" or to the
    # direction of sliding, +1 or -1.

    def rows(self, active, rows):
        """Returns the constrained directions, and the directions of the constraint forces."""
        constrained, force_directions = [], []
        for index, mode in active.items():
            if mode == "on":
                constrained.append(rows[index])
                force_directions.append(rows[index])
            elif mode == "stick":
                constrained.extend([rows[index], rows[index + 1]])
                force_directions.extend([rows[index], rows[index + 1]])
            else:
                constrained.append(rows[index])
                force_directions.append(rows[index] - self.mu * mode * rows[index + 1])
        size = self.system_size
        return np.array(constrained).reshape(-1, size), np.array(force_directions).reshape(-1, size)

    def layout(self, active, values):
        """Returns `values` in the layout of the result of `rows`."""
        found = []
        for index, mode in active.items():
            found.extend([values[index], values[index + 1]] if mode == "stick" else [values[index]])
        return np.array(found)

    @property
    def system_size(self):
        return self.system.size

    def motion(self, q, u, active):
        """Returns accelerations and multipliers."""
        self.evaluations += 1
        inertia, force = self.system.dynamics(q, u)
        if not active:
            return np.linalg.solve(inertia, force), np.zeros(0)
        rows, drifts = self.system.constraints(q, u)
        constrained, force_directions = self.rows(active, rows)
        free = np.linalg.solve(inertia, np.column_stack([force, force_directions.T]))
        forces = np.linalg.solve(constrained @ free[:, 1:], -self.layout(active, drifts) - constrained @ free[:, 0])
        return free[:, 0] + free[:, 1:] @ forces, forces

    def split(self, y):
        size = self.system_size
        return y[: len(y) - size - 1], y[len(y) - size - 1 : -1]

    def derivative(self, active):
        def function_of_state(_, y):
            q, u = self.split(y)
            acceleration, _ = self.motion(q, u, active)
            return np.concatenate([self.system.rates(q, u), acceleration, [self.system.friction_power(u)]])

        return function_of_state

    # Events of a phase: functions that are positive within it.

    def event_functions(self, active):
        def gap(index):
            return lambda _, y: self.system.gaps(self.split(y)[0])[index]

        def multiplier(row):
            return lambda _, y: self.motion(*self.split(y), active)[1][row]

        def friction_margin(row, sign):
            def function_of_state(_, y):
                forces = self.motion(*self.split(y), active)[1]
                return self.mu * forces[row] + sign * forces[row + 1]

            return function_of_state

        def slide(direction):
            def function_of_state(_, y):
                q, u = self.split(y)
                return direction * (self.system.constraints(q, u)[0][-1] @ u)

            return function_of_state

        found = [(("reached", index), gap(index)) for index in range(len(self.names)) if index not in active]
        row = 0
        for index, mode in active.items():
            found.append((("released", index), multiplier(row)))
            if mode == "stick":
                found += [(("slips", sign), friction_margin(row, sign)) for sign in (1, -1)]
                row += 1
            elif mode != "on":
                found.append((("stops", index), slide(mode)))
            row += 1
        return found

    # Impulses, and active constraints afterwards.

    def active_sets(self, candidates, speed=0.0):
        """Generates all combinations of active constraints of the candidates."""
        modes = []
        for index in candidates:
            if index != self.ground:
                modes.append([None, "on"])
            elif speed > STILL:
                modes.append([None, 1])
            elif speed < -STILL:
                modes.append([None, -1])
            else:
                modes.append([None, "stick", 1, -1])
        for combination in itertools.product(*modes):
            yield {index: mode for index, mode in zip(candidates, combination) if mode is not None}

    def violation(self, active, forces, values, candidates, scale):
        """Returns the violation of the sign conditions of forces, free gaps and slides; `None` beyond
        rounding errors."""
        slack, row, worst = scale * 1e-11, 0, 0.0
        for index, mode in active.items():
            if forces[row] < 0.0:
                return None
            if mode == "stick":
                if abs(forces[row + 1]) > self.mu * forces[row]:
                    return None
                row += 1
            elif mode != "on":
                worst = max(worst, -mode * values[index + 1])
            row += 1
        worst = max([worst, *(-values[index] for index in candidates if index not in active)])
        return worst if worst <= slack else None

    @staticmethod
    def best(solutions, tolerance):
        """Returns the solution of least violation; all must agree up to rounding errors."""
        assert solutions, "no consistent active set"
        solutions = sorted(solutions, key=lambda solution: solution[0])
        assert max(np.abs(solution[1] - solutions[0][1]).max() for solution in solutions) < tolerance, "the active set is not unique"
        return solutions[0][1:]

    def impact(self, q, u, candidates):
        """Returns velocities after the impulses of all closed gaps: 0 ≤ P ⊥ J u⁺ ≥ 0, with Coulomb's
        cone at the ground."""
        inertia = self.system.inertia(q)
        rows, _ = self.system.constraints(q, u)
        solutions = []
        for active in self.active_sets(candidates):
            constrained, force_directions = self.rows(active, rows)
            response = np.linalg.solve(inertia, force_directions.T)
            try:
                impulses = np.linalg.solve(constrained @ response, -constrained @ u)
            except np.linalg.LinAlgError:
                continue
            after = u + response @ impulses
            residual = self.violation(active, impulses, rows @ after, candidates, 1.0 + np.abs(rows @ u).max())
            if residual is not None:
                solutions.append((residual, after))
        (after,) = self.best(solutions, 1e-6)
        impact_losses = 0.5 * u @ inertia @ u - 0.5 * after @ inertia @ after
        assert impact_losses > -1e-15, "an impact gains energy"
        self.impact_losses += impact_losses
        return after

    def active_set(self, q, u):
        """Returns the closed gaps at rest that remain closed: 0 ≤ λ ⊥ acceleration ≥ 0."""
        rows, drifts = self.system.constraints(q, u)
        gaps = self.system.gaps(q)
        candidates = [i for i in range(len(gaps)) if abs(gaps[i]) < CLOSED and abs(rows[i] @ u) < STILL]
        speed = rows[-1] @ u if self.ground in candidates else 0.0
        inertia, force = self.system.dynamics(q, u)
        scale = np.abs(rows @ np.linalg.solve(inertia, force)).max() if candidates else 1.0
        solutions = []
        for active in self.active_sets(candidates, speed):
            try:
                acceleration, forces = self.motion(q, u, active)
            except np.linalg.LinAlgError:
                continue
            values = rows @ acceleration + drifts
            if abs(speed) > STILL and self.ground in active:
                values[self.ground + 1] = active[self.ground]
            residual = self.violation(active, forces, values, candidates, scale)
            if residual is not None:
                solutions.append((residual, acceleration, active))
        return self.best(solutions, 1e-6 * scale)[1]

    def project_velocity(self, q, u, active):
        """Returns velocities without the remaining rates of the active constraints."""
        inertia = self.system.inertia(q)
        constrained, force_directions = self.rows(active, self.system.constraints(q, u)[0])
        response = np.linalg.solve(inertia, force_directions.T)
        after = u - response @ np.linalg.solve(constrained @ response, constrained @ u)
        self.impact_losses += 0.5 * u @ inertia @ u - 0.5 * after @ inertia @ after
        return after

    def record_event(self, time, index, what):
        self.events.append({"time": time, "what": index if isinstance(index, str) else self.names[index], "event": what})

    def resolve_contacts(self, time, q, u, previous):
        """Applies impulses at closing gaps, determines the active constraints, and records changes."""
        rows, _ = self.system.constraints(q, u)
        gaps = self.system.gaps(q)
        closed = [index for index in range(len(gaps)) if abs(gaps[index]) < CLOSED]
        assert all(index in closed for index in previous), "a closed gap has drifted"
        if any(rows[index] @ u < -STILL for index in closed):
            u = self.impact(q, u, closed)
        active = self.active_set(q, u) if closed else {}
        if active:
            u = self.project_velocity(q, u, active)
        for index in previous.keys() - active.keys():
            self.record_event(time, index, "released")
        for index in closed:
            if index in active and index not in previous:
                self.record_event(time, index, "reached, holds")
            elif index not in active and index not in previous and time > 0.0 and rows[index] @ u >= -STILL:
                self.record_event(time, index, "reached, leaves")
        if self.ground in active:
            self.record_event(time, index=self.ground, what=slide_name(active[self.ground]))
        return u, active

    # A run.

    def run(self, q, u, times):
        """Returns states at `times`, the first of which is the start."""
        u, active = self.resolve_contacts(times[0], q, u, {})
        y = np.concatenate([q, u, [0.0]])
        found, active_at_times = [y], [dict(active)]
        losses = [self.impact_losses]
        for start, end in zip(times[:-1], times[1:]):
            y, active = self.segment(start, end, y, active)
            gaps = self.system.gaps(self.split(y)[0])
            assert len(gaps) == 0 or gaps.min() > -1e-9, f"a gap is {gaps.min()} at {end}"
            self.max_violation = max([self.max_violation, *(abs(gaps[index]) for index in active)])
            found.append(y)
            active_at_times.append(dict(active))
            losses.append(self.impact_losses)
        return np.array(found), active_at_times, np.array(losses)

    def solve(self, start, end, y, active, events=()):
        size = self.system_size
        atol = np.array([self.atol[0]] * (len(y) - size - 1) + [self.atol[1]] * size + [1e-16])
        function_of_state = self.derivative(active)
        solution = solve_ivp(function_of_state, (start, end), y, events=events, dense_output=bool(events), atol=atol, **self.settings)
        assert solution.success, solution.message
        return solution

    def segment(self, start, end, y, active):
        unmonitored = {}
        while start < end:
            # A gap that has just opened starts at zero, so that no sign change indicates its closing.
            # It is not monitored during an interval that is too short for it to close again.
            until = min([end, *(start + unmonitored_time for unmonitored_time in unmonitored.values())])
            event_functions = [entry for entry in self.event_functions(active) if entry[0] not in unmonitored]
            events = [ending(function) for _, function in event_functions]
            solution = self.solve(start, until, y, active, events)
            closing_time = self.find_closure(solution, [index for (kind, index), _ in event_functions if kind == "reached"])
            if closing_time is not None:
                # Integrate to where it is closed, which makes the sign change visible.
                solution = self.solve(start, closing_time, y, active, events)
                assert solution.status == 1, "a gap that closes and opens again was missed"
            if solution.status == 0:
                start, y, unmonitored = until, solution.y[:, -1], {}
                continue
            which = next(i for i, times in enumerate(solution.t_events) if len(times))
            (kind, index), function = event_functions[which]
            time, at = self.locate(start, until, y, active, function, solution)
            q, u = self.split(at)
            if kind == "released":
                active = {i: mode for i, mode in active.items() if i != index}
                self.record_event(time, index, "released")
            elif kind == "slips":
                active = {**active, self.ground: int(index)}
                self.record_event(time, self.ground, slide_name(int(index)))
            else:
                u, active = self.resolve_contacts(time, q, u, active)
            start, y = time, np.concatenate([q, u, at[-1:]])
            unmonitored = self.just_opened(q, u, active)
        return y, active

    def find_closure(self, solution, indices):
        """Returns the first of several instants within the steps at which a gap is closed that is open
        at the ends of the step, if any."""
        if not indices:
            return None
        ends = solution.t
        for start, end in zip(ends[:-1], ends[1:]):
            for part in (0.2, 0.4, 0.6, 0.8):
                time = start + part * (end - start)
                if self.system.gaps(self.split(solution.sol(time))[0])[indices].min() < -1e-13:
                    return time
        return None

    def just_opened(self, q, u, active):
        """Returns the gaps that open from zero, with an interval in which they cannot close again [s]."""
        rows, drifts = self.system.constraints(q, u)
        changes = rows @ self.motion(q, u, active)[0] + drifts
        found, gaps = {}, self.system.gaps(q)
        for index, gap in enumerate(gaps):
            if abs(gap) < CLOSED and index not in active:
                found["reached", index] = unmonitored_time(rows[index] @ u, changes[index])
        if active.get(self.ground) in (1, -1) and abs(rows[-1] @ u) < STILL:
            found["stops", self.ground] = unmonitored_time(0.0, abs(changes[-1]))
        return found

    def locate(self, start, end, y, active, function, solution):
        """Returns the time of the event and the state there."""
        time = solution.t[-1]
        reach = 1e-7
        back, ahead = max(start, time - reach), min(end, time + reach)
        slope = (function(ahead, solution.sol(ahead)) - function(back, solution.sol(back))) / (ahead - back)
        at = y
        for _ in range(12):
            at = self.solve(start, time, y, active).y[:, -1] if time > start else y
            change = function(time, at) / slope
            if abs(change) < 1e-16 + 1e-16 * abs(time):
                break
            time = max(start, time - change)
        return time, at


def unmonitored_time(rate, change):
    """Returns half of the time in which an opening `rate` is stopped by `change`, at most 1e-5 s."""
    return 1e-5 if change >= 0.0 or rate < STILL else min(1e-5, 0.5 * rate / -change)


def ending(function):
    """Returns a terminal event of `solve_ivp` where `function` falls through zero."""

    def function_of_state(t, y):
        return function(t, y)

    function_of_state.terminal, function_of_state.direction = True, -1
    return function_of_state


def slide_name(mode):
    return "sticks" if mode == "stick" else ("slides forward" if mode > 0 else "slides backward")
