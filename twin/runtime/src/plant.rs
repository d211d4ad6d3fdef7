use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};

use crate::plant_state::PlantState;

/// The physics. Its input ports are actuator commands, its output ports measurements and truths.
///
/// The rig moves it by [`Plant::advance`] to every instant at which something acts on it or looks at it,
/// never back, and never twice to the same one.
pub trait Plant: Send {
    /// Name, for messages and recordings.
    fn name(&self) -> &str;

    /// Its inputs and outputs, the same at every call. Only the outputs that somebody wants are there:
    /// whoever builds the plant tells it which.
    fn ports(&self) -> Vec<Port>;

    /// Writes the inputs that hold it as it starts, end to end, in order: what it is held to until the first command
    /// arrives. Zeros where it has no such wish.
    fn first_inputs(&self, inputs: &mut [f64]) {
        inputs.fill(0.0);
    }

    /// Moves on to `to`, which is later than now, with `inputs` held constant.
    ///
    /// # Errors
    /// [`PlantFault`] if the state is no longer physical; the plant stays where it last was.
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault>;

    /// Writes the output ports, end to end, in order. They describe the state that was advanced to;
    /// commands given since are not in them. Looking changes nothing: a plant that is looked at more
    /// often (or not at all) goes the same way.
    fn observe(&mut self, outputs: &mut [f64]);

    /// Begins a new window for the outputs that are means or sums over one (a foot's mean load). The rig
    /// calls it at every instant of the observation grid, after [`Plant::observe`], and at no other.
    fn begin_window(&mut self) {}

    /// Where the energy is and where it went, now.
    fn energy(&self) -> EnergyBalance;

    /// What the run has cost so far.
    fn work(&self) -> WorkCounts;

    /// How far what must be closed is open, now: loops, stops that were passed, contacts that overlap, in metres of the
    /// worst of them; none if the plant has nothing of the kind to tell \[m\].
    fn constraint_violation(&self) -> Option<f64> {
        None
    }

    /// Begins to keep the discontinuities that the plant meets from now on, or stops to and forgets them. A plant that is
    /// just built keeps none, and whether it does changes nothing else.
    fn log_events(&mut self, _wanted: bool) {}

    /// The discontinuities met since [`Plant::log_events`], in order of time; always empty for a plant that cannot tell
    /// when they happen.
    fn events(&self) -> &[PlantEvent] {
        &[]
    }

    /// Saves everything that the way ahead depends on, caches and warm starts included.
    fn save(&self) -> Snapshot;

    /// Goes back to a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is not of such a plant.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;

    /// Where it is, in names that other models of the same thing know, too; none if it has no such names.
    fn state(&self) -> Option<PlantState> {
        None
    }

    /// Goes on from where another plant is, at that one's time, with its own energy books opened anew; its inputs are then
    /// its first ones. Returns what it could not take over, a line each.
    ///
    /// # Errors
    /// [`PlantFault`] if it cannot be where the other is; it stays where it was. A plant that has no names for its state can
    /// be nowhere but in its own.
    fn resume_from(&mut self, _from: &PlantState) -> Result<Vec<String>, PlantFault> {
        Err(PlantFault {
            time: SimTime::ZERO,
            part: self.name().to_owned(),
            energy: self.energy().stored(),
            why: "it goes on from no other plant".to_owned(),
        })
    }
}

/// A plant that stopped, with everything seen before kept.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{part} failed at {time}, with {energy:.3e} J in it: {why}")]
pub struct PlantFault {
    /// When it was last sound.
    pub time: SimTime,
    /// What failed: `leg/LF`, `contact`, `integrator`.
    pub part: String,
    /// Energy in the plant by then \[J\].
    pub energy: f64,
    /// How it failed.
    pub why: String,
}

impl PlantFault {
    /// That `plant` stopped at `time` because the program is to end ([`crate::interrupt`]).
    pub fn interrupted(plant: &dyn Plant, time: SimTime) -> Self {
        Self {
            time,
            part: plant.name().to_owned(),
            energy: plant.energy().stored(),
            why: "interrupted".to_owned(),
        }
    }
}

/// A discontinuity that a plant met, at the time its own solution gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantEvent {
    /// When, since the start; between the nanoseconds of [`SimTime`] where the plant locates it better \[s\].
    pub at_s: f64,
    /// What of the plant: `leg/LF/closed`, `leg/LF/ground`.
    pub part: String,
    /// Which way.
    pub kind: PlantEventKind,
}

/// Which way a discontinuity goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PlantEventKind {
    /// A stop is reached, a foot touches down, a cable becomes taut.
    Reached,
    /// It lets go.
    Released,
}

/// Energy of a plant \[J\]. In an exact world `stored − stored at the start = actuator − dissipated −
/// impact`; what is missing is the residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyBalance {
    /// In motion, now.
    pub kinetic: f64,
    /// In springs, now.
    pub spring: f64,
    /// In height, now.
    pub gravity: f64,
    /// Taken out by friction and damping since the start.
    pub dissipated: f64,
    /// Put in by actuators since the start.
    pub actuator: f64,
    /// Lost in impacts since the start.
    pub impact: f64,
    /// Sum of the magnitudes of all transfers since the start: what the residual is measured by.
    pub exchanged: f64,
    /// What the books lack: 0 for an exact integrator.
    pub residual: f64,
}

impl EnergyBalance {
    /// Energy in the plant, now \[J\].
    pub fn stored(&self) -> f64 {
        self.kinetic + self.spring + self.gravity
    }
}

/// What a plant has done since the start: numbers that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkCounts {
    /// Steps of the integrator.
    pub steps: u64,
    /// Evaluations of the right-hand side.
    pub evaluations: u64,
    /// Factorisations of a matrix.
    pub factorisations: u64,
    /// Discontinuities met: touch-downs, stops reached.
    pub events: u64,
    /// Iterations of the contact solver.
    pub solver_iterations: u64,
    /// Times the method of choice gave up and another, or a shorter step, took over.
    pub fallbacks: u64,
}

impl WorkCounts {
    /// The counts by name, in the order of the fields.
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
