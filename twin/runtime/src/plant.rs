use std::ops::{Add, Range};

use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};

use crate::limit::LimitViolation;
use crate::plant_state::PlantState;

/// Model of the physics. Its input ports are actuator commands, its output ports measurements and
/// ground truth.
///
/// The rig calls [`Plant::advance`] to every instant at which the plant is actuated, sampled or
/// observed, in strictly increasing order of time.
///
/// A wrapper returns its inner plant from [`Plant::inner`] and [`Plant::inner_mut`] and implements
/// the methods in which it differs; the others are those of the inner plant. By default a plant
/// without an inner one has no energy balance and counts no work, which leaves expectations of them
/// unobserved, and cannot be restored.
pub trait Plant: Send {
    /// Returns the wrapped plant.
    fn inner(&self) -> Option<&dyn Plant> {
        None
    }

    /// Returns the wrapped plant, for changes.
    fn inner_mut(&mut self) -> Option<&mut dyn Plant> {
        None
    }

    /// Returns the name, used in messages and recordings.
    fn name(&self) -> &str;

    /// Returns inputs and outputs, constant over the life of the plant. Contains only the outputs
    /// that were selected when the plant was built.
    fn ports(&self) -> Vec<Port>;

    /// Writes the initial inputs, concatenated in order, which apply until the first command
    /// arrives. Zeros by default; a plant may return the inputs that hold its start pose.
    fn initial_inputs(&self, inputs: &mut [f64]) {
        match self.inner() {
            Some(inner) => inner.initial_inputs(inputs),
            None => inputs.fill(0.0),
        }
    }

    /// Advances to `to`, which is later than the present time, with constant `inputs`.
    ///
    /// # Errors
    /// [`PlantFault`] if the state is no longer physical; the plant stays at its last valid state.
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault>;

    /// Writes the output ports, concatenated in order. They describe the state advanced to;
    /// commands applied since then have no effect on them. Observation changes no state: the
    /// trajectory does not depend on how often the plant is observed.
    fn observe(&mut self, outputs: &mut [f64]);

    /// Writes at least the outputs `signals`; returns whether it has written all. A plant of
    /// independent parts need not advance those that are not read. By default all are written.
    fn observe_signals(&mut self, signals: Range<usize>, outputs: &mut [f64]) -> bool {
        let _ = signals;
        self.observe(outputs);
        true
    }

    /// Begins a new window for outputs that are means or sums over one (such as the mean load of a
    /// foot). The rig calls it at every instant of the observation grid, after [`Plant::observe`],
    /// and at no other.
    fn begin_window(&mut self) {
        if let Some(inner) = self.inner_mut() {
            inner.begin_window();
        }
    }

    /// Returns the energy balance at the present time.
    fn energy(&self) -> EnergyBalance {
        self.inner().map(Plant::energy).unwrap_or_default()
    }

    /// Returns the work counts since the start.
    fn work(&self) -> WorkCounts {
        self.inner().map(Plant::work).unwrap_or_default()
    }

    /// Returns the maximum constraint violation \[m\] at the present time: loop closure, joint
    /// limits, penetration; none if the plant has no such constraints.
    fn constraint_violation(&self) -> Option<f64> {
        self.inner().and_then(Plant::constraint_violation)
    }

    /// Returns the limits of the model that parts have exceeded since the start, at instants of
    /// [`Plant::begin_window`].
    fn limit_violations(&self) -> Vec<LimitViolation> {
        self.inner().map_or_else(Vec::new, Plant::limit_violations)
    }

    /// Returns whether the last failure of [`Plant::advance`] is a regular end: the model has ended
    /// the simulation, which the scenario permits. A run then ends without an error.
    fn has_ended(&self) -> bool {
        self.inner().is_some_and(Plant::has_ended)
    }

    /// Returns the least substep of an error control since the start, but for those cut short by
    /// the end of a step \[s\]; none without such control.
    fn least_substep_s(&self) -> Option<f64> {
        self.inner().and_then(Plant::least_substep_s)
    }

    /// Enables or disables the event log; either clears it. Disabled in a new plant; the log has no
    /// other effect.
    fn log_events(&mut self, enabled: bool) {
        if let Some(inner) = self.inner_mut() {
            inner.log_events(enabled);
        }
    }

    /// Returns the discontinuities since [`Plant::log_events`], in order of time; always empty for
    /// a plant that does not locate events.
    fn events(&self) -> &[PlantEvent] {
        self.inner().map_or(&[], Plant::events)
    }

    /// Saves all state that affects later behaviour, caches and warm starts included. Empty by
    /// default.
    fn save(&self) -> Snapshot {
        self.inner().map(Plant::save).unwrap_or_default()
    }

    /// Restores a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot belongs to another kind of plant. The default always
    /// fails: a plant that was forgotten to be restored would continue from a wrong state.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        if let Some(inner) = self.inner_mut() {
            return inner.restore(snapshot);
        }
        Err(SnapshotError::Unsupported {
            part: self.name().to_owned(),
        })
    }

    /// Returns the state by names that other models of the same system share; none if the plant has
    /// no such names.
    fn state(&self) -> Option<PlantState> {
        self.inner().and_then(Plant::state)
    }

    /// Resumes from the state of another plant, at that one's time, with a new energy balance; the
    /// inputs are then the initial ones. Returns a line for each part of the state that could not
    /// be represented.
    ///
    /// # Errors
    /// [`PlantFault`] if the plant cannot represent that state; it is then unchanged. The default,
    /// for plants without a named state, always fails.
    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        if let Some(inner) = self.inner_mut() {
            return inner.resume_from(from);
        }
        Err(PlantFault {
            time: SimTime::ZERO,
            part: self.name().to_owned(),
            energy: self.energy().stored(),
            why: "it cannot resume from the state of another plant".to_owned(),
        })
    }
}

/// Failure of a plant; everything observed before remains valid.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{part} failed at {time} with a stored energy of {energy:.3e} J: {why}")]
pub struct PlantFault {
    /// Time of the last valid state.
    pub time: SimTime,
    /// The part that failed: `leg/LF`, `contact`, `integrator`.
    pub part: String,
    /// Energy stored in the plant at that time \[J\].
    pub energy: f64,
    /// The reason.
    pub why: String,
}

impl PlantFault {
    /// Creates the fault of a `plant` stopped at `time` by a request to end the program
    /// ([`crate::interrupt`]).
    pub fn interrupted(plant: &dyn Plant, time: SimTime) -> Self {
        Self {
            time,
            part: plant.name().to_owned(),
            energy: plant.energy().stored(),
            why: "interrupted".to_owned(),
        }
    }
}

/// A discontinuity, at the time located by the plant's integrator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantEvent {
    /// Time since the start, between the nanoseconds of [`SimTime`] where the plant resolves it
    /// \[s\].
    pub at_s: f64,
    /// The constraint: `leg/LF/closed`, `leg/LF/ground`.
    pub part: String,
    /// The direction.
    pub kind: PlantEventKind,
}

/// Direction of a discontinuity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum PlantEventKind {
    /// Activated: a stop is reached, a foot touches down, a cable becomes taut.
    Reached,
    /// Released.
    Released,
}

/// Energy balance of a plant \[J\]. Exact integration satisfies `stored − stored at the start =
/// actuator + external − dissipated − impact`; the difference is the residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyBalance {
    /// Kinetic energy, present value.
    pub kinetic: f64,
    /// Elastic energy of springs, present value.
    pub spring: f64,
    /// Gravitational potential energy, present value.
    pub gravity: f64,
    /// Dissipated by friction and damping since the start.
    pub dissipated: f64,
    /// Work of the actuators since the start.
    pub actuator: f64,
    /// Lost in impacts since the start.
    pub impact: f64,
    /// Sum of the magnitudes of all transfers since the start: the scale of the residual.
    pub exchanged: f64,
    /// Residual of the balance: 0 for an exact integrator.
    pub residual: f64,
    /// Work of pushes from outside since the start; not among [`EnergyBalance::values`].
    pub external: f64,
}

impl EnergyBalance {
    /// Returns the balance with the values of [`EnergyBalance::values`].
    pub const fn of_values(values: [f64; 8]) -> Self {
        let [
            kinetic,
            spring,
            gravity,
            dissipated,
            actuator,
            impact,
            exchanged,
            residual,
        ] = values;
        Self {
            kinetic,
            spring,
            gravity,
            dissipated,
            actuator,
            impact,
            exchanged,
            residual,
            external: 0.0,
        }
    }

    /// Returns the energy stored in the plant at the present time \[J\].
    pub fn stored(&self) -> f64 {
        self.kinetic + self.spring + self.gravity
    }

    /// Returns the values of the signals [`twinrig_kernel::signal::ENERGY`], in their order.
    pub const fn values(&self) -> [f64; 8] {
        [
            self.kinetic,
            self.spring,
            self.gravity,
            self.dissipated,
            self.actuator,
            self.impact,
            self.exchanged,
            self.residual,
        ]
    }
}

impl Add for EnergyBalance {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            kinetic: self.kinetic + other.kinetic,
            spring: self.spring + other.spring,
            gravity: self.gravity + other.gravity,
            dissipated: self.dissipated + other.dissipated,
            actuator: self.actuator + other.actuator,
            impact: self.impact + other.impact,
            exchanged: self.exchanged + other.exchanged,
            residual: self.residual + other.residual,
            external: self.external + other.external,
        }
    }
}

/// Machine-independent counts of a plant's work since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkCounts {
    /// Steps of the integrator.
    pub steps: u64,
    /// Evaluations of the right-hand side.
    pub evaluations: u64,
    /// Factorisations of a matrix.
    pub factorisations: u64,
    /// Discontinuities: touch-downs, stops reached.
    pub events: u64,
    /// Iterations of the contact solver.
    pub solver_iterations: u64,
    /// Fallbacks from the preferred method to another one or to a shorter step.
    pub fallbacks: u64,
}

impl WorkCounts {
    /// Returns the counts of a plant that counts its steps only.
    pub fn of_steps(steps: u64) -> Self {
        Self {
            steps,
            ..Self::default()
        }
    }

    /// Returns the counts by name, in the order of the fields.
    pub fn named(&self) -> [(&'static str, u64); 6] {
        [
            ("steps", self.steps),
            ("evaluations", self.evaluations),
            ("factorisations", self.factorisations),
            ("events", self.events),
            ("solver_iterations", self.solver_iterations),
            ("fallbacks", self.fallbacks),
        ]
    }
}

impl Add for WorkCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            steps: self.steps + other.steps,
            evaluations: self.evaluations + other.evaluations,
            factorisations: self.factorisations + other.factorisations,
            events: self.events + other.events,
            solver_iterations: self.solver_iterations + other.solver_iterations,
            fallbacks: self.fallbacks + other.fallbacks,
        }
    }
}
