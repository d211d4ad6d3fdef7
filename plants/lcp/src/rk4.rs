//! The classical Runge–Kutta method between events that are found to the instant.
//!
//! A step that an event cuts short is taken again up to the event. Where legs hang on a trunk that is held they have nothing
//! to do with each other: each then goes its own time, side by side with the others.

use crate::drives::wanted;
use crate::events::{Stop, direction};
use crate::flow::{Flow, FlowError};
use crate::guards::{GUARDS, Guard, Guards, STOPS, at_foot, kind};
use crate::motion::{Motion, Scene};
use crate::motors::Effort;
use crate::real::{Lanes, Real};
use crate::root::{first_root_of_cubic, first_root_of_quadratic};
use crate::site::Site;
use crate::state::{Slope, State};

/// Guards count as broken beyond these: metres, newtons, metres per second.
const GAP: f64 = 1e-10;
const FORCE: f64 = 1e-9;
const SLIDE: f64 = 2e-7;

/// Errors of constraints are taken back at this rate per step.
const RECOVERY: f64 = 0.2;

/// Steps are not made shorter than this to see a gap open \[s\].
const SHORTEST: f64 = 1e-7;

/// Gaps below this may close at once \[m\].
const TOUCHING: f64 = 1e-8;

/// Events in one step, at most.
const EVENTS_MAX: u32 = 200;

fn tolerances() -> [f64; GUARDS] {
    std::array::from_fn(|place| match kind(place) {
        Guard::Gap => GAP,
        Guard::Force | Guard::Friction => FORCE,
        Guard::Slide => SLIDE,
    })
}

/// A step and what is at its ends.
struct Leap<const N: usize> {
    end: State<Lanes, N>,
    /// State in the middle: what the third stage was made from.
    middle: State<Lanes, N>,
    /// The slopes' weighted mean.
    mean: Slope<Lanes, N>,
}

/// An event of an island: when, in seconds from the step's start, and which.
#[derive(Clone, Copy)]
struct Due {
    at: f64,
    place: usize,
    leg: usize,
    /// Whether it is one: a gap that was closed to begin with tells nothing of when it closed again, only that the step was
    /// too long to see it.
    met: bool,
}

impl<const N: usize> Flow<N> {
    /// Moves on by `seconds`.
    pub(crate) fn run_rk4(&mut self, seconds: f64) -> Result<(), FlowError> {
        let recovery = RECOVERY / seconds;
        let mut remaining = Lanes::splat(seconds);
        let tolerances = tolerances();
        self.obey();
        let mut start = self.start(recovery)?;
        let mut events = 0;
        loop {
            let state = self.state;
            let leap = self.leap(&state, &start, remaining, recovery);
            let end = self.motion(&leap.end, recovery);
            let after = self.guards(&leap.end, &end, recovery);
            let before = self.guards_at_start(&state, &start, recovery);
            if !after.alarmed(&tolerances) && !dips(&before, &after, remaining) {
                self.accept(&leap, &state, &start, remaining);
                self.counts.steps += 1;
                self.end_of_step(&end);
                return self.check();
            }
            let due = self.due(&leap, &before, &after, remaining, recovery, &tolerances);
            let mut h = remaining;
            for (island, due) in self.islands().zip(&due) {
                if let Some(due) = due {
                    for leg in self.lanes_of(island) {
                        h = h.with_lane(leg, due.at);
                    }
                }
            }
            let mut leap = self.leap(&state, &start, h, recovery);
            let end = self.motion(&leap.end, recovery);
            let correction = self.correction(&leap.end, &end, &due, h);
            leap.end = taylor(&leap.end, &end.slope, correction, self.model.is_free());
            h += correction;
            self.accept(&leap, &state, &start, h);
            remaining -= h;
            for (island, due) in self.islands().zip(&due) {
                if due.is_some_and(|due| due.met) {
                    if std::env::var("DBG").is_ok() { let d = due.unwrap(); eprintln!("due {} at {:e} leg {} h {:e} rem {:e}", d.place, d.at, d.leg, h.lane(0), remaining.lane(0)); }
                    events += 1;
                    self.counts.events += 1;
                    let legs: Vec<usize> = island.clone().collect();
                    self.meet(&legs, recovery)?;
                } else if due.is_none() {
                    for leg in self.lanes_of(island) {
                        remaining = remaining.with_lane(leg, 0.0);
                    }
                }
            }
            if events > EVENTS_MAX {
                return Err(FlowError::Crowded { events, seconds });
            }
            let state = self.state;
            start = self.motion(&state, recovery);
            if remaining.to_array().iter().all(|&left| left <= 0.0) {
                self.counts.steps += 1;
                self.end_of_step(&start);
                return self.check();
            }
        }
    }

    /// The lanes of an island: all of them where the robot moves as a whole.
    fn lanes_of(&self, island: core::ops::Range<usize>) -> core::ops::Range<usize> {
        if self.model.is_free() { 0..4 } else { island }
    }

    fn scene(&self, recovery: f64) -> Scene<'_, Lanes, N> {
        Scene::new(&self.model, &self.model.side_by_side, &self.mode, recovery)
    }

    fn guards(&self, state: &State<Lanes, N>, motion: &Motion<Lanes, N>, recovery: f64) -> Guards {
        Guards::new(&self.scene(recovery), state, motion, &self.bench)
    }

    fn guards_at_start(
        &mut self,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        recovery: f64,
    ) -> Guards {
        if !self.mode.contacts.is_empty() {
            // The feet's forces of then are not kept.
            let _ = self.motion(state, recovery);
        }
        self.guards(state, start, recovery)
    }

    /// The motion at the start, in a mode that has something to it.
    fn start(&mut self, recovery: f64) -> Result<Motion<Lanes, N>, FlowError> {
        // A gap counts here from where it touches: what was let go at that very instant may be caught again by new commands.
        let thresholds: [f64; GUARDS] = std::array::from_fn(|place| match kind(place) {
            Guard::Gap => -TOUCHING,
            _ => FORCE,
        });
        let state = self.state;
        let motion = self.motion(&state, recovery);
        let guards = self.guards(&state, &motion, recovery);
        if !guards.alarmed(&thresholds) {
            return Ok(motion);
        }
        for island in self.islands() {
            let alarmed = |leg: usize| {
                let mut values = guards.values.iter().zip(&thresholds);
                values.any(|(guard, threshold)| guard.lane(leg) < -threshold)
            };
            if island.clone().any(alarmed) {
                let legs: Vec<usize> = island.collect();
                self.meet(&legs, recovery)?;
            }
        }
        let state = self.state;
        Ok(self.motion(&state, recovery))
    }

    /// Impact and change of mode of these legs.
    fn meet(&mut self, legs: &[usize], recovery: f64) -> Result<(), FlowError> {
        let mut state = self.state;
        let mut mode = self.mode.clone();
        let mut instant = core::mem::take(&mut self.instant);
        let scene = self.scene(recovery);
        let toll = instant.impact(&scene, &mut state, legs);
        let settled = toll.and_then(|toll| {
            instant.settle(&scene, &state, legs, &mut mode)?;
            Ok(toll)
        });
        self.instant = instant;
        (self.counts.solver_iterations, self.counts.factorisations) =
            (self.instant.iterations, self.instant.factorisations);
        let toll = settled?;
        if std::env::var("DBG").is_ok() { eprintln!("   meet toll {:e} {:e} contacts {:?} holds {:?}", toll.impact, toll.friction, mode.contacts, [mode.holds.closed, mode.holds.extended, mode.holds.cable]); }
        self.state = state;
        self.mode = mode;
        self.ledger.impact += toll.impact;
        self.ledger.dissipated += toll.friction;
        for (sum, part) in self.tally.ground.iter_mut().flatten().zip(toll.ground.iter().flatten()) {
            *sum += part;
        }
        Ok(())
    }

    /// One step, lane by lane of its own length.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    fn leap(
        &mut self,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        h: Lanes,
        recovery: f64,
    ) -> Leap<N> {
        let free = self.model.is_free();
        let half = h * Lanes::splat(0.5);
        let mut mean = Slope::zero();
        mean.add(1.0 / 6.0, &start.slope, free);
        let second = self.motion(&state.along(half, &start.slope, free), recovery);
        mean.add(1.0 / 3.0, &second.slope, free);
        let middle = state.along(half, &second.slope, free);
        let third = self.motion(&middle, recovery);
        mean.add(1.0 / 3.0, &third.slope, free);
        let fourth = self.motion(&state.along(h, &third.slope, free), recovery);
        mean.add(1.0 / 6.0, &fourth.slope, free);
        Leap {
            end: normalised(&state.along(h, &mean, free), free),
            middle,
            mean,
        }
    }

    /// Takes the end of a step for the present, and writes up what has flowed.
    fn accept(&mut self, leap: &Leap<N>, before: &State<Lanes, N>, start: &Motion<Lanes, N>, h: Lanes) {
        self.ledger.dissipated += (h * leap.mean.dissipated).sum();
        self.ledger.actuator += (h * leap.mean.actuator).sum();
        if self.model.servos.is_some() || !self.mode.contacts.is_empty() {
            self.tally(before, start, h);
        }
        self.state = leap.end;
    }

    fn end_of_step(&mut self, end: &Motion<Lanes, N>) {
        let state = self.state;
        let stored = end
            .articulated
            .stored(&self.model, &self.model.side_by_side, &state);
        self.ledger.balance(stored);
        if let Some(ground) = &self.model.ground {
            let rotation = end.articulated.rotation();
            for contact in &mut self.mode.contacts {
                if let Some(last) = &mut contact.slides {
                    let legs = &self.model.side_by_side;
                    let site =
                        Site::new(legs, &end.articulated.chain, &state, contact.leg, contact.links);
                    *last = direction(&site.footing(ground, state.position, &rotation), *last);
                }
            }
        }
    }

    pub(crate) fn check(&self) -> Result<(), FlowError> {
        let sum = self.state.rates.iter().fold(Lanes::zero(), |sum, r| sum + *r);
        let legs = self.model.legs.len();
        if sum.to_array()[..legs].iter().all(|x| x.is_finite()) && self.state.position[2].is_finite() {
            Ok(())
        } else {
            Err(FlowError::NotFinite)
        }
    }

    /// The first event of each island.
    fn due(
        &mut self,
        leap: &Leap<N>,
        before: &Guards,
        after: &Guards,
        h: Lanes,
        recovery: f64,
        tolerances: &[f64; GUARDS],
    ) -> Vec<Option<Due>> {
        let middle = self.motion(&leap.middle, recovery);
        let middle = self.guards(&leap.middle, &middle, recovery);
        let first = |leg: usize| {
            let seconds = h.lane(leg);
            let mut due: Option<Due> = None;
            for (place, tolerance) in tolerances.iter().enumerate() {
                let of = |guards: &Guards| guards.values[place].lane(leg);
                let (a, m, b) = (of(before), of(&middle), of(after));
                let share = if kind(place) == Guard::Gap {
                    let [u, v] = [before, after].map(|g| g.rates[place].lane(leg) * seconds);
                    if b >= -tolerance && !(u < 0.0 && v > 0.0) {
                        continue;
                    }
                    if b < -tolerance && a <= *tolerance {
                        let met = seconds < SHORTEST;
                        let at = if met { seconds } else { 0.25 * seconds };
                        if due.is_none_or(|due| at < due.at) {
                            due = Some(Due { at, place, leg, met });
                        }
                        continue;
                    }
                    first_root_of_cubic(a, u, b, v)
                } else if b < -tolerance {
                    Some(first_root_of_quadratic(a, m, b))
                } else {
                    None
                };
                if let Some(share) = share {
                    let at = share * seconds;
                    if due.is_none_or(|due| at < due.at) {
                        let met = true;
                        due = Some(Due { at, place, leg, met });
                    }
                }
            }
            due
        };
        self.islands()
            .map(|island| {
                island
                    .filter_map(first)
                    .fold(None, |least: Option<Due>, due| match least {
                        Some(least) if least.at <= due.at => Some(least),
                        _ => Some(due),
                    })
            })
            .collect()
    }

    /// How much later than found a gap closes, by its own rate, in each lane.
    fn correction(
        &mut self,
        state: &State<Lanes, N>,
        end: &Motion<Lanes, N>,
        due: &[Option<Due>],
        h: Lanes,
    ) -> Lanes {
        let guards = self.guards(state, end, 0.0);
        let mut correction = Lanes::zero();
        for (island, due) in self.islands().zip(due) {
            let Some(due) = due else { continue };
            if kind(due.place) != Guard::Gap || !due.met {
                continue;
            }
            let (gap, rate) = (
                guards.values[due.place].lane(due.leg),
                guards.rates[due.place].lane(due.leg),
            );
            let later = -gap / rate;
            if later.abs() < 0.05 * h.lane(due.leg) {
                for leg in self.lanes_of(island) {
                    correction = correction.with_lane(leg, later);
                }
            }
        }
        correction
    }
}

/// Whether a gap may have closed and opened again within a step.
fn dips(before: &Guards, after: &Guards, h: Lanes) -> bool {
    let places = (0..STOPS).chain([at_foot(3, 0), at_foot(4, 0)]);
    places.into_iter().any(|place| {
        let [a, b] = [before, after].map(|g| g.values[place].to_array());
        let [u, v] = [before, after].map(|g| g.rates[place].to_array());
        (0..4).any(|leg| {
            let seconds = h.lane(leg);
            u[leg] < 0.0
                && v[leg] > 0.0
                && a[leg].min(b[leg]) < 0.25 * seconds * (v[leg] - u[leg])
                && first_root_of_cubic(a[leg], u[leg] * seconds, b[leg], v[leg] * seconds)
                    .is_some()
        })
    })
}

/// Moves by a time so short that a second order is exact.
fn taylor<const N: usize>(
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

/// The same with an attitude of unit length.
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn normalised<const N: usize>(state: &State<Lanes, N>, free: bool) -> State<Lanes, N> {
    let mut next = *state;
    if free {
        let square: f64 = next.attitude.iter().map(|c| c * c).sum();
        let scale = 1.0 / libm::sqrt(square);
        next.attitude = next.attitude.map(|c| c * scale);
    }
    next
}

impl<const N: usize> Flow<N> {
    /// Takes up new commands: motors that have their torque again, motors that have none left.
    pub(crate) fn obey(&mut self) {
        /// A motor that changes its mind more often is on the border of its torque; either answer is right there.
        const CHANGES_MAX: usize = 4;
        let Some(servos) = self.model.servos else {
            return;
        };
        if servos.both().iter().all(|servo| servo.torque().is_infinite()) {
            return;
        }
        for _ in 0..CHANGES_MAX {
            let state = self.state;
            let motion = self.motion(&state, 0.0);
            let commands = &self.mode.commands;
            let effort = Effort {
                torques: [motion.felt.hip_torque, motion.felt.knee_torque],
                given: [motion.slope.rates[0], motion.slope.pulley_rate],
                wanted: [
                    wanted(&servos.hip, commands.hip, state.angles[0], state.rates[0]),
                    wanted(&servos.knee, commands.pulley, state.pulley, state.pulley_rate),
                ],
            };
            if !self.tire(&effort) {
                return;
            }
        }
    }
}

const _: () = assert!(Stop::ALL.len() == STOPS);
