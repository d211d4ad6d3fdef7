//! The ground, as far as it must be known to tell how high a trunk is above it.

use std::fmt;
use std::sync::Arc;

/// The height of the ground at a place in the world.
#[derive(Clone, Default)]
pub enum GroundBelow {
    /// There is no ground.
    #[default]
    Nothing,
    /// Height 0 everywhere.
    Level,
    /// A height for every x and y \[m\].
    Heights(Arc<dyn Fn(f64, f64) -> f64 + Send + Sync>),
}

impl GroundBelow {
    /// The height at a place \[m\]; none without ground.
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
    /// Heights are the same if they are the same function.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (GroundBelow::Nothing, GroundBelow::Nothing)
            | (GroundBelow::Level, GroundBelow::Level) => true,
            (GroundBelow::Heights(a), GroundBelow::Heights(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}
