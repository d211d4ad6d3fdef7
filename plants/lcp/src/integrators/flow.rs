//! Time integration of the plant.

use twinrig_legged::{Ledger, Stored};
use twinrig_runtime::WorkCounts;

use super::euler::FixedStep;
use super::event_driven::{Buffers, Halt, Stepper};
use super::impulse_sums::ImpulseSums;
use super::moreau::{LastImpulses, Moreau};
use super::right_hand_side::RightHandSide;
use super::run_state::RunState;
use super::step_error::StepError;
use crate::constraints::events::Instant;
use crate::constraints::mode::Mode;
use crate::model::Model;
use crate::model::real::Lanes;
use crate::model::state::State;
use crate::options::Method;

/// Events of an island per step above which they accumulate (chattering): for the default method,
/// and for the method for stiff robots.
const EVENTS_PER_STEP_MAX: u32 = 8;
const EVENTS_PER_STEP_MAX_STIFF: u32 = 24;

/// Initial and maximum number of steps of a fallback. An attempt without it costs about as much as
/// ten of its steps.
const BACKOFF: u32 = 25;
const BACKOFF_MAX: u32 = 200;

/// Maximum number of halvings of a fallback step.
const HALVINGS_MAX: u32 = 7;

/// Constraint violation above which no forces can close a constraint \[m\].
const VIOLATION_MAX: f64 = 1e-3;

/// All values that a step changes, saved without heap allocation.
pub(crate) struct Checkpoint<const N: usize> {
    state: State<Lanes, N>,
    mode: Mode,
    pub(crate) ledger: Ledger,
    pub(crate) impulse_sums: ImpulseSums,
    step_size: Lanes,
    last_impulses: LastImpulses,
    fallback_steps: u32,
    backoff: u32,
    steps_since_fallback: u32,
    counts: WorkCounts,
    energy_gain: f64,
    events: usize,
}

/// Model, state and integrators of the plant.
#[derive(Debug, Clone)]
pub(crate) struct Flow<const N: usize> {
    pub(crate) model: Model<N>,
    pub(crate) run: RunState<N>,
    /// Sums before the last run, and its duration \[s\].
    pub(crate) impulse_sums_before: ImpulseSums,
    pub(crate) run_seconds: f64,
    /// Proposed step size of each island \[s\].
    pub(crate) step_size: Lanes,
    pub(crate) method: Method,
    /// Maximum error of a step \[m\].
    pub(crate) tolerance: f64,
    pub(crate) rhs: RightHandSide<N>,
    pub(crate) instant: Instant<N>,
    pub(crate) moreau: Moreau<N>,
    pub(crate) fixed_step: FixedStep<N>,
    /// Remaining steps by Moreau's rule after event accumulation, and length of the next fallback.
    pub(crate) fallback_steps: u32,
    pub(crate) backoff: u32,
    /// Steps since the last fallback.
    pub(crate) steps_since_fallback: u32,
    /// Maximum number of events of an island per step.
    pub(crate) events_max: u32,
    pub(crate) rodas4: crate::integrators::rodas4::Memory<N>,
    /// Buffers of the event-driven integrator; none while it runs.
    pub(crate) buffers: Option<Box<Buffers<N>>>,
    /// Accumulated numerical energy gain \[J\].
    pub(crate) energy_gain: f64,
    /// Whether the state was taken over and the active constraints are still to be found.
    pub(crate) modes_pending: bool,
}

impl<const N: usize> Flow<N> {
    pub(crate) fn new(
        model: Model<N>,
        state: State<Lanes, N>,
        method: Method,
        tolerance: f64,
    ) -> Self {
        Self {
            run: RunState::new(&model, state),
            model,
            impulse_sums_before: ImpulseSums::new(),
            run_seconds: 0.0,
            step_size: Lanes::splat(f64::INFINITY),
            method,
            tolerance,
            rhs: RightHandSide::default(),
            instant: Instant::default(),
            moreau: Moreau::default(),
            fixed_step: FixedStep::default(),
            fallback_steps: 0,
            backoff: BACKOFF,
            steps_since_fallback: 0,
            events_max: if method == Method::Rk4 {
                EVENTS_PER_STEP_MAX
            } else {
                EVENTS_PER_STEP_MAX_STIFF
            },
            rodas4: crate::integrators::rodas4::Memory::default(),
            buffers: None,
            energy_gain: 0.0,
            modes_pending: false,
        }
    }

    /// Advances by `seconds`, or restores the state before the step on error.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), StepError> {
        if self.modes_pending && self.reactivate().is_err() {
            // No consistent set of active constraints exists; the step starts without any.
            self.modes_pending = false;
        }
        let before = self.checkpoint();
        let result = match self.method {
            Method::Rk4 => self.run(Stepper::RungeKutta, &before, seconds),
            Method::Rodas4 => self.run(Stepper::Rosenbrock, &before, seconds),
            Method::Moreau => self.moreau.advance(&self.model, &mut self.run, seconds),
            Method::SemiImplicit => {
                self.fixed_step
                    .semi_implicit(&self.model, &mut self.run, seconds)
            }
            Method::ExplicitEuler => {
                self.fixed_step
                    .explicit_euler(&self.model, &mut self.run, seconds)
            }
            Method::Thesis => self.fixed_step.thesis(&self.model, &mut self.run, seconds),
        };
        let result = result.and_then(|()| self.check_step(&before, seconds));
        if result.is_err() {
            self.roll_back(&before);
            self.step_size = before.step_size;
            self.moreau.set_last_impulses(before.last_impulses);
            (self.fallback_steps, self.backoff) = (before.fallback_steps, before.backoff);
            self.steps_since_fallback = before.steps_since_fallback;
            (self.run.counts, self.energy_gain) = (before.counts, before.energy_gain);
        }
        result
    }

    /// Advances by event-driven steps. Falls back from Runge–Kutta to Rosenbrock where a step is
    /// too stiff or fails, and to Moreau's rule, which always has a solution, where events
    /// accumulate (chattering), the energy balance does not close, or Rosenbrock fails.
    fn run(
        &mut self,
        stepper: Stepper,
        before: &Checkpoint<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        if self.fallback_steps > 0 {
            self.fallback_steps -= 1;
            self.modes_pending = self.fallback_steps == 0;
            return self.moreau_fallback(before, seconds);
        }
        match self.event_driven(stepper, seconds) {
            Ok(())
                if self.is_unbalanced(&before.ledger) || self.had_event_after_fallback(before) =>
            {
                self.run.counts.steps = before.counts.steps;
                self.begin_fallback();
                self.moreau_fallback(before, seconds)
            }
            Ok(()) => {
                self.reset_backoff();
                Ok(())
            }
            Err(Halt::Failed(error @ StepError::NotFinite)) => Err(error),
            Err(Halt::Stiff | Halt::Failed(_)) if stepper == Stepper::RungeKutta => {
                self.roll_back(before);
                self.run.counts.fallbacks += 1;
                self.run(Stepper::Rosenbrock, before, seconds)
            }
            Err(_) => {
                self.begin_fallback();
                self.moreau_fallback(before, seconds)
            }
        }
    }

    /// Starts a fallback of `backoff` steps of Moreau's rule, and doubles the length of the next
    /// one.
    fn begin_fallback(&mut self) {
        self.fallback_steps = self.backoff;
        self.backoff = (2 * self.backoff).min(BACKOFF_MAX);
        self.steps_since_fallback = 0;
    }

    /// Returns whether the first step after a fallback had events. Then their cause persists: an
    /// overlap left by Moreau's rule has become an impact.
    fn had_event_after_fallback(&self, before: &Checkpoint<N>) -> bool {
        self.backoff > BACKOFF
            && self.steps_since_fallback == 0
            && self.run.counts.events > before.counts.events
    }

    /// Halves the length of the next fallback after as many steps without one.
    fn reset_backoff(&mut self) {
        self.steps_since_fallback += 1;
        if self.steps_since_fallback.is_multiple_of(self.backoff) {
            self.backoff = (self.backoff / 2).max(BACKOFF);
        }
    }

    /// Advances by Moreau's rule in place of another method, in as many substeps as needed to avoid
    /// an energy gain.
    fn moreau_fallback(&mut self, before: &Checkpoint<N>, seconds: f64) -> Result<(), StepError> {
        self.run.counts.fallbacks += 1;
        for halvings in 0..=HALVINGS_MAX {
            let substeps = 1 << halvings;
            self.roll_back(before);
            self.moreau.set_last_impulses(before.last_impulses);
            for _ in 0..substeps {
                self.moreau
                    .advance(&self.model, &mut self.run, seconds / f64::from(substeps))?;
            }
            if !self.gained_too_much(&before.ledger) {
                if halvings > 0 && self.violation() > VIOLATION_MAX {
                    return Err(StepError::ConstraintViolation {
                        by: self.violation(),
                    });
                }
                return Ok(());
            }
        }
        Ok(())
    }

    /// Saves the values that a step changes.
    fn checkpoint(&self) -> Checkpoint<N> {
        Checkpoint {
            state: self.run.state,
            mode: self.run.mode,
            ledger: self.run.ledger,
            impulse_sums: self.run.impulse_sums,
            step_size: self.step_size,
            last_impulses: *self.moreau.last_impulses(),
            fallback_steps: self.fallback_steps,
            backoff: self.backoff,
            steps_since_fallback: self.steps_since_fallback,
            counts: self.run.counts,
            energy_gain: self.energy_gain,
            events: self.run.log.events.len(),
        }
    }

    fn roll_back(&mut self, before: &Checkpoint<N>) {
        self.run.state = before.state;
        self.run.mode = before.mode;
        (self.run.ledger, self.run.impulse_sums) = (before.ledger, before.impulse_sums);
        self.run.log.events.truncate(before.events);
        self.step_size = Lanes::splat(f64::INFINITY);
    }

    /// Returns the maximum violation of the active constraints \[m\].
    pub(crate) fn violation(&self) -> f64 {
        self.run.violation(&self.model)
    }

    /// Returns kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(&self) -> Stored {
        self.run.stored(&self.model)
    }
}

#[cfg(test)]
mod tests;
