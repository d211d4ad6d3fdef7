//! Equations of motion of the plant, and their serialised state.

use core::fmt::Debug;

use serde::{Deserialize, Serialize};
use twinrig_compliant::SavedCompliant;
use twinrig_legged::Dynamics;

use crate::flow::SavedFlow;

/// Equations of motion with rigid or compliant constraints.
pub trait Formulation: Dynamics<Saved = SavedFormulation> + Debug {}

/// Serialised state of a formulation.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum SavedFormulation {
    /// Of rigid constraints.
    Rigid(Vec<SavedFlow>),
    /// Of compliant constraints.
    Compliant(SavedCompliant),
}
