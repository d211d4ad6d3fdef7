//! Event-driven integration: steps under error control between events, which are located by root
//! finding.
//!
//! A step with an event is repeated up to the event. Impulses and a new choice of active
//! constraints restart the integration there. Legs on a fixed trunk are independent of each other:
//! each has its own time, computed side by side.

mod buffers;
mod event_handling;
mod event_location;
mod interpolation;
mod reactivation;
mod step_size;

use buffers::{Buffers, motion_key};
use interpolation::{dips, taylor};

use super::impulse_sums::ImpulseSums;
use super::right_hand_side::RightHandSide;
use super::rk4::rk4_step;
use super::rodas4::Rodas4;
use super::run_state::RunState;
use super::step_error::StepError;
use super::substep::{Substep, TrialStep};
use crate::constraints::contact_forces::sliding;
use crate::constraints::events::Instant;
use crate::constraints::guards::{GUARDS, Guard, kind};
use crate::constraints::motion::Motion;
use crate::model::Model;
use crate::model::real::{Lanes, Real};
use crate::model::site::Site;

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
    stepper: Stepper,
    /// Length of the step \[s\], and decay rate of constraint errors in it \[1/s\].
    seconds: f64,
    recovery: f64,
    remaining: Lanes,
    events: [u32; 4],
    at_once: u32,
    substeps: u32,
}

impl Progress {
    /// Counts a substep, accepted or not.
    fn count(&mut self) -> Result<(), Halt> {
        self.substeps += 1;
        let events = self.events.iter().sum::<u32>();
        if self.substeps > SUBSTEPS_MAX + SUBSTEPS_PER_EVENT * events
            && self.stepper == Stepper::RungeKutta
        {
            return Err(Halt::Stiff);
        }
        Ok(())
    }
}

/// Integrator with event location, with its workspace.
#[derive(Debug, Clone)]
pub(crate) struct EventDriven<const N: usize> {
    /// Maximum error of a step \[m\].
    tolerance: f64,
    /// Maximum number of events of an island per step.
    events_max: u32,
    /// Proposed step size of each island \[s\].
    pub(crate) step_size: Lanes,
    rhs: RightHandSide<N>,
    instant: Instant<N>,
    rodas4: Rodas4<N>,
    /// None before the first step, and while a step is in progress.
    buffers: Option<Box<Buffers<N>>>,
}

impl<const N: usize> EventDriven<N> {
    /// Builds an integrator for this maximum error of a step \[m\] and this number of events of an
    /// island per step.
    pub(crate) fn new(tolerance: f64, events_max: u32) -> Self {
        Self {
            tolerance,
            events_max,
            step_size: Lanes::splat(f64::INFINITY),
            rhs: RightHandSide::default(),
            instant: Instant::default(),
            rodas4: Rodas4::default(),
            buffers: None,
        }
    }

    /// Advances by `seconds`.
    pub(crate) fn advance(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        stepper: Stepper,
        seconds: f64,
    ) -> Result<(), Halt> {
        let buffers = self.buffers.take();
        let mut buffers = buffers.unwrap_or_else(|| Box::new(Buffers::blank(run.state)));
        let mut progress = Progress {
            stepper,
            seconds,
            recovery: RECOVERY / seconds,
            remaining: model.leg_times(seconds),
            events: [0; 4],
            at_once: 0,
            substeps: 0,
        };
        let done = self.integrate_substeps(model, run, &mut progress, &mut buffers);
        self.buffers = Some(buffers);
        done
    }

    fn integrate_substeps(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        progress: &mut Progress,
        buffers: &mut Buffers<N>,
    ) -> Result<(), Halt> {
        let (seconds, recovery) = (progress.seconds, progress.recovery);
        run.set_load_at(model, Lanes::zero());
        self.rhs.follow_command(model, run);
        self.start(model, run, recovery, buffers)?;
        buffers.key = None;
        loop {
            progress.count()?;
            let (h, events, guarded) = self.substep(model, run, buffers, progress)?;
            accept(run, &buffers.trial);
            progress.remaining -= h;
            core::mem::swap(&mut buffers.start, &mut buffers.trial.motion);
            let handled = self.handle_events(model, run, &events, progress)?;
            let start = &mut buffers.start;
            if handled {
                if self.rhs.follow_command(model, run) {
                    for island in model.islands() {
                        let left = progress.remaining.lane(island.start);
                        let at_s = run.now_s + (seconds - left);
                        self.select_modes(model, run, island, recovery, at_s)?;
                    }
                }
                let state = run.state;
                self.rhs.motion_into(model, run, &state, recovery, start);
            }
            if guarded && !handled {
                core::mem::swap(&mut buffers.guards, &mut buffers.after);
            } else {
                let state = run.state;
                self.rhs
                    .update_guards(model, run, &state, start, &mut buffers.guards);
            }
            let left = progress.remaining.to_array();
            if left.iter().all(|&left| left <= 1e-12 * seconds) {
                run.counts.steps += 1;
                close_balance(model, run, start);
                run.check_finite(model)?;
                buffers.key = motion_key(run, recovery);
                return Ok(());
            }
        }
    }

    /// Returns the recovery rate for which the motion at the start of the next step is cached; zero
    /// without a cached motion.
    pub(crate) fn cached_recovery(&self, run: &RunState<N>) -> f64 {
        let key = self.buffers.as_ref().and_then(|buffers| buffers.key);
        let key = key.filter(|key| motion_key(run, key.recovery) == Some(*key));
        key.map_or(0.0, |key| key.recovery)
    }

    /// Recomputes that motion after restoring, or drops it without a rate; its evaluation was
    /// counted before saving.
    pub(crate) fn restore_cache(&mut self, model: &Model<N>, run: &mut RunState<N>, recovery: f64) {
        self.buffers = (recovery > 0.0).then(|| {
            let (state, counts) = (run.state, run.counts);
            let mut buffers = Box::new(Buffers::blank(state));
            let Buffers { start, guards, .. } = &mut *buffers;
            self.rhs.motion_into(model, run, &state, recovery, start);
            self.rhs.update_guards(model, run, &state, start, guards);
            buffers.key = motion_key(run, recovery);
            run.counts = counts;
            buffers
        });
    }

    /// Integrates a substep up to the next event or the end of the step. Returns its length, the
    /// events at its end, and whether the guards there are already computed.
    fn substep(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        buffers: &mut Buffers<N>,
        progress: &mut Progress,
    ) -> Result<(Lanes, [Option<LocatedEvent>; 4], bool), Halt> {
        let Buffers {
            start: motion,
            guards: before,
            after,
            trial,
            ..
        } = buffers;
        let (state, stepper) = (run.state, progress.stepper);
        let mut substep = Substep {
            start: &state,
            motion,
            h: progress.remaining.min(self.step_size),
            elapsed: model.leg_times(progress.seconds) - progress.remaining,
            recovery: progress.recovery,
        };
        self.trial(model, run, stepper, &substep, trial);
        while self.shorten(model, trial, &mut substep.h) {
            progress.count()?;
            let lengths = substep.h.to_array();
            if lengths.iter().any(|&h| h > 0.0 && h < 1e-12) {
                let seconds = lengths.iter().copied().fold(0.0, f64::max);
                return Err(Halt::Failed(StepError::TooStiff { seconds }));
            }
            self.trial(model, run, stepper, &substep, trial);
        }
        self.propose_step_size(model, trial, substep.h, &progress.remaining);
        if model.without_stops {
            return Ok((substep.h, [None; 4], false));
        }
        self.rhs
            .update_guards(model, run, &trial.end, &trial.motion, after);
        if !after.any_below(&tolerances(model)) && !dips(before, after, substep.h) {
            return Ok((substep.h, [None; 4], true));
        }
        let mut events = self.locate_events(model, run, &substep, trial, [before, after]);
        for (island, event) in model.islands().zip(&events) {
            if let Some(event) = event {
                for leg in model.lanes_of(island) {
                    substep.h = substep.h.with_lane(leg, event.at);
                }
            }
        }
        self.trial(model, run, stepper, &substep, trial);
        for _ in 0..REFINEMENTS {
            if !self.refine(model, run, trial, &mut events, &mut substep.h) {
                break;
            }
            self.trial(model, run, stepper, &substep, trial);
        }
        let correction = self.correction(model, run, trial, &events, substep.h);
        let mut h = substep.h;
        if correction.to_array() != [0.0; 4] {
            let slope = &trial.motion.slope;
            trial.end = taylor(&trial.end, slope, correction, model.is_free());
            h += correction;
            run.set_load_at(model, substep.elapsed + h);
            self.rhs
                .motion_into(model, run, &trial.end, progress.recovery, &mut trial.motion);
        }
        Ok((h, events, false))
    }

    /// Computes a trial step; its length may differ from lane to lane.
    fn trial(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        stepper: Stepper,
        substep: &Substep<'_, N>,
        trial: &mut TrialStep<N>,
    ) {
        match stepper {
            Stepper::RungeKutta => rk4_step(&mut self.rhs, model, run, substep, trial),
            Stepper::Rosenbrock => {
                let step = self.rodas4.step(model, run, substep);
                trial.end = step.end;
                self.set_trial_impulses(model, run, substep, trial);
                (trial.dissipated, trial.actuator) = (step.dissipated, step.actuator);
                trial.external = step.external;
                trial.error = step.error;
            }
        }
    }

    /// Sets the impulses of the step and the motion at its end. Ground impulses follow from the
    /// trapezoidal rule: a force that ends at zero, or slightly beyond by the error of the event
    /// time, has acted until then.
    fn set_trial_impulses(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        substep: &Substep<'_, N>,
        trial: &mut TrialStep<N>,
    ) {
        let (start, h, recovery) = (substep.start, substep.h, substep.recovery);
        let half = h * Lanes::splat(0.5);
        let TrialStep {
            end,
            motion,
            impulses,
            ..
        } = trial;
        let rhs = &mut self.rhs;
        *impulses = ImpulseSums::new();
        if !run.mode.contacts.is_empty() {
            run.set_load_at(model, substep.elapsed);
            rhs.motion_into(model, run, start, recovery, motion);
            rhs.add_ground_impulses(model, run, start, motion, half, impulses);
        }
        run.set_load_at(model, substep.elapsed + h);
        rhs.motion_into(model, run, end, recovery, motion);
        rhs.add_ground_impulses(model, run, end, motion, half, impulses);
        impulses.add_drives(model, &motion.forces, h);
    }
}

/// Returns the tolerances of the guards.
fn tolerances<const N: usize>(model: &Model<N>) -> [f64; GUARDS] {
    let force = model.least_force();
    std::array::from_fn(|index| match kind(index) {
        Guard::Gap => GAP,
        Guard::Force | Guard::Friction => force,
        Guard::TangentialImpulse => SLIDE,
    })
}

/// Accepts the end of a substep and enters its energies and impulses.
fn accept<const N: usize>(run: &mut RunState<N>, trial: &TrialStep<N>) {
    run.ledger.dissipated += trial.dissipated.sum();
    run.ledger.actuator += trial.actuator.sum();
    run.ledger.external += trial.external.sum();
    run.impulse_sums.add(&trial.impulses);
    run.state = trial.end;
}

/// Closes the energy balance of the step and stores the directions of sliding feet.
fn close_balance<const N: usize>(model: &Model<N>, run: &mut RunState<N>, end: &Motion<Lanes, N>) {
    let state = &run.state;
    let stored = end.articulated.stored(model, &model.side_by_side, state);
    run.ledger.close_step(stored);
    let Some(ground) = &model.ground else {
        return;
    };
    let rotation = end.articulated.rotation();
    let chain = &end.articulated.chain;
    for contact in &mut run.mode.contacts {
        if let Some(last) = &mut contact.slides {
            let (leg, links) = (contact.leg, contact.links);
            let site = Site::new(&model.side_by_side, chain, state, leg, links);
            *last = sliding(&site.footing(ground, state.position, &rotation), *last);
        }
    }
}
