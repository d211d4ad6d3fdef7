//! Event-driven integration: steps under error control between events, which are located by root
//! finding.
//!
//! A step with an event is repeated up to the event. Impulses and a new choice of active
//! constraints restart the integration there. Legs on a fixed trunk are independent of each other:
//! each has its own time, computed side by side.

mod event_handling;
mod event_location;
mod step_size;

use event_location::{dips, taylor};

use crate::constraints::guards::{GUARDS, Guard, Guards, kind};
use crate::constraints::motion::{Motion, sliding};
use crate::integrators::flow::Flow;
use crate::integrators::impulse_sums::ImpulseSums;
use crate::integrators::step_error::StepError;
use crate::model::drives::Commands;
use crate::model::leg_constraints::ActiveConstraints;
use crate::model::real::{Lanes, Real};
use crate::model::site::Site;
use crate::model::state::State;

/// Tolerance of gaps \[m\] and of slide speeds \[m/s\], beyond which a guard is violated.
const GAP: f64 = 1e-10;
const SLIDE: f64 = 2e-7;

/// Steps are not shortened below this to observe a gap opening \[s\].
const SHORTEST: f64 = 1e-9;

/// Maximum iterations for the end of a force or a slide, and their tolerance as a share of the
/// guard's tolerance.
const REFINEMENTS: u32 = 6;
const REFINED: f64 = 0.1;

/// Gap \[m\] and rate \[m/s\] below which a gap may close at the start of a step.
const TOUCHING: f64 = 1e-8;
const AT_REST: f64 = 1e-7;

/// Indices of the legs.
pub(crate) const ALL: [usize; 4] = [0, 1, 2, 3];

/// Decay of constraint errors per step.
const RECOVERY: f64 = 0.2;

/// Maximum number of events at one instant.
const AT_ONCE_MAX: u32 = 12;

/// Maximum number of substeps; a step that needs more is too stiff for an explicit method.
const SUBSTEPS_MAX: u32 = 160;

/// Additional substeps per event.
const SUBSTEPS_PER_EVENT: u32 = 4;

/// Integration method of the substeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stepper {
    RungeKutta,
    Rosenbrock,
}

/// Result of a trial step.
#[derive(Debug, Clone)]
pub(crate) struct TrialStep<const N: usize> {
    pub(crate) end: State<Lanes, N>,
    /// The motion at `end`, in the same mode.
    pub(crate) motion: Box<Motion<Lanes, N>>,
    /// Work dissipated by friction and work of the motors, by leg \[J\].
    pub(crate) dissipated: Lanes,
    pub(crate) actuator: Lanes,
    /// Impulses of drives and ground during the step.
    pub(crate) impulses: ImpulseSums,
    /// Error estimate of the foot position \[m\].
    pub(crate) error: Lanes,
}

/// Buffers of the event-driven integrator: large values that are moved instead of copied.
#[derive(Debug, Clone)]
pub(crate) struct Buffers<const N: usize> {
    start: Box<Motion<Lanes, N>>,
    /// Guards at the start and at the end of a substep.
    guards: Guards,
    after: Guards,
    trial: TrialStep<N>,
    /// Arguments for which `start` is valid.
    key: Option<MotionKey<N>>,
}

/// Arguments of a motion without contacts, as a cache key.
#[derive(Debug, Clone, Copy, PartialEq)]
struct MotionKey<const N: usize> {
    state: State<Lanes, N>,
    active: ActiveConstraints<Lanes>,
    commands: Commands<Lanes>,
    recovery: f64,
}

impl<const N: usize> Buffers<N> {
    pub(crate) fn new(motion: Motion<Lanes, N>, end: State<Lanes, N>) -> Self {
        let zero = Lanes::zero();
        Self {
            start: Box::new(motion),
            guards: Guards::inactive(),
            after: Guards::inactive(),
            trial: TrialStep {
                end,
                motion: Box::new(motion),
                dissipated: zero,
                actuator: zero,
                impulses: ImpulseSums::new(),
                error: zero,
            },
            key: None,
        }
    }
}

/// Reason for which the integrator stopped before the end of the step.
pub(crate) enum Halt {
    /// Too many substeps.
    Stiff,
    /// Too many events.
    TooManyEvents,
    Failed(StepError),
}

impl<E: Into<StepError>> From<E> for Halt {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// The next event of an island: time from the start of the substep \[s\], guard and leg.
#[derive(Clone, Copy)]
struct LocatedEvent {
    at: f64,
    index: usize,
    leg: usize,
    /// Bracket of the root: times \[s\] and guard values.
    low: [f64; 2],
    high: [f64; 2],
    /// False where only the step is shortened: a gap closed from the start does not determine when
    /// it closes again, only that the step was too long to resolve it.
    is_event: bool,
}

/// Progress of the integrator within a step.
struct Progress {
    remaining: Lanes,
    events: [u32; 4],
    at_once: u32,
    substeps: u32,
}

impl Progress {
    /// Counts a substep, accepted or not.
    fn count(&mut self, stepper: Stepper) -> Result<(), Halt> {
        self.substeps += 1;
        let events = self.events.iter().sum::<u32>();
        if self.substeps > SUBSTEPS_MAX + SUBSTEPS_PER_EVENT * events
            && stepper == Stepper::RungeKutta
        {
            return Err(Halt::Stiff);
        }
        Ok(())
    }
}

impl<const N: usize> Flow<N> {
    /// Advances by `seconds`.
    pub(crate) fn event_driven(&mut self, stepper: Stepper, seconds: f64) -> Result<(), Halt> {
        let state = self.run.state;
        let mut buffers = self.buffers.take().unwrap_or_else(|| {
            // Initial content of the buffers; not used, therefore not counted.
            let counts = self.run.counts;
            let motion = self.rhs.motion(&self.model, &mut self.run, &state, 0.0);
            self.run.counts = counts;
            Box::new(Buffers::new(motion, state))
        });
        let done = self.integrate_substeps(stepper, seconds, &mut buffers);
        self.buffers = Some(buffers);
        done
    }

    fn integrate_substeps(
        &mut self,
        stepper: Stepper,
        seconds: f64,
        buffers: &mut Buffers<N>,
    ) -> Result<(), Halt> {
        let recovery = RECOVERY / seconds;
        self.rhs.follow_command(&self.model, &mut self.run);
        let mut progress = Progress {
            remaining: self.model.leg_times(seconds),
            events: [0; 4],
            at_once: 0,
            substeps: 0,
        };
        self.start(recovery, buffers)?;
        buffers.key = None;
        loop {
            let state = self.run.state;
            progress.count(stepper)?;
            let (h, events, guarded) =
                self.substep(stepper, &state, buffers, &mut progress, recovery)?;
            self.accept(&buffers.trial);
            progress.remaining -= h;
            core::mem::swap(&mut buffers.start, &mut buffers.trial.motion);
            let handled = self.handle_events(&events, &mut progress, recovery, seconds)?;
            let state = self.run.state;
            if handled {
                if self.rhs.follow_command(&self.model, &mut self.run) {
                    for island in self.model.islands() {
                        self.select_modes(island, recovery)?;
                    }
                }
                self.rhs.motion_into(
                    &self.model,
                    &mut self.run,
                    &state,
                    recovery,
                    &mut buffers.start,
                );
            }
            if guarded && !handled {
                core::mem::swap(&mut buffers.guards, &mut buffers.after);
            } else {
                self.rhs.renew_guards(
                    &self.model,
                    &self.run,
                    &state,
                    &buffers.start,
                    &mut buffers.guards,
                );
            }
            let left = progress.remaining.to_array();
            if left.iter().all(|&left| left <= 1e-12 * seconds) {
                self.run.counts.steps += 1;
                self.close_balance(&buffers.start);
                self.run.check_finite(&self.model)?;
                buffers.key = self.motion_key(recovery);
                return Ok(());
            }
        }
    }

    /// Returns the cache key of the present motion; none with contacts, where caching is not
    /// worthwhile.
    fn motion_key(&self, recovery: f64) -> Option<MotionKey<N>> {
        self.run.mode.contacts.is_empty().then_some(MotionKey {
            state: self.run.state,
            active: self.run.mode.active,
            commands: self.run.mode.commands,
            recovery,
        })
    }

    /// Returns the recovery rate for which the motion at the start of the next step is cached; zero
    /// without a cached motion.
    pub(crate) fn cached_recovery(&self) -> f64 {
        let key = self.buffers.as_ref().and_then(|buffers| buffers.key);
        let key = key.filter(|key| self.motion_key(key.recovery) == Some(*key));
        key.map_or(0.0, |key| key.recovery)
    }

    /// Recomputes that motion after restoring; its evaluation was counted before saving.
    pub(crate) fn restore_cache(&mut self, recovery: f64) {
        let (state, counts) = (self.run.state, self.run.counts);
        let motion = self
            .rhs
            .motion(&self.model, &mut self.run, &state, recovery);
        let mut buffers = Box::new(Buffers::new(motion, state));
        self.rhs
            .renew_guards(&self.model, &self.run, &state, &motion, &mut buffers.guards);
        buffers.key = self.motion_key(recovery);
        self.buffers = Some(buffers);
        self.run.counts = counts;
    }

    /// Integrates a substep up to the next event or the end of the step. Returns its length, the
    /// events at its end, and whether the guards there are already computed.
    fn substep(
        &mut self,
        stepper: Stepper,
        state: &State<Lanes, N>,
        buffers: &mut Buffers<N>,
        progress: &mut Progress,
        recovery: f64,
    ) -> Result<(Lanes, [Option<LocatedEvent>; 4], bool), Halt> {
        let Buffers {
            start,
            guards: before,
            after,
            trial,
            ..
        } = buffers;
        let mut h = progress.remaining.min(self.step_size);
        self.trial(stepper, state, start, h, recovery, trial);
        while self.shorten(trial, &mut h) {
            progress.count(stepper)?;
            if h.to_array().iter().any(|&h| h > 0.0 && h < 1e-12) {
                let seconds = h.to_array().iter().copied().fold(0.0, f64::max);
                return Err(Halt::Failed(StepError::TooStiff { seconds }));
            }
            self.trial(stepper, state, start, h, recovery, trial);
        }
        self.propose_step_size(trial, h, &progress.remaining);
        if !self.model_has_guards() {
            return Ok((h, [None; 4], false));
        }
        self.rhs
            .renew_guards(&self.model, &self.run, &trial.end, &trial.motion, after);
        if !after.any_below(&self.tolerances()) && !dips(before, after, h) {
            return Ok((h, [None; 4], true));
        }
        let events = self.locate_events(trial, state, start, before, after, h, recovery);
        for (island, event) in self.model.islands().zip(&events) {
            if let Some(event) = event {
                for leg in self.model.lanes_of(island) {
                    h = h.with_lane(leg, event.at);
                }
            }
        }
        let mut events = events;
        self.trial(stepper, state, start, h, recovery, trial);
        for _ in 0..REFINEMENTS {
            if !self.refine(trial, &mut events, &mut h) {
                break;
            }
            self.trial(stepper, state, start, h, recovery, trial);
        }
        let correction = self.correction(trial, &events, h);
        if correction.to_array() != [0.0; 4] {
            trial.end = taylor(
                &trial.end,
                &trial.motion.slope,
                correction,
                self.model.is_free(),
            );
            h += correction;
            self.rhs.motion_into(
                &self.model,
                &mut self.run,
                &trial.end,
                recovery,
                &mut trial.motion,
            );
        }
        Ok((h, events, false))
    }

    /// Returns whether the model has guards.
    fn model_has_guards(&self) -> bool {
        !self.model.without_stops
    }

    /// Returns the tolerances of the guards.
    fn tolerances(&self) -> [f64; GUARDS] {
        let force = self.model.least_force();
        std::array::from_fn(|index| match kind(index) {
            Guard::Gap => GAP,
            Guard::Force | Guard::Friction => force,
            Guard::TangentialImpulse => SLIDE,
        })
    }

    /// Computes a trial step; its length may differ from lane to lane.
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
                self.set_trial_impulses([state, &step.end], h, recovery, trial);
                trial.end = step.end;
                (trial.dissipated, trial.actuator) = (step.dissipated, step.actuator);
                trial.error = step.error;
            }
        }
    }

    /// Sets the impulses of the step and the motion at its end. Ground impulses follow from the
    /// trapezoidal rule: a force that ends at zero, or slightly beyond by the error of the event
    /// time, has acted until then.
    fn set_trial_impulses(
        &mut self,
        [start, end]: [&State<Lanes, N>; 2],
        h: Lanes,
        recovery: f64,
        trial: &mut TrialStep<N>,
    ) {
        let half = h * Lanes::splat(0.5);
        trial.impulses = ImpulseSums::new();
        if !self.run.mode.contacts.is_empty() {
            self.rhs.motion_into(
                &self.model,
                &mut self.run,
                start,
                recovery,
                &mut trial.motion,
            );
            self.rhs.add_ground_impulses(
                &self.model,
                &self.run,
                start,
                &trial.motion,
                half,
                &mut trial.impulses,
            );
        }
        self.rhs
            .motion_into(&self.model, &mut self.run, end, recovery, &mut trial.motion);
        self.rhs.add_ground_impulses(
            &self.model,
            &self.run,
            end,
            &trial.motion,
            half,
            &mut trial.impulses,
        );
        trial
            .impulses
            .add_drives(&self.model, &trial.motion.forces, h);
    }

    /// Accepts the end of a substep and enters its energies and impulses.
    fn accept(&mut self, trial: &TrialStep<N>) {
        self.run.ledger.dissipated += trial.dissipated.sum();
        self.run.ledger.actuator += trial.actuator.sum();
        self.run.impulse_sums.add(&trial.impulses);
        self.run.state = trial.end;
    }

    /// Closes the energy balance of the step and stores the directions of sliding feet.
    fn close_balance(&mut self, end: &Motion<Lanes, N>) {
        let state = self.run.state;
        let stored = end
            .articulated
            .stored(&self.model, &self.model.side_by_side, &state);
        self.run.ledger.close_step(stored);
        let Some(ground) = &self.model.ground else {
            return;
        };
        let rotation = end.articulated.rotation();
        for contact in &mut self.run.mode.contacts {
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
