//! Time integration of the plant.

use twinrig_contact::SolveError;
use twinrig_legged::{DriveModels, Ledger, NegativeDissipation, Stored};
use twinrig_runtime::WorkCounts;

use crate::constraints::events::Instant;
use crate::constraints::mode::Mode;
use crate::constraints::motion::{Dynamics, LegForces, Motion, Workspace};
use crate::integrators::event_driven::{Buffers, Halt, Stepper};
use crate::integrators::moreau::LastImpulses;
use crate::model::Model;
use crate::model::articulated::{into_world, stored_in};
use crate::model::chain::Chain;
use crate::model::real::{Lanes, Real};
use crate::model::site::Site;
use crate::model::state::{Slope, State};
use crate::options::Method;
use crate::plant::log::LoggedEvent;

/// Integration errors.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum FlowError {
    #[error(transparent)]
    SolveError(#[from] SolveError),
    #[error("a foot jams under its own friction, and no impulse releases it: {0}")]
    Jammed(SolveError),
    #[error("the state is not a number")]
    NotFinite,
    #[error("active constraints are violated by {by:.3e} m, which no forces can correct")]
    ConstraintViolation { by: f64 },
    #[error(
        "the foot of leg {} is {depth:.3e} m below the ground and sinks without a ground force",
        leg + 1
    )]
    FootSinks { leg: usize, depth: f64 },
    #[error("the tolerance requires substeps below 1e-12 s, at present {seconds:e} s")]
    TooStiff { seconds: f64 },
    #[error(
        "the iteration for the rates of a step of {seconds:e} s does not converge: links rotate too far"
    )]
    NotConverged { seconds: f64 },
    #[error(
        "steps of {:.3} ms are unstable: they gained {gained:.3e} J of numerical energy",
        1e3 * seconds
    )]
    EnergyGain { seconds: f64, gained: f64 },
    #[error("steps of {:.3} ms are unstable: {why}", 1e3 * seconds)]
    Dissipation {
        seconds: f64,
        why: NegativeDissipation,
    },
    #[error(
        "steps of {:.3} ms are too long: they lost {lost:.3e} J of numerical energy",
        1e3 * seconds
    )]
    EnergyLoss { seconds: f64, lost: f64 },
}

/// Impulses of drives and ground, summed over time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ImpulseSums {
    /// Hip motor and knee motor ∫ τ dt \[N·m·s\], cable ∫ F dt \[N·s\].
    pub(crate) hip: Lanes,
    pub(crate) knee: Lanes,
    pub(crate) cable: Lanes,
    /// Ground impulses on each leg, world frame \[N·s\].
    pub(crate) ground: [[f64; 3]; 4],
}

impl ImpulseSums {
    pub(crate) fn new() -> Self {
        let zero = Lanes::zero();
        Self {
            hip: zero,
            knee: zero,
            cable: zero,
            ground: [[0.0; 3]; 4],
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.hip += other.hip;
        self.knee += other.knee;
        self.cable += other.cable;
        self.add_ground(&other.ground);
    }

    /// Adds ground impulses.
    pub(crate) fn add_ground(&mut self, ground: &[[f64; 3]; 4]) {
        for (sum, part) in self
            .ground
            .iter_mut()
            .flatten()
            .zip(ground.iter().flatten())
        {
            *sum += part;
        }
    }
}

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
    pub(crate) state: State<Lanes, N>,
    pub(crate) mode: Mode,
    pub(crate) ledger: Ledger,
    pub(crate) counts: WorkCounts,
    pub(crate) impulse_sums: ImpulseSums,
    /// Sums before the last run, and its duration \[s\].
    pub(crate) impulse_sums_before: ImpulseSums,
    pub(crate) run_seconds: f64,
    /// Proposed step size of each island \[s\].
    pub(crate) step_size: Lanes,
    pub(crate) method: Method,
    /// Maximum error of a step \[m\].
    pub(crate) tolerance: f64,
    pub(crate) workspace: Workspace<f64, N>,
    pub(crate) instant: Instant<N>,
    /// Impulses of the last step of [`Method::Moreau`], the initial guess of the next; and rates
    /// without them.
    pub(crate) last_impulses: LastImpulses,
    pub(crate) free_rates: Vec<f64>,
    /// Memory of a Moreau step; none while one is in progress.
    pub(crate) midpoint: Option<Box<crate::integrators::moreau::Memory<N>>>,
    /// Remaining steps by Moreau's rule after event accumulation, and length of the next fallback.
    pub(crate) fallback_steps: u32,
    pub(crate) backoff: u32,
    /// Steps since the last fallback.
    pub(crate) steps_since_fallback: u32,
    /// Maximum number of events of an island per step.
    pub(crate) events_max: u32,
    /// Time at the start of the step \[s\], and the event log.
    pub(crate) now_s: f64,
    pub(crate) logging: bool,
    pub(crate) log: Vec<LoggedEvent>,
    pub(crate) rodas4: crate::integrators::rodas4::Memory<N>,
    /// Buffers of the event-driven integrator; none while it runs.
    pub(crate) buffers: Option<Box<Buffers<N>>>,
    /// Error estimate of the last step for a foot \[m\].
    pub(crate) estimate: f64,
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
        let mut mode = Mode::free();
        match model.drives {
            None => {}
            Some(DriveModels::Servos(_)) => {
                mode.active.hip = Lanes::splat(1.0);
                mode.update_any();
            }
            Some(DriveModels::Motors(_)) => {
                mode.commands.hip_saturated = Lanes::splat(1.0);
                mode.commands.pulley_saturated = Lanes::splat(1.0);
            }
        }
        let mut flow = Self {
            model,
            state,
            mode,
            ledger: Ledger::default(),
            counts: WorkCounts::default(),
            impulse_sums: ImpulseSums::new(),
            impulse_sums_before: ImpulseSums::new(),
            run_seconds: 0.0,
            step_size: Lanes::splat(f64::INFINITY),
            method,
            tolerance,
            workspace: Workspace::default(),
            instant: Instant::default(),
            last_impulses: LastImpulses::default(),
            free_rates: Vec::new(),
            midpoint: None,
            fallback_steps: 0,
            backoff: BACKOFF,
            steps_since_fallback: 0,
            events_max: if method == Method::Rk4 {
                EVENTS_PER_STEP_MAX
            } else {
                EVENTS_PER_STEP_MAX_STIFF
            },
            now_s: 0.0,
            logging: false,
            log: Vec::new(),
            rodas4: crate::integrators::rodas4::Memory::default(),
            buffers: None,
            estimate: 0.0,
            energy_gain: 0.0,
            modes_pending: false,
        };
        flow.ledger = Ledger::opened(flow.stored());
        flow
    }

    /// Advances by `seconds`, or restores the state before the step on error.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), FlowError> {
        if self.modes_pending && self.reactivate().is_err() {
            // No consistent set of active constraints exists; the step starts without any.
            self.modes_pending = false;
        }
        let before = self.checkpoint();
        let result = match self.method {
            Method::Rk4 => self.run(Stepper::RungeKutta, &before, seconds),
            Method::Rodas4 => self.run(Stepper::Rosenbrock, &before, seconds),
            Method::Moreau => self.run_moreau(seconds),
            Method::SemiImplicit => self.run_semi_implicit(seconds),
            Method::ExplicitEuler => self.run_explicit_euler(seconds),
            Method::Thesis => self.run_thesis(seconds),
        };
        let result = result.and_then(|()| self.check_step(&before, seconds));
        if result.is_err() {
            self.roll_back(&before);
            (self.step_size, self.last_impulses) = (before.step_size, before.last_impulses);
            (self.fallback_steps, self.backoff) = (before.fallback_steps, before.backoff);
            self.steps_since_fallback = before.steps_since_fallback;
            (self.counts, self.energy_gain) = (before.counts, before.energy_gain);
            self.instant.iterations = self.counts.solver_iterations;
            self.instant.factorisations = self.counts.factorisations;
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
    ) -> Result<(), FlowError> {
        if self.fallback_steps > 0 {
            self.fallback_steps -= 1;
            self.modes_pending = self.fallback_steps == 0;
            return self.moreau_fallback(before, seconds);
        }
        match self.event_driven(stepper, seconds) {
            Ok(())
                if self.is_unbalanced(&before.ledger) || self.had_event_after_fallback(before) =>
            {
                self.counts.steps = before.counts.steps;
                self.begin_fallback();
                self.moreau_fallback(before, seconds)
            }
            Ok(()) => {
                self.reset_backoff();
                Ok(())
            }
            Err(Halt::Failed(error @ FlowError::NotFinite)) => Err(error),
            Err(Halt::Stiff | Halt::Failed(_)) if stepper == Stepper::RungeKutta => {
                self.roll_back(before);
                self.counts.fallbacks += 1;
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
            && self.counts.events > before.counts.events
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
    fn moreau_fallback(&mut self, before: &Checkpoint<N>, seconds: f64) -> Result<(), FlowError> {
        self.counts.fallbacks += 1;
        for halvings in 0..=HALVINGS_MAX {
            let substeps = 1 << halvings;
            self.roll_back(before);
            self.last_impulses = before.last_impulses;
            for _ in 0..substeps {
                self.run_moreau(seconds / f64::from(substeps))?;
            }
            if !self.gained_too_much(&before.ledger) {
                if halvings > 0 && self.violation() > VIOLATION_MAX {
                    return Err(FlowError::ConstraintViolation {
                        by: self.violation(),
                    });
                }
                return Ok(());
            }
        }
        Ok(())
    }

    /// Returns an error if a number of the state is not finite.
    pub(crate) fn check_finite(&self) -> Result<(), FlowError> {
        let legs = self.model.legs.len();
        let rates = self.state.rates.iter().chain(&self.state.angles);
        let sum = rates.fold(self.state.pulley, |sum, rate| sum + *rate);
        let trunk = self.state.velocity.iter().chain(&self.state.turning);
        let trunk = trunk.chain(&self.state.position).sum::<f64>();
        if trunk.is_finite() && sum.to_array()[..legs].iter().all(|x| x.is_finite()) {
            Ok(())
        } else {
            Err(FlowError::NotFinite)
        }
    }

    /// Saves the values that a step changes.
    fn checkpoint(&self) -> Checkpoint<N> {
        Checkpoint {
            state: self.state,
            mode: self.mode,
            ledger: self.ledger,
            impulse_sums: self.impulse_sums,
            step_size: self.step_size,
            last_impulses: self.last_impulses,
            fallback_steps: self.fallback_steps,
            backoff: self.backoff,
            steps_since_fallback: self.steps_since_fallback,
            counts: self.counts,
            energy_gain: self.energy_gain,
            events: self.log.len(),
        }
    }

    fn roll_back(&mut self, before: &Checkpoint<N>) {
        self.state = before.state;
        self.mode = before.mode;
        (self.ledger, self.impulse_sums) = (before.ledger, before.impulse_sums);
        self.log.truncate(before.events);
        self.step_size = Lanes::splat(f64::INFINITY);
    }

    /// Returns the maximum violation of the active constraints \[m\].
    pub(crate) fn violation(&self) -> f64 {
        let dynamics = Dynamics::new(&self.model, &self.model.side_by_side, &self.mode, 0.0);
        let chain = Chain::new(dynamics.legs, &self.state.angles, &self.state.rates);
        let drive = dynamics.drive(&self.state);
        let active = &self.mode.active;
        let mut worst = 0.0_f64;
        for (constraint, active) in [
            (
                chain.closed(dynamics.legs, &self.state.angles),
                active.closed,
            ),
            (chain.open(dynamics.legs), active.open),
            (chain.extended(dynamics.legs), active.extended),
            (chain.bottomed(dynamics.legs), active.bottomed),
            (chain.taut(dynamics.legs, &drive), active.cable),
        ] {
            for leg in 0..self.model.legs.len() {
                worst = worst.max((constraint.gap * active).lane(leg).abs());
            }
        }
        worst
    }

    /// Returns the islands, which move independently, as ranges of legs: the whole robot, or each
    /// leg on a fixed trunk.
    pub(crate) fn islands(&self) -> impl Iterator<Item = core::ops::Range<usize>> + use<N> {
        let (legs, free) = (self.model.legs.len(), self.model.is_free());
        let islands = if free { 1 } else { legs };
        (0..islands).map(move |i| if free { 0..legs } else { i..i + 1 })
    }

    /// Returns the right-hand side in a state without intermediate results. Adds the impulses over
    /// the given time \[s\] to the sums.
    #[inline(never)]
    pub(crate) fn stage(
        &mut self,
        state: &State<Lanes, N>,
        recovery: f64,
        accumulate: Option<(Lanes, &mut ImpulseSums)>,
    ) -> Slope<Lanes, N> {
        if !self.mode.contacts.is_empty() {
            let motion = self.motion(state, recovery);
            if let Some((seconds, impulse_sums)) = accumulate {
                self.add_impulses(state, &motion, seconds, impulse_sums);
            }
            return motion.slope;
        }
        self.counts.evaluations += 1;
        let dynamics = Dynamics::new(&self.model, &self.model.side_by_side, &self.mode, recovery);
        let (slope, forces) = dynamics.slope_without_contacts(state);
        if let Some((seconds, impulse_sums)) = accumulate {
            self.add_drive_impulses(&forces, seconds, impulse_sums);
        }
        slope
    }

    /// Returns the right-hand side in a state with its intermediate results.
    #[inline(never)]
    pub(crate) fn motion(&mut self, state: &State<Lanes, N>, recovery: f64) -> Motion<Lanes, N> {
        self.counts.evaluations += 1;
        let dynamics = Dynamics::new(&self.model, &self.model.side_by_side, &self.mode, recovery);
        dynamics.motion(state, &mut self.workspace)
    }

    /// Computes the same in place.
    #[inline(never)]
    pub(crate) fn motion_into(
        &mut self,
        state: &State<Lanes, N>,
        recovery: f64,
        motion: &mut Motion<Lanes, N>,
    ) {
        self.counts.evaluations += 1;
        let dynamics = Dynamics::new(&self.model, &self.model.side_by_side, &self.mode, recovery);
        dynamics.motion_into(state, &mut self.workspace, motion);
    }

    /// Returns kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(&self) -> Stored {
        stored_in(&self.model, &self.model.side_by_side, &self.state)
    }

    /// Adds the impulses of a motion over `weight` seconds. The contact forces are those in the
    /// workspace.
    #[inline(always)]
    pub(crate) fn add_impulses(
        &self,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        weight: Lanes,
        impulse_sums: &mut ImpulseSums,
    ) {
        self.add_drive_impulses(&motion.forces, weight, impulse_sums);
        self.add_ground_impulses(state, motion, weight, impulse_sums);
    }

    #[inline(always)]
    pub(crate) fn add_drive_impulses(
        &self,
        forces: &LegForces<Lanes>,
        weight: Lanes,
        impulse_sums: &mut ImpulseSums,
    ) {
        if self.model.drives.is_some() {
            impulse_sums.hip += weight * forces.hip_torque;
            impulse_sums.knee += weight * forces.knee_torque;
            // The error of the event time extends the motion past the event, where a cable does not
            // push.
            let tension = forces.forces[crate::model::leg_constraints::CABLE];
            impulse_sums.cable +=
                weight * tension.clamped(Lanes::zero(), Lanes::splat(f64::INFINITY));
        }
    }

    pub(crate) fn add_ground_impulses(
        &self,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        weight: Lanes,
        impulse_sums: &mut ImpulseSums,
    ) {
        let Some(ground) = &self.model.ground else {
            return;
        };
        if self.mode.contacts.is_empty() {
            return;
        }
        let rotation = motion.articulated.rotation();
        let mut forces = self.workspace.forces.as_slice();
        for contact in &self.mode.contacts {
            let legs = &self.model.side_by_side;
            let site = Site::new(
                legs,
                &motion.articulated.chain,
                state,
                contact.leg,
                contact.links,
            );
            let footing = site.footing(ground, state.position, &rotation);
            let [n, a, b] = footing.directions;
            let rows = if contact.slides.is_some() { 1 } else { 3 };
            let (of_contact, others) = forces.split_at(rows);
            forces = others;
            if of_contact[0] <= 0.0 {
                // The error of the event time extends the motion past the event, where the ground
                // does not pull.
                continue;
            }
            let force: [f64; 3] = if let Some(last) = contact.slides {
                let s = crate::constraints::motion::sliding(&footing, last);
                let along = |i: usize| s[0] * a[i] + s[1] * b[i];
                std::array::from_fn(|i| of_contact[0] * (n[i] - ground.friction * along(i)))
            } else {
                std::array::from_fn(|i| {
                    of_contact[0] * n[i] + of_contact[1] * a[i] + of_contact[2] * b[i]
                })
            };
            let seconds = weight.lane(contact.leg);
            for (sum, part) in impulse_sums.ground[contact.leg]
                .iter_mut()
                .zip(into_world(&rotation, force))
            {
                *sum += seconds * part;
            }
        }
    }
}

#[cfg(test)]
mod tests;
