//! Going on in time between events that are found to the instant, in steps as long as their error allows.
//!
//! A step that an event cuts short is taken again up to the event, where impulses and a new choice of what holds make a new
//! start. Where legs hang on a trunk that is held they have nothing to do with each other: each then goes its own time, side
//! by side with the others.

use crate::drives::{Commands, wanted};
use crate::events::direction;
use crate::flow::{Flow, FlowError, Tally};
use crate::guards::{GUARDS, Guard, Guards, STOPS, at_foot, kind};
use crate::hold::Holds;
use crate::motion::{Motion, Scene};
use crate::motors::Effort;
use crate::real::{Lanes, Real};
use crate::root::{first_root_of_cubic, first_root_of_quadratic};
use crate::site::Site;
use crate::state::{Slope, State, normalised};

/// Gaps count as broken beyond this \[m\], slides as reversed below this \[m/s\].
const GAP: f64 = 1e-10;
const SLIDE: f64 = 2e-7;

/// Steps are not made shorter than this to see a gap open \[s\].
const SHORTEST: f64 = 1e-9;

/// How often the end of a force or a slide is come nearer to, and what is near enough: a share of the guard's tolerance.
const REFINEMENTS: u32 = 6;
const NEAR: f64 = 0.1;

/// Gaps below this that hardly move may close at once \[m\], \[m/s\].
const TOUCHING: f64 = 1e-8;
const AT_REST: f64 = 1e-7;

/// The legs by number.
const ALL: [usize; 4] = [0, 1, 2, 3];

/// Errors of constraints are taken back at this rate per step.
const RECOVERY: f64 = 0.2;

/// Events at one instant, at most.
const AT_ONCE_MAX: u32 = 12;

/// A step that is taken in more pieces than this is too stiff for an explicit method.
const PIECES_MAX: u32 = 48;

/// The method of the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stepper {
    RungeKutta,
    Rosenbrock,
}

/// A step as it was made.
#[derive(Debug, Clone)]
pub(crate) struct Leap<const N: usize> {
    pub(crate) end: State<Lanes, N>,
    /// The motion at its end, in the same mode.
    pub(crate) motion: Box<Motion<Lanes, N>>,
    /// Work that friction took and that motors gave, by leg \[J\].
    pub(crate) dissipated: Lanes,
    pub(crate) actuator: Lanes,
    /// What was felt.
    pub(crate) felt: Tally,
    /// How far a foot may be off \[m\].
    pub(crate) error: Lanes,
}

/// The memory of a march: large things that are passed on and not copied.
#[derive(Debug, Clone)]
pub(crate) struct Track<const N: usize> {
    start: Box<Motion<Lanes, N>>,
    /// Guards at the start, and at the end of a piece.
    guards: Guards,
    after: Guards,
    leap: Leap<N>,
    /// What the start is known for.
    known: Option<Known<N>>,
}

/// All that a motion depends on while no foot stands.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known<const N: usize> {
    state: State<Lanes, N>,
    holds: Holds<Lanes>,
    commands: Commands<Lanes>,
    recovery: f64,
}

impl<const N: usize> Track<N> {
    pub(crate) fn new(motion: Motion<Lanes, N>, end: State<Lanes, N>) -> Self {
        let zero = Lanes::zero();
        Self {
            start: Box::new(motion),
            guards: Guards::none(),
            after: Guards::none(),
            leap: Leap {
                end,
                motion: Box::new(motion),
                dissipated: zero,
                actuator: zero,
                felt: Tally::new(),
                error: zero,
            },
            known: None,
        }
    }
}

/// Why a march ended before its time.
pub(crate) enum Halt {
    /// Too many pieces.
    Stiff,
    /// Too many events.
    Crowded,
    Failed(FlowError),
}

impl<E: Into<FlowError>> From<E> for Halt {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// The next event of an island: when, in seconds from the step's start, and which.
#[derive(Clone, Copy)]
struct Due {
    at: f64,
    place: usize,
    leg: usize,
    /// Times and values between which the guard breaks.
    low: [f64; 2],
    high: [f64; 2],
    /// Whether it is one: a gap that was closed to begin with tells nothing of when it closed again, only that the step was
    /// too long to see it.
    met: bool,
}

/// What a march has come to so far.
struct Progress {
    remaining: Lanes,
    events: [u32; 4],
    at_once: u32,
    pieces: u32,
}

impl Progress {
    /// Counts a piece, good or not.
    fn count(&mut self, stepper: Stepper) -> Result<(), Halt> {
        self.pieces += 1;
        if self.pieces > PIECES_MAX && stepper == Stepper::RungeKutta {
            return Err(Halt::Stiff);
        }
        Ok(())
    }
}

impl<const N: usize> Flow<N> {
    /// Moves on by `seconds`.
    pub(crate) fn march(&mut self, stepper: Stepper, seconds: f64) -> Result<(), Halt> {
        let state = self.state;
        let mut track = self.track.take().unwrap_or_else(|| {
            // Something to begin with; it takes no part, so it does not count.
            let counts = self.counts;
            let motion = self.motion(&state, 0.0);
            self.counts = counts;
            Box::new(Track::new(motion, state))
        });
        let marched = self.march_on(stepper, seconds, &mut track);
        self.track = Some(track);
        marched
    }

    fn march_on(
        &mut self,
        stepper: Stepper,
        seconds: f64,
        track: &mut Track<N>,
    ) -> Result<(), Halt> {
        let recovery = RECOVERY / seconds;
        self.obey();
        let mut progress = Progress {
            remaining: self.present(seconds),
            events: [0; 4],
            at_once: 0,
            pieces: 0,
        };
        self.start(recovery, track)?;
        track.known = None;
        self.estimate = 0.0;
        loop {
            let state = self.state;
            progress.count(stepper)?;
            let (h, due, guarded) = self.piece(stepper, &state, track, &mut progress, recovery)?;
            self.accept(&track.leap, &state);
            progress.remaining -= h;
            core::mem::swap(&mut track.start, &mut track.leap.motion);
            let met = self.meet_all(&due, &mut progress, recovery, seconds)?;
            let state = self.state;
            if met {
                self.motion_into(&state, recovery, &mut track.start);
            }
            if guarded && !met {
                core::mem::swap(&mut track.guards, &mut track.after);
            } else {
                self.guard(&state, &track.start, &mut track.guards);
            }
            let left = progress.remaining.to_array();
            if left.iter().all(|&left| left <= 1e-12 * seconds) {
                self.counts.steps += 1;
                self.strike_balance(&track.start);
                self.finite()?;
                track.known = self.known(recovery);
                return Ok(());
            }
        }
    }

    /// What the motion at present depends on, where that is worth while to know.
    fn known(&self, recovery: f64) -> Option<Known<N>> {
        self.mode.contacts.is_empty().then_some(Known {
            state: self.state,
            holds: self.mode.holds,
            commands: self.mode.commands,
            recovery,
        })
    }

    /// The recovery at which the motion of the next march is known already; zero where it is not.
    pub(crate) fn recalled(&self) -> f64 {
        let known = self.track.as_ref().and_then(|track| track.known);
        let known = known.filter(|known| self.known(known.recovery) == Some(*known));
        known.map_or(0.0, |known| known.recovery)
    }

    /// Finds that motion again: who saved it has it, and has counted it.
    pub(crate) fn recall(&mut self, recovery: f64) {
        let (state, counts) = (self.state, self.counts);
        let motion = self.motion(&state, recovery);
        let mut track = Box::new(Track::new(motion, state));
        self.guard(&state, &motion, &mut track.guards);
        track.known = self.known(recovery);
        self.track = Some(track);
        self.counts = counts;
    }

    /// A time for every leg that is there.
    fn present(&self, seconds: f64) -> Lanes {
        let legs = self.model.legs.len();
        if self.model.is_free() {
            return Lanes::splat(seconds);
        }
        Lanes::new(std::array::from_fn(
            |leg| if leg < legs { seconds } else { 0.0 },
        ))
    }

    /// A piece of the step, up to the next event or the step's end: its length, the events at its end, and whether the
    /// guards there are known.
    #[allow(clippy::type_complexity)]
    fn piece(
        &mut self,
        stepper: Stepper,
        state: &State<Lanes, N>,
        track: &mut Track<N>,
        progress: &mut Progress,
        recovery: f64,
    ) -> Result<(Lanes, [Option<Due>; 4], bool), Halt> {
        let Track {
            start,
            guards: before,
            after,
            leap,
            ..
        } = track;
        let mut h = progress.remaining.min(self.stride);
        self.leap(stepper, state, start, h, recovery, leap);
        while self.shorten(leap, &mut h) {
            progress.count(stepper)?;
            if h.to_array().iter().any(|&h| h > 0.0 && h < 1e-12) {
                let seconds = h.to_array().iter().copied().fold(0.0, f64::max);
                return Err(Halt::Failed(FlowError::TooStiff { seconds }));
            }
            self.leap(stepper, state, start, h, recovery, leap);
        }
        self.lengthen(leap, h, &progress.remaining);
        if !self.model_has_guards() {
            return Ok((h, [None; 4], false));
        }
        self.guard(&leap.end, &leap.motion, after);
        if !after.alarmed(&self.tolerances()) && !dips(before, after, h) {
            return Ok((h, [None; 4], true));
        }
        let due = self.due(leap, state, start, before, after, h, recovery);
        for (island, due) in self.islands().zip(&due) {
            if let Some(due) = due {
                for leg in self.lanes_of(island) {
                    h = h.with_lane(leg, due.at);
                }
            }
        }
        let mut due = due;
        self.leap(stepper, state, start, h, recovery, leap);
        for _ in 0..REFINEMENTS {
            if !self.refine(leap, &mut due, &mut h, recovery) {
                break;
            }
            self.leap(stepper, state, start, h, recovery, leap);
        }
        let correction = self.correction(leap, &due, h);
        if correction.to_array() != [0.0; 4] {
            leap.end = taylor(
                &leap.end,
                &leap.motion.slope,
                correction,
                self.model.is_free(),
            );
            h += correction;
            self.motion_into(&leap.end, recovery, &mut leap.motion);
        }
        Ok((h, due, false))
    }

    /// Whether anything can happen to this robot at all.
    fn model_has_guards(&self) -> bool {
        !self.model.unbounded
    }

    /// Makes the steps of islands shorter whose error is too large; says whether there are any.
    fn shorten(&self, leap: &Leap<N>, h: &mut Lanes) -> bool {
        let zero = Lanes::zero();
        if (leap.error.simd_le(Lanes::splat(self.tolerance)) | h.simd_eq(zero)).all() {
            return false;
        }
        let mut shorter = false;
        for island in self.islands() {
            let leg = island.start;
            let (error, length) = (leap.error.lane(leg), h.lane(leg));
            if length == 0.0 || error <= self.tolerance {
                continue;
            }
            shorter = true;
            let factor = if error.is_finite() {
                (0.9 * fourth_root(self.tolerance / error)).max(0.1)
            } else {
                0.1
            };
            for leg in self.lanes_of(island) {
                *h = h.with_lane(leg, length * factor);
            }
        }
        shorter
    }

    /// Notes for each island how long its next step may be.
    fn lengthen(&mut self, leap: &Leap<N>, h: Lanes, remaining: &Lanes) {
        // Where all go to the end of their time and are far from the tolerance, which is as a rule, none is limited.
        let easy = leap.error.simd_lt(Lanes::splat(0.6 * self.tolerance))
            & h.simd_ge(*remaining)
            & h.simd_gt(Lanes::zero());
        let lanes = self.present(1.0).simd_gt(Lanes::zero());
        if easy.to_bitmask() == lanes.to_bitmask() {
            let errors = leap.error.to_array();
            let legs = errors.iter().take(self.model.legs.len());
            self.estimate = legs.fold(self.estimate, |most, error| most.max(*error));
            self.stride = Lanes::splat(f64::INFINITY);
            return;
        }
        for island in self.islands() {
            let leg = island.start;
            let (error, length) = (leap.error.lane(leg), h.lane(leg));
            if length == 0.0 {
                continue;
            }
            self.estimate = self.estimate.max(error);
            let factor = (0.9 * fourth_root(self.tolerance / error)).clamp(0.2, 4.0);
            // A step that was cut by the end of its time says nothing against longer ones.
            let whole = length >= remaining.lane(leg);
            let next = length * factor;
            let next = if whole {
                next.max(self.stride.lane(leg))
            } else {
                next
            };
            let next = if whole && factor >= 1.0 {
                f64::INFINITY
            } else {
                next
            };
            for leg in self.lanes_of(island) {
                self.stride = self.stride.with_lane(leg, next);
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

    fn guard(&self, state: &State<Lanes, N>, motion: &Motion<Lanes, N>, guards: &mut Guards) {
        guards.renew(&self.scene(0.0), state, motion, &self.bench);
    }

    fn guards(&self, state: &State<Lanes, N>, motion: &Motion<Lanes, N>, recovery: f64) -> Guards {
        Guards::new(&self.scene(recovery), state, motion, &self.bench)
    }

    /// Beyond what guards count as broken.
    fn tolerances(&self) -> [f64; GUARDS] {
        let force = self.model.least_force();
        std::array::from_fn(|place| match kind(place) {
            Guard::Gap => GAP,
            Guard::Force | Guard::Friction => force,
            Guard::Slide => SLIDE,
        })
    }

    /// The motion and the guards at the start, in a mode that has something to it.
    fn start(&mut self, recovery: f64, track: &mut Track<N>) -> Result<(), Halt> {
        let state = self.state;
        if track.known.is_none() || track.known != self.known(recovery) {
            self.motion_into(&state, recovery, &mut track.start);
            self.guard(&state, &track.start, &mut track.guards);
        }
        let guards = &track.guards;
        let tolerances = self.tolerances();
        let near: [f64; GUARDS] = std::array::from_fn(|place| match kind(place) {
            Guard::Gap => -TOUCHING,
            _ => tolerances[place],
        });
        if !guards.alarmed(&near) {
            return Ok(());
        }
        // What was let go at that very instant may be caught again by new commands.
        let resting = |place: usize, leg: usize| {
            let [gap, rate] = [&guards.values, &guards.rates].map(|of| of[place].lane(leg));
            gap < TOUCHING && rate.abs() < AT_REST
        };
        let mut news = false;
        for island in self.islands() {
            let alarmed = |leg: usize| {
                (0..GUARDS).any(|place| match kind(place) {
                    Guard::Gap => resting(place, leg),
                    _ => guards.values[place].lane(leg) < -tolerances[place],
                })
            };
            if island.clone().any(alarmed) {
                news = true;
                self.choose(island, recovery)?;
            }
        }
        if news {
            let state = self.state;
            self.motion_into(&state, recovery, &mut track.start);
            self.guard(&state, &track.start, &mut track.guards);
        }
        Ok(())
    }

    /// Chooses anew what holds of these legs, where nothing has struck.
    fn choose(&mut self, legs: core::ops::Range<usize>, recovery: f64) -> Result<(), FlowError> {
        let mut mode = self.mode;
        let mut instant = core::mem::take(&mut self.instant);
        let scene = self.scene(recovery);
        let settled = instant.settle(&scene, &self.state, &ALL[legs], &mut mode);
        self.instant = instant;
        (self.counts.solver_iterations, self.counts.factorisations) =
            (self.instant.iterations, self.instant.factorisations);
        settled?;
        self.note_events(&mode, self.now_s);
        self.mode = mode;
        Ok(())
    }

    /// Meets the events that are due; says whether there were any.
    fn meet_all(
        &mut self,
        due: &[Option<Due>; 4],
        progress: &mut Progress,
        recovery: f64,
        seconds: f64,
    ) -> Result<bool, Halt> {
        let mut met = false;
        for (i, (island, due)) in self.islands().zip(due).enumerate() {
            let Some(due) = due.filter(|due| due.met) else {
                continue;
            };
            met = true;
            self.counts.events += 1;
            progress.events[i] += 1;
            progress.at_once = if due.at < SHORTEST {
                progress.at_once + 1
            } else {
                0
            };
            if progress.at_once > AT_ONCE_MAX || progress.events[i] > self.events_max {
                return Err(Halt::Crowded);
            }
            let at_s = self.now_s + (seconds - progress.remaining.lane(due.leg));
            self.meet(island, recovery, at_s)?;
        }
        Ok(met)
    }

    /// Impact and change of mode of these legs.
    fn meet(
        &mut self,
        legs: core::ops::Range<usize>,
        recovery: f64,
        at_s: f64,
    ) -> Result<(), FlowError> {
        let (mut state, mut mode) = (self.state, self.mode);
        let mut instant = core::mem::take(&mut self.instant);
        let scene = self.scene(recovery);
        let legs = &ALL[legs];
        let toll = instant.impact(&scene, &mut state, legs);
        let settled = toll.and_then(|toll| {
            instant.settle(&scene, &state, legs, &mut mode)?;
            Ok(toll)
        });
        self.instant = instant;
        (self.counts.solver_iterations, self.counts.factorisations) =
            (self.instant.iterations, self.instant.factorisations);
        let toll = settled?;
        self.note_events(&mode, at_s);
        (self.state, self.mode) = (state, mode);
        self.ledger.impact += toll.impact;
        self.ledger.dissipated += toll.friction;
        self.tally.push(&toll.ground);
        Ok(())
    }

    /// One step, lane by lane of its own length.
    fn leap(
        &mut self,
        stepper: Stepper,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        h: Lanes,
        recovery: f64,
        leap: &mut Leap<N>,
    ) {
        match stepper {
            Stepper::RungeKutta => self.rk4_step(state, start, h, recovery, leap),
            Stepper::Rosenbrock => {
                let step = self.rodas4_step(state, start, h, recovery);
                self.motion_into(&step.end, recovery, &mut leap.motion);
                leap.felt = Tally::new();
                self.feel(&step.end, &leap.motion, h, &mut leap.felt);
                leap.end = step.end;
                (leap.dissipated, leap.actuator) = (step.dissipated, step.actuator);
                leap.error = step.error;
            }
        }
    }

    /// Takes the end of a piece for the present, and writes up what has flowed.
    fn accept(&mut self, leap: &Leap<N>, before: &State<Lanes, N>) {
        let _ = before;
        self.ledger.dissipated += leap.dissipated.sum();
        self.ledger.actuator += leap.actuator.sum();
        self.tally.add(&leap.felt);
        self.state = leap.end;
    }

    /// Balances the books, and notes where feet slide to.
    fn strike_balance(&mut self, end: &Motion<Lanes, N>) {
        let state = self.state;
        let stored = end
            .articulated
            .stored(&self.model, &self.model.side_by_side, &state);
        self.ledger.balance(stored);
        let Some(ground) = &self.model.ground else {
            return;
        };
        let rotation = end.articulated.rotation();
        for contact in &mut self.mode.contacts {
            if let Some(last) = &mut contact.slides {
                let legs = &self.model.side_by_side;
                let site = Site::new(
                    legs,
                    &end.articulated.chain,
                    &state,
                    contact.leg,
                    contact.links,
                );
                *last = direction(&site.footing(ground, state.position, &rotation), *last);
            }
        }
    }

    /// The first event of each island.
    #[allow(clippy::too_many_arguments)]
    fn due(
        &mut self,
        leap: &Leap<N>,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        before: &Guards,
        after: &Guards,
        h: Lanes,
        recovery: f64,
    ) -> [Option<Due>; 4] {
        let tolerances = self.tolerances();
        let middle = midway(state, start, leap, h, self.model.is_free());
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
                if broken && a <= 0.0 {
                    if b >= a && u >= 0.0 {
                        // What it drifted to while it held, on its way out.
                        return None;
                    }
                    // Closed and closing: now. Closed and opening: too long a step to see it open.
                    let now = u < -AT_REST * seconds;
                    let met = now || seconds < SHORTEST;
                    return Some(Due {
                        at: if now { 0.0 } else { 0.1 * seconds },
                        place,
                        leg,
                        low,
                        high,
                        met,
                    });
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
        let mut due = [None; 4];
        for (due, island) in due.iter_mut().zip(self.islands()) {
            *due = island.filter_map(first).reduce(sooner);
        }
        due
    }

    /// Comes nearer to where forces vanish and slides end, which no derivative tells; says whether there is anything to be
    /// tried again.
    fn refine(
        &self,
        leap: &Leap<N>,
        due: &mut [Option<Due>; 4],
        h: &mut Lanes,
        recovery: f64,
    ) -> bool {
        let mut again = false;
        let mut guards = None;
        for (island, due) in self.islands().zip(due) {
            let Some(due) = due else { continue };
            if !due.met || kind(due.place) == Guard::Gap || due.low[1] <= 0.0 {
                continue;
            }
            let guards =
                guards.get_or_insert_with(|| self.guards(&leap.end, &leap.motion, recovery));
            let value = guards.values[due.place].lane(due.leg);
            if value.abs() <= NEAR * self.tolerances()[due.place] {
                continue;
            }
            // False position, which halves the weight of an end that stays (Illinois).
            if value > 0.0 {
                (due.low, due.high[1]) = ([due.at, value], 0.5 * due.high[1]);
            } else {
                (due.high, due.low[1]) = ([due.at, value], 0.5 * due.low[1]);
            }
            let ([a, f], [b, g]) = (due.low, due.high);
            due.at = (a * g - b * f) / (g - f);
            for leg in self.lanes_of(island) {
                *h = h.with_lane(leg, due.at);
            }
            again = true;
        }
        again
    }

    /// How much later than found a gap closes, by its own rate, in each lane.
    fn correction(&mut self, leap: &Leap<N>, due: &[Option<Due>; 4], h: Lanes) -> Lanes {
        let guards = self.guards(&leap.end, &leap.motion, 0.0);
        let mut correction = Lanes::zero();
        for (island, due) in self.islands().zip(due) {
            let Some(due) = due.filter(|due| due.met && kind(due.place) == Guard::Gap) else {
                continue;
            };
            let of = |lanes: &[Lanes; GUARDS]| lanes[due.place].lane(due.leg);
            let later = -of(&guards.values) / of(&guards.rates);
            if later.abs() < 0.5 * h.lane(due.leg) {
                for leg in self.lanes_of(island) {
                    correction = correction.with_lane(leg, later);
                }
            }
        }
        correction
    }

    /// Takes up new commands: motors that have their torque again, motors that have none left.
    pub(crate) fn obey(&mut self) {
        /// A motor that changes its mind more often is on the border of its torque; either answer is right there.
        const CHANGES_MAX: usize = 4;
        let Some(servos) = self.model.servos else {
            return;
        };
        if servos
            .both()
            .iter()
            .all(|servo| servo.torque().is_infinite())
        {
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
                    wanted(
                        &servos.knee,
                        commands.pulley,
                        state.pulley,
                        state.pulley_rate,
                    ),
                ],
            };
            if !self.tire(&effort) {
                return;
            }
        }
    }
}

fn fourth_root(x: f64) -> f64 {
    libm::sqrt(libm::sqrt(x))
}

fn sooner(a: Due, b: Due) -> Due {
    if b.at < a.at { b } else { a }
}

/// Whether a gap may have closed and opened again within a step.
fn dips(before: &Guards, after: &Guards, h: Lanes) -> bool {
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
fn midway<const N: usize>(
    state: &State<Lanes, N>,
    start: &Motion<Lanes, N>,
    leap: &Leap<N>,
    h: Lanes,
    free: bool,
) -> State<Lanes, N> {
    let half = |a: f64, b: f64| 0.5 * (a + b);
    let mut middle = leap.end;
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
    bend.add(-0.125, &leap.motion.slope, free);
    normalised(&middle.along(h, &bend, free), free)
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
