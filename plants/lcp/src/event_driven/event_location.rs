//! When a guard breaks within a step, and how near to it the step has come.

use super::{AT_REST, Due, NEAR, SHORTEST, TrialStep};
use crate::flow::Flow;
use crate::guards::{GUARDS, Guard, Guards, STOPS, at_foot, kind};
use crate::motion::Motion;
use crate::real::{Lanes, Real};
use crate::root::{first_return_of_cubic, first_root_of_cubic, first_root_of_quadratic};
use crate::state::{Slope, State, normalised};

impl<const N: usize> Flow<N> {
    /// The first event of each island.
    #[expect(
        clippy::too_many_arguments,
        reason = "what a step is about, each by its name"
    )]
    pub(super) fn next_event(
        &mut self,
        trial: &TrialStep<N>,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        before: &Guards,
        after: &Guards,
        h: Lanes,
        recovery: f64,
    ) -> [Option<Due>; 4] {
        let tolerances = self.tolerances();
        let middle = midway(state, start, trial, h, self.model.is_free());
        let motion = self.motion(&middle, recovery);
        let middle = self.guards(&middle, &motion, recovery);
        let first = |leg: usize| {
            let seconds = h.lane(leg);
            if seconds <= 0.0 {
                return None;
            }
            let breaks = |place: usize| {
                let of = |guards: &Guards| guards.values[place].lane(leg);
                let (a, m, b) = (of(before), of(&middle), of(after));
                let broken = b < -tolerances[place];
                let [low, high] = [[0.0, a], [seconds, b]];
                if kind(place) != Guard::Gap {
                    return broken.then(|| Due {
                        at: first_root_of_quadratic(a, m, b) * seconds,
                        place,
                        leg,
                        low,
                        high,
                        met: true,
                    });
                }
                let [u, v] = [before, after].map(|g| g.rates[place].lane(leg) * seconds);
                if a <= 0.0 && broken {
                    let start = Closed {
                        from: a,
                        to: b,
                        rates: [u, v],
                        seconds,
                    };
                    return start.next_event(place, leg, [low, high]);
                }
                let dips = u < 0.0 && v > 0.0;
                if !(broken || dips) {
                    return None;
                }
                first_root_of_cubic(a, u, b, v).map(|share| Due {
                    at: share * seconds,
                    place,
                    leg,
                    low,
                    high,
                    met: true,
                })
            };
            (0..GUARDS).filter_map(breaks).reduce(sooner)
        };
        let mut next_event = [None; 4];
        for (next_event, island) in next_event.iter_mut().zip(self.islands()) {
            *next_event = island.filter_map(first).reduce(sooner);
        }
        next_event
    }

    /// Comes nearer to where forces vanish and slides end, which no derivative tells; says whether there is anything to be
    /// tried again.
    pub(super) fn refine(
        &self,
        trial: &TrialStep<N>,
        next_event: &mut [Option<Due>; 4],
        h: &mut Lanes,
        recovery: f64,
    ) -> bool {
        let mut again = false;
        let mut guards = None;
        for (island, next_event) in self.islands().zip(next_event) {
            let Some(next_event) = next_event else {
                continue;
            };
            if !next_event.met || kind(next_event.place) == Guard::Gap || next_event.low[1] <= 0.0 {
                continue;
            }
            let guards =
                guards.get_or_insert_with(|| self.guards(&trial.end, &trial.motion, recovery));
            let value = guards.values[next_event.place].lane(next_event.leg);
            if value.abs() <= NEAR * self.tolerances()[next_event.place] {
                continue;
            }
            // False position, which halves the weight of an end that stays (Illinois).
            if value > 0.0 {
                (next_event.low, next_event.high[1]) =
                    ([next_event.at, value], 0.5 * next_event.high[1]);
            } else {
                (next_event.high, next_event.low[1]) =
                    ([next_event.at, value], 0.5 * next_event.low[1]);
            }
            let ([a, f], [b, g]) = (next_event.low, next_event.high);
            next_event.at = (a * g - b * f) / (g - f);
            for leg in self.lanes_of(island) {
                *h = h.with_lane(leg, next_event.at);
            }
            again = true;
        }
        again
    }

    /// How much later than found a gap closes, by its own rate, in each lane.
    pub(super) fn correction(
        &mut self,
        trial: &TrialStep<N>,
        next_event: &[Option<Due>; 4],
        h: Lanes,
    ) -> Lanes {
        let guards = self.guards(&trial.end, &trial.motion, 0.0);
        let mut correction = Lanes::zero();
        for (island, next_event) in self.islands().zip(next_event) {
            let Some(next_event) = next_event
                .filter(|next_event| next_event.met && kind(next_event.place) == Guard::Gap)
            else {
                continue;
            };
            let of = |lanes: &[Lanes; GUARDS]| lanes[next_event.place].lane(next_event.leg);
            let later = -of(&guards.values) / of(&guards.rates);
            if later.abs() < 0.5 * h.lane(next_event.leg) {
                for leg in self.lanes_of(island) {
                    correction = correction.with_lane(leg, later);
                }
            }
        }
        correction
    }
}

/// A gap that is closed when a step begins and does not hold; over the step, rates times its length.
struct Closed {
    from: f64,
    to: f64,
    rates: [f64; 2],
    seconds: f64,
}

impl Closed {
    /// When it closes again: now where it closes to begin with, else when it comes back to where it started from.
    fn next_event(&self, place: usize, leg: usize, [low, high]: [[f64; 2]; 2]) -> Option<Due> {
        let [u, v] = self.rates;
        let resting = AT_REST * self.seconds;
        let next_event = |at: f64, met: bool| Due {
            at,
            place,
            leg,
            low,
            high,
            met,
        };
        if u < -resting {
            return Some(next_event(0.0, true));
        }
        if u > resting {
            let share = first_return_of_cubic(u, self.to - self.from, v)?;
            return Some(next_event(share * self.seconds, true));
        }
        if self.to >= self.from && u >= 0.0 {
            // What it drifted to while it held, on its way out.
            return None;
        }
        // At rest and about to close: too long a step to see it do so.
        Some(next_event(0.1 * self.seconds, self.seconds < SHORTEST))
    }
}

pub(super) fn sooner(a: Due, b: Due) -> Due {
    if b.at < a.at { b } else { a }
}

/// Whether a gap may have closed and opened again within a step.
pub(super) fn dips(before: &Guards, after: &Guards, h: Lanes) -> bool {
    let places = (0..STOPS).chain([at_foot(3, 0), at_foot(4, 0)]);
    places.into_iter().any(|place| {
        let [a, b] = [before, after].map(|g| g.values[place]);
        let [u, v] = [before, after].map(|g| g.rates[place]);
        let zero = Lanes::zero();
        if !(u.simd_lt(zero) & v.simd_gt(zero)).any() {
            return false;
        }
        let [a, b] = [a, b].map(Lanes::to_array);
        let [u, v] = [u, v].map(Lanes::to_array);
        (0..4).any(|leg| {
            let seconds = h.lane(leg);
            u[leg] < 0.0
                && v[leg] > 0.0
                && a[leg].min(b[leg]) < 0.25 * seconds * (v[leg] - u[leg])
                && first_root_of_cubic(a[leg], u[leg] * seconds, b[leg], v[leg] * seconds).is_some()
        })
    })
}

/// The state in the middle of a step, from values and slopes at its ends: of third order.
pub(super) fn midway<const N: usize>(
    state: &State<Lanes, N>,
    start: &Motion<Lanes, N>,
    trial: &TrialStep<N>,
    h: Lanes,
    free: bool,
) -> State<Lanes, N> {
    let half = |a: f64, b: f64| 0.5 * (a + b);
    let mut middle = trial.end;
    for (m, a) in middle.angles.iter_mut().zip(&state.angles) {
        *m = Lanes::splat(0.5) * (*m + *a);
    }
    for (m, a) in middle.rates.iter_mut().zip(&state.rates) {
        *m = Lanes::splat(0.5) * (*m + *a);
    }
    middle.pulley = Lanes::splat(0.5) * (middle.pulley + state.pulley);
    middle.pulley_rate = Lanes::splat(0.5) * (middle.pulley_rate + state.pulley_rate);
    for i in 0..3 {
        middle.position[i] = half(middle.position[i], state.position[i]);
        middle.velocity[i] = half(middle.velocity[i], state.velocity[i]);
        middle.turning[i] = half(middle.turning[i], state.turning[i]);
    }
    for i in 0..4 {
        middle.attitude[i] = half(middle.attitude[i], state.attitude[i]);
    }
    let mut bend = Slope::zero();
    bend.add(0.125, &start.slope, free);
    bend.add(-0.125, &trial.motion.slope, free);
    normalised(&middle.along(h, &bend, free), free)
}

/// Moves by a time so short that a second order is exact.
pub(super) fn taylor<const N: usize>(
    state: &State<Lanes, N>,
    slope: &Slope<Lanes, N>,
    seconds: Lanes,
    free: bool,
) -> State<Lanes, N> {
    let mut next = state.along(seconds, slope, free);
    let half = Lanes::splat(0.5) * seconds * seconds;
    for (angle, acceleration) in next.angles.iter_mut().zip(&slope.rates) {
        *angle += half * *acceleration;
    }
    next.pulley += half * slope.pulley_rate;
    normalised(&next, free)
}
