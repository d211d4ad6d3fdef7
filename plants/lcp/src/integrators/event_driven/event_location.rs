//! Location of guard violations within a step, and refinement of their times.

use super::interpolation::midpoint_state;
use super::{AT_REST, EventDriven, LocatedEvent, REFINED, SHORTEST, tolerances};
use crate::constraints::guards::{GUARDS, Guard, Guards, kind};
use crate::integrators::root::{
    first_return_of_cubic, first_root_of_cubic, first_root_of_quadratic,
};
use crate::integrators::run_state::RunState;
use crate::integrators::substep::{Substep, TrialStep};
use crate::model::Model;
use crate::model::real::{Lanes, Real};

impl<const N: usize> EventDriven<N> {
    /// Returns the first event of each island.
    pub(super) fn locate_events(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        substep: &Substep<'_, N>,
        trial: &TrialStep<N>,
        [before, after]: [&Guards; 2],
    ) -> [Option<LocatedEvent>; 4] {
        let h = substep.h;
        let tolerances = tolerances(model);
        let middle = midpoint_state(substep, trial, model.is_free());
        run.set_load_at(model, substep.elapsed + Lanes::splat(0.5) * h);
        let motion = self.rhs.motion(model, run, &middle, substep.recovery);
        let middle = self.rhs.guards(model, run, &middle, &motion);
        let first = |leg: usize| {
            let seconds = h.lane(leg);
            if seconds <= 0.0 {
                return None;
            }
            let crossing = |index: usize| {
                let of = |guards: &Guards| guards.values[index].lane(leg);
                let (a, m, b) = (of(before), of(&middle), of(after));
                let crossed = b < -tolerances[index];
                let [low, high] = [[0.0, a], [seconds, b]];
                if kind(index) != Guard::Gap {
                    return crossed.then(|| LocatedEvent {
                        at: first_root_of_quadratic(a, m, b) * seconds,
                        index,
                        leg,
                        low,
                        high,
                        is_event: true,
                    });
                }
                let [u, v] = [before, after].map(|g| g.rates[index].lane(leg) * seconds);
                if a <= 0.0 && crossed {
                    let start = Closed {
                        from: a,
                        to: b,
                        rates: [u, v],
                        seconds,
                    };
                    return start.reclosing(index, leg, [low, high]);
                }
                let dips = u < 0.0 && v > 0.0;
                if !(crossed || dips) {
                    return None;
                }
                first_root_of_cubic(a, u, b, v).map(|share| LocatedEvent {
                    at: share * seconds,
                    index,
                    leg,
                    low,
                    high,
                    is_event: true,
                })
            };
            (0..GUARDS).filter_map(crossing).reduce(earlier)
        };
        let mut events = [None; 4];
        for (event, island) in events.iter_mut().zip(model.islands()) {
            *event = island.filter_map(first).reduce(earlier);
        }
        events
    }

    /// Refines the times at which forces vanish and slides end, for which no derivative is
    /// available; returns whether another trial step is needed.
    pub(super) fn refine(
        &self,
        model: &Model<N>,
        run: &RunState<N>,
        trial: &TrialStep<N>,
        events: &mut [Option<LocatedEvent>; 4],
        h: &mut Lanes,
    ) -> bool {
        let mut again = false;
        let mut guards = None;
        for (island, event) in model.islands().zip(events) {
            let Some(event) = event else {
                continue;
            };
            if !event.is_event || kind(event.index) == Guard::Gap || event.low[1] <= 0.0 {
                continue;
            }
            let guards = guards
                .get_or_insert_with(|| self.rhs.guards(model, run, &trial.end, &trial.motion));
            let value = guards.values[event.index].lane(event.leg);
            if value.abs() <= REFINED * tolerances(model)[event.index] {
                continue;
            }
            // False position with half the weight for a retained end (Illinois algorithm).
            if value > 0.0 {
                (event.low, event.high[1]) = ([event.at, value], 0.5 * event.high[1]);
            } else {
                (event.high, event.low[1]) = ([event.at, value], 0.5 * event.low[1]);
            }
            let ([a, f], [b, g]) = (event.low, event.high);
            event.at = (a * g - b * f) / (g - f);
            for leg in model.lanes_of(island) {
                *h = h.with_lane(leg, event.at);
            }
            again = true;
        }
        again
    }

    /// Returns the correction of the closing time of a gap by its rate, in each lane \[s\].
    pub(super) fn correction(
        &self,
        model: &Model<N>,
        run: &RunState<N>,
        trial: &TrialStep<N>,
        events: &[Option<LocatedEvent>; 4],
        h: Lanes,
    ) -> Lanes {
        let guards = self.rhs.guards(model, run, &trial.end, &trial.motion);
        let mut correction = Lanes::zero();
        for (island, event) in model.islands().zip(events) {
            let Some(event) =
                event.filter(|event| event.is_event && kind(event.index) == Guard::Gap)
            else {
                continue;
            };
            let of = |lanes: &[Lanes; GUARDS]| lanes[event.index].lane(event.leg);
            let later = -of(&guards.values) / of(&guards.rates);
            if later.abs() < 0.5 * h.lane(event.leg) {
                for leg in model.lanes_of(island) {
                    correction = correction.with_lane(leg, later);
                }
            }
        }
        correction
    }
}

/// A gap that is closed at the start of a step but inactive. Rates are multiplied by the length of
/// the step \[m\].
struct Closed {
    from: f64,
    to: f64,
    rates: [f64; 2],
    seconds: f64,
}

impl Closed {
    /// Returns the time at which the gap closes again: immediately if it is closing at the start,
    /// otherwise at the return to its initial value.
    fn reclosing(
        &self,
        index: usize,
        leg: usize,
        [low, high]: [[f64; 2]; 2],
    ) -> Option<LocatedEvent> {
        let [u, v] = self.rates;
        let resting = AT_REST * self.seconds;
        let event = |at: f64, is_event: bool| LocatedEvent {
            at,
            index,
            leg,
            low,
            high,
            is_event,
        };
        if u < -resting {
            return Some(event(0.0, true));
        }
        if u > resting {
            let share = first_return_of_cubic(u, self.to - self.from, v)?;
            return Some(event(share * self.seconds, true));
        }
        if self.to >= self.from && u >= 0.0 {
            // Drift while active, which is now decreasing.
            return None;
        }
        // At rest and about to close: the step is too long to resolve it.
        Some(event(0.1 * self.seconds, self.seconds < SHORTEST))
    }
}

pub(super) fn earlier(a: LocatedEvent, b: LocatedEvent) -> LocatedEvent {
    if b.at < a.at { b } else { a }
}
