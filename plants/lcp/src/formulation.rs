//! Formulations of the constraints, rigid or compliant, that a plant is made of.

use serde::{Deserialize, Serialize};
use twinrig_compliant::SavedCompliant;
use twinrig_legged::{Dynamics, Ledger, LeggedPlant};
use twinrig_runtime::WorkCounts;

/// Plant in which every segment of the robot has inertia.
pub type Lcp = LeggedPlant<dyn Formulation>;

/// Equations of motion with any number of links per leg, and rigid or compliant constraints.
pub trait Formulation: Dynamics<Saved = SavedFormulation> {}

/// Serialised state of a formulation.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum SavedFormulation {
    /// Of rigid constraints.
    Rigid(SavedFlow),
    /// Of compliant constraints.
    Compliant(SavedCompliant),
}

/// Serialised state of a plant with rigid constraints.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedFlow {
    /// State, active constraints and sums, in the order of `Flow::visit`.
    pub(crate) numbers: Vec<f64>,
    pub(crate) contacts: Vec<(u64, u64, Option<[f64; 2]>)>,
    pub(crate) ledger: Ledger,
    pub(crate) counts: WorkCounts,
}
