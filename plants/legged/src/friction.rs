//! Coefficients of friction of the parts of a robot.

use serde::{Deserialize, Serialize};

use crate::LEGS;

/// Coefficients of friction \[1\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Friction {
    /// Those of each leg, at its foot, also for knee and ankle.
    pub legs: [f64; LEGS],
    /// That of the trunk, at its centre of mass.
    pub trunk: f64,
}
