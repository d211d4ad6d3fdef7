//! Going on in time between events that are found to the instant, in steps as long as their error allows.
//!
//! A step that an event cuts short is taken again up to the event, where impulses and a new choice of what holds make a new
//! start. Where legs hang on a trunk that is held they have nothing to do with each other: each then goes its own time, side
//! by side with the others.

mod event_handling;
mod event_location;
mod step_size;

use event_location::{dips, taylor};

use crate::constraints::ActiveConstraints;
use crate::drives::Commands;
use crate::flow::{Flow, FlowError, ImpulseSums};
use crate::guards::{GUARDS, Guard, Guards, kind};
use crate::motion::{Motion, Scene, sliding};
use crate::real::{Lanes, Real};
use crate::site::Site;
use crate::state::State;

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
pub(crate) const ALL: [usize; 4] = [0, 1, 2, 3];

/// Errors of constraints are taken back at this rate per step.
const RECOVERY: f64 = 0.2;

/// Events at one instant, at most.
const AT_ONCE_MAX: u32 = 12;

/// A step that is taken in more pieces than this is too stiff for an explicit method.
const PIECES_MAX: u32 = 160;

/// Pieces that an event takes besides.
const PIECES_PER_EVENT: u32 = 4;

/// The method of the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stepper {
    RungeKutta,
    Rosenbrock,
}

/// A step as it was made.
#[derive(Debug, Clone)]
pub(crate) struct TrialStep<const N: usize> {
    pub(crate) end: State<Lanes, N>,
    /// The motion at its end, in the same mode.
    pub(crate) motion: Box<Motion<Lanes, N>>,
    /// Work that friction took and that motors gave, by leg \[J\].
    pub(crate) dissipated: Lanes,
    pub(crate) actuator: Lanes,
    /// What was felt.
    pub(crate) forces: ImpulseSums,
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
    trial: TrialStep<N>,
    /// What the start is known for.
    known: Option<Known<N>>,
}

/// All that a motion depends on while no foot stands.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known<const N: usize> {
    state: State<Lanes, N>,
    active: ActiveConstraints<Lanes>,
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
            trial: TrialStep {
                end,
                motion: Box::new(motion),
                dissipated: zero,
                actuator: zero,
                forces: ImpulseSums::new(),
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
        let events = self.events.iter().sum::<u32>();
        if self.pieces > PIECES_MAX + PIECES_PER_EVENT * events && stepper == Stepper::RungeKutta {
            return Err(Halt::Stiff);
        }
        Ok(())
    }
}

impl<const N: usize> Flow<N> {
    /// Moves on by `seconds`.
    pub(crate) fn event_driven(&mut self, stepper: Stepper, seconds: f64) -> Result<(), Halt> {
        let state = self.state;
        let mut track = self.track.take().unwrap_or_else(|| {
            // Something to begin with; it takes no part, so it does not count.
            let counts = self.counts;
            let motion = self.motion(&state, 0.0);
            self.counts = counts;
            Box::new(Track::new(motion, state))
        });
        let marched = self.integrate_on(stepper, seconds, &mut track);
        self.track = Some(track);
        marched
    }

    fn integrate_on(
        &mut self,
        stepper: Stepper,
        seconds: f64,
        track: &mut Track<N>,
    ) -> Result<(), Halt> {
        let recovery = RECOVERY / seconds;
        self.follow_command();
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
            let (h, next_event, guarded) =
                self.piece(stepper, &state, track, &mut progress, recovery)?;
            self.accept(&track.trial, &state);
            progress.remaining -= h;
            core::mem::swap(&mut track.start, &mut track.trial.motion);
            let met = self.handle_all(&next_event, &mut progress, recovery, seconds)?;
            let state = self.state;
            if met {
                if self.follow_command() {
                    for island in self.islands() {
                        self.choose(island, recovery)?;
                    }
                }
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
            active: self.mode.active,
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
            trial,
            ..
        } = track;
        let mut h = progress.remaining.min(self.stride);
        self.trial(stepper, state, start, h, recovery, trial);
        while self.shorten(trial, &mut h) {
            progress.count(stepper)?;
            if h.to_array().iter().any(|&h| h > 0.0 && h < 1e-12) {
                let seconds = h.to_array().iter().copied().fold(0.0, f64::max);
                return Err(Halt::Failed(FlowError::TooStiff { seconds }));
            }
            self.trial(stepper, state, start, h, recovery, trial);
        }
        self.lengthen(trial, h, &progress.remaining);
        if !self.model_has_guards() {
            return Ok((h, [None; 4], false));
        }
        self.guard(&trial.end, &trial.motion, after);
        if !after.alarmed(&self.tolerances()) && !dips(before, after, h) {
            return Ok((h, [None; 4], true));
        }
        let next_event = self.next_event(trial, state, start, before, after, h, recovery);
        for (island, next_event) in self.islands().zip(&next_event) {
            if let Some(next_event) = next_event {
                for leg in self.lanes_of(island) {
                    h = h.with_lane(leg, next_event.at);
                }
            }
        }
        let mut next_event = next_event;
        self.trial(stepper, state, start, h, recovery, trial);
        for _ in 0..REFINEMENTS {
            if !self.refine(trial, &mut next_event, &mut h, recovery) {
                break;
            }
            self.trial(stepper, state, start, h, recovery, trial);
        }
        let correction = self.correction(trial, &next_event, h);
        if correction.to_array() != [0.0; 4] {
            trial.end = taylor(
                &trial.end,
                &trial.motion.slope,
                correction,
                self.model.is_free(),
            );
            h += correction;
            self.motion_into(&trial.end, recovery, &mut trial.motion);
        }
        Ok((h, next_event, false))
    }

    /// Whether anything can happen to this robot at all.
    fn model_has_guards(&self) -> bool {
        !self.model.unbounded
    }

    /// The lanes of an island: all of them where the robot moves as a whole.
    fn lanes_of(&self, island: core::ops::Range<usize>) -> core::ops::Range<usize> {
        if self.model.is_free() { 0..4 } else { island }
    }

    pub(crate) fn scene(&self, recovery: f64) -> Scene<'_, Lanes, N> {
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

    /// One step, lane by lane of its own length.
    fn trial(
        &mut self,
        stepper: Stepper,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        h: Lanes,
        recovery: f64,
        trial: &mut TrialStep<N>,
    ) {
        match stepper {
            Stepper::RungeKutta => self.rk4_step(state, start, h, recovery, trial),
            Stepper::Rosenbrock => {
                let step = self.rodas4_step(state, start, h, recovery);
                self.feel_ends([state, &step.end], h, recovery, trial);
                trial.end = step.end;
                (trial.dissipated, trial.actuator) = (step.dissipated, step.actuator);
                trial.error = step.error;
            }
        }
    }

    /// Mean forces, and the motion at the end. The ground's are those of the trapezoidal rule: forces that end at zero, a little
    /// past it by the error of the event's time, have pushed until then.
    fn feel_ends(
        &mut self,
        [start, end]: [&State<Lanes, N>; 2],
        h: Lanes,
        recovery: f64,
        trial: &mut TrialStep<N>,
    ) {
        let half = h * Lanes::splat(0.5);
        trial.forces = ImpulseSums::new();
        if !self.mode.contacts.is_empty() {
            self.motion_into(start, recovery, &mut trial.motion);
            self.feel_ground(start, &trial.motion, half, &mut trial.forces);
        }
        self.motion_into(end, recovery, &mut trial.motion);
        self.feel_ground(end, &trial.motion, half, &mut trial.forces);
        self.feel_motors(&trial.motion.forces, h, &mut trial.forces);
    }

    /// Takes the end of a piece for the present, and writes up what has flowed.
    fn accept(&mut self, trial: &TrialStep<N>, before: &State<Lanes, N>) {
        let _ = before;
        self.ledger.dissipated += trial.dissipated.sum();
        self.ledger.actuator += trial.actuator.sum();
        self.impulse_sums.add(&trial.forces);
        self.state = trial.end;
    }

    /// Balances the books, and notes where feet slide to.
    fn strike_balance(&mut self, end: &Motion<Lanes, N>) {
        let state = self.state;
        let stored = end
            .articulated
            .stored(&self.model, &self.model.side_by_side, &state);
        self.ledger.close_step(stored);
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
                *last = sliding(&site.footing(ground, state.position, &rotation), *last);
            }
        }
    }
}
