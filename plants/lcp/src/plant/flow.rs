//! Steps of the plant with rigid constraints: choice of the integrator, fallbacks, and checks.

use twinrig_legged::Stored;

use super::energy_monitor::EnergyMonitor;
use super::fallback::Fallback;
use crate::integrators::euler::FixedStep;
use crate::integrators::event_driven::{EventDriven, Halt, Stepper};
use crate::integrators::impulse_sums::ImpulseSums;
use crate::integrators::moreau::{LastImpulses, Moreau};
use crate::integrators::run_state::{self, RunState};
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::real::Lanes;
use crate::model::state::State;
use crate::options::Method;

/// Events of an island per step above which they accumulate (chattering): for the default method,
/// and for the method for stiff robots.
const EVENTS_PER_STEP_MAX: u32 = 8;
const EVENTS_PER_STEP_MAX_STIFF: u32 = 24;

/// Maximum number of halvings of a fallback step.
const HALVINGS_MAX: u32 = 7;

/// Constraint violation above which no forces can close a constraint \[m\].
const VIOLATION_MAX: f64 = 1e-3;

/// All values that a step changes.
struct Checkpoint<const N: usize> {
    run: run_state::Checkpoint<N>,
    step_size: Lanes,
    last_impulses: LastImpulses,
    fallback: Fallback,
    monitor: EnergyMonitor,
}

/// Time over which drives and ground are averaged for readings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    /// Impulses before it.
    pub(super) before: ImpulseSums,
    /// Its duration \[s\].
    pub(super) seconds: f64,
}

/// Plant with rigid constraints: a model, the state of its run, and the integrators that advance
/// it.
#[derive(Debug, Clone)]
pub(crate) struct Flow<const N: usize> {
    pub(crate) model: Model<N>,
    pub(crate) run: RunState<N>,
    pub(crate) method: Method,
    /// Maximum error of a step \[m\].
    pub(super) tolerance: f64,
    pub(crate) event_driven: EventDriven<N>,
    pub(super) moreau: Moreau<N>,
    pub(crate) fixed_step: FixedStep<N>,
    pub(super) fallback: Fallback,
    pub(super) monitor: EnergyMonitor,
    pub(super) window: Window,
    /// Whether the state was taken over and the active constraints are still to be found.
    pub(super) modes_pending: bool,
}

impl<const N: usize> Flow<N> {
    pub(crate) fn new(
        model: Model<N>,
        state: State<Lanes, N>,
        method: Method,
        tolerance: f64,
    ) -> Self {
        let events_max = if method == Method::Rk4 {
            EVENTS_PER_STEP_MAX
        } else {
            EVENTS_PER_STEP_MAX_STIFF
        };
        Self {
            run: RunState::new(&model, state),
            model,
            method,
            tolerance,
            event_driven: EventDriven::new(tolerance, events_max),
            moreau: Moreau::default(),
            fixed_step: FixedStep::default(),
            fallback: Fallback::new(),
            monitor: EnergyMonitor::default(),
            window: Window {
                before: ImpulseSums::new(),
                seconds: 0.0,
            },
            modes_pending: false,
        }
    }

    /// Advances by `seconds`, or restores the state before the step on error.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), StepError> {
        if core::mem::take(&mut self.modes_pending) {
            // Without a consistent set of active constraints the step starts without any.
            let _ = self.event_driven.reactivate(&self.model, &mut self.run);
        }
        self.run.elapsed_s = 0.0;
        let before = self.checkpoint();
        let result = self.advance(&before, seconds).and_then(|()| {
            let method = (self.method, self.tolerance);
            let (model, run) = (&self.model, &self.run);
            self.monitor.check(model, run, method, &before.run, seconds)
        });
        if result.is_err() {
            self.roll_back(&before);
            self.event_driven.step_size = before.step_size;
            self.moreau.set_last_impulses(&before.last_impulses);
            (self.fallback, self.monitor) = (before.fallback, before.monitor);
            self.run.counts = before.run.counts;
        }
        result
    }

    /// Advances by the method of the plant.
    fn advance(&mut self, before: &Checkpoint<N>, seconds: f64) -> Result<(), StepError> {
        let (model, run) = (&self.model, &mut self.run);
        if let Method::SemiImplicit | Method::ExplicitEuler | Method::Thesis = self.method {
            run.hold_mean_load(model, seconds);
        }
        match self.method {
            Method::Rk4 => self.with_fallback(Stepper::RungeKutta, before, seconds),
            Method::Rodas4 => self.with_fallback(Stepper::Rosenbrock, before, seconds),
            // Legs on a fixed trunk are independent: one does not divide the steps of all.
            Method::Moreau if model.is_free() => self.without_gain(before, seconds),
            Method::Moreau => self.moreau.advance(model, run, seconds),
            Method::SemiImplicit => self.fixed_step.semi_implicit(model, run, seconds),
            Method::ExplicitEuler => self.fixed_step.explicit_euler(model, run, seconds),
            Method::Thesis => self.fixed_step.thesis(model, run, seconds),
        }
    }

    /// Advances by event-driven steps. Falls back from Runge–Kutta to Rosenbrock where a step is
    /// too stiff or fails, and to Moreau's rule, which always has a solution, where events
    /// accumulate (chattering), the energy balance does not close, or Rosenbrock fails.
    fn with_fallback(
        &mut self,
        stepper: Stepper,
        before: &Checkpoint<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        if self.fallback.remaining > 0 {
            self.fallback.remaining -= 1;
            self.modes_pending = self.fallback.remaining == 0;
            return self.moreau_fallback(before, seconds);
        }
        let (model, run) = (&self.model, &mut self.run);
        match self.event_driven.advance(model, run, stepper, seconds) {
            Ok(()) if self.is_unbalanced(before) || self.had_event_after_fallback(before) => {
                self.run.counts.steps = before.run.counts.steps;
                self.fallback.begin();
                self.moreau_fallback(before, seconds)
            }
            Ok(()) => {
                self.fallback.count_step();
                Ok(())
            }
            Err(Halt::Failed(error @ StepError::NotFinite)) => Err(error),
            Err(Halt::Stiff | Halt::Failed(_)) if stepper == Stepper::RungeKutta => {
                self.roll_back(before);
                self.run.counts.fallbacks += 1;
                self.with_fallback(Stepper::Rosenbrock, before, seconds)
            }
            Err(_) => {
                self.fallback.begin();
                self.moreau_fallback(before, seconds)
            }
        }
    }

    /// Returns whether a step of finite tolerance has an energy error.
    fn is_unbalanced(&self, before: &Checkpoint<N>) -> bool {
        let ledgers = [&before.run.ledger, &self.run.ledger];
        self.tolerance.is_finite() && self.monitor.is_unbalanced(&self.model, ledgers)
    }

    /// Returns whether the first step after a fallback had events. Then their cause persists: an
    /// overlap left by Moreau's rule has become an impact.
    fn had_event_after_fallback(&self, before: &Checkpoint<N>) -> bool {
        self.fallback.has_just_ended() && self.run.counts.events > before.run.counts.events
    }

    /// Advances by Moreau's rule in place of another method.
    fn moreau_fallback(&mut self, before: &Checkpoint<N>, seconds: f64) -> Result<(), StepError> {
        self.roll_back(before);
        self.run.counts.fallbacks += 1;
        self.without_gain(before, seconds)
    }

    /// Advances by Moreau's rule, in as many substeps as needed to avoid an energy gain.
    fn without_gain(&mut self, before: &Checkpoint<N>, seconds: f64) -> Result<(), StepError> {
        for halvings in 0..=HALVINGS_MAX {
            let substeps = 1 << halvings;
            if halvings > 0 {
                self.roll_back(before);
                self.run.counts.fallbacks += 1;
            }
            self.moreau.set_last_impulses(&before.last_impulses);
            for _ in 0..substeps {
                self.moreau
                    .advance(&self.model, &mut self.run, seconds / f64::from(substeps))?;
            }
            let ledgers = [&before.run.ledger, &self.run.ledger];
            if !self.monitor.gained_too_much(&self.model, ledgers) {
                let by = if halvings > 0 { self.violation() } else { 0.0 };
                if by > VIOLATION_MAX {
                    return Err(StepError::ConstraintViolation { by });
                }
                return Ok(());
            }
        }
        Ok(())
    }

    /// Saves the values that a step changes, without heap allocation.
    fn checkpoint(&self) -> Checkpoint<N> {
        Checkpoint {
            run: self.run.checkpoint(),
            step_size: self.event_driven.step_size,
            last_impulses: *self.moreau.last_impulses(),
            fallback: self.fallback,
            monitor: self.monitor,
        }
    }

    /// Returns to the start of a step, for another attempt.
    fn roll_back(&mut self, before: &Checkpoint<N>) {
        self.run.roll_back(&before.run);
        self.event_driven.step_size = Lanes::splat(f64::INFINITY);
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
