//! Height of the ground below the trunk, for the detection of falls.

use std::fmt;
use std::sync::Arc;

/// Ground height as a function of the position in the world.
#[derive(Clone, Default)]
pub enum GroundBelow {
    /// No ground.
    #[default]
    Nothing,
    /// Height 0 everywhere.
    Level,
    /// Height as a function of x and y \[m\].
    Heights(Arc<dyn Fn(f64, f64) -> f64 + Send + Sync>),
}

impl GroundBelow {
    /// Returns the height at a position \[m\]; none without ground.
    pub fn height(&self, x: f64, y: f64) -> Option<f64> {
        match self {
            GroundBelow::Nothing => None,
            GroundBelow::Level => Some(0.0),
            GroundBelow::Heights(height) => Some(height(x, y)),
        }
    }
}

impl fmt::Debug for GroundBelow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            GroundBelow::Nothing => "Nothing",
            GroundBelow::Level => "Level",
            GroundBelow::Heights(_) => "Heights",
        })
    }
}

impl PartialEq for GroundBelow {
    /// Compares height functions by identity.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (GroundBelow::Nothing, GroundBelow::Nothing)
            | (GroundBelow::Level, GroundBelow::Level) => true,
            (GroundBelow::Heights(a), GroundBelow::Heights(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}
