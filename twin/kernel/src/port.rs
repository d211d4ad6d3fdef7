use std::fmt;

use serde::{Deserialize, Serialize};

use crate::Unit;

/// Direction of a signal, relative to the part that owns the port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Direction {
    /// Read by the part.
    Input,
    /// Written by the part.
    Output,
}

impl Direction {
    /// The direction of the port at the other end.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::Input => Self::Output,
            Self::Output => Self::Input,
        }
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Input => "input",
            Self::Output => "output",
        })
    }
}

/// Port of a signal: a named vector of `size` numbers in one unit.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Port {
    /// Path of the signal, e.g. `leg/LF/hip/position`.
    pub name: String,
    /// Unit of every component.
    pub unit: Unit,
    /// Number of components.
    pub size: usize,
    /// Direction relative to the owner.
    pub direction: Direction,
}

impl Port {
    /// A port that the owner reads.
    #[must_use]
    pub fn input(name: impl Into<String>, unit: Unit, size: usize) -> Self {
        Self {
            name: name.into(),
            unit,
            size,
            direction: Direction::Input,
        }
    }

    /// A port that the owner writes.
    #[must_use]
    pub fn output(name: impl Into<String>, unit: Unit, size: usize) -> Self {
        Self {
            name: name.into(),
            unit,
            size,
            direction: Direction::Output,
        }
    }

    /// Returns the matching port: the same signal in the opposite direction.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self {
            direction: self.direction.opposite(),
            ..self.clone()
        }
    }
}

/// `leg/LF/foot/position [m] × 3`
impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} [{}]", self.name, self.unit)?;
        if self.size == 1 {
            Ok(())
        } else {
            write!(f, " × {}", self.size)
        }
    }
}
