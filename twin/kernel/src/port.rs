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

/// Kind of a signal: its course between two samples.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum SignalKind {
    /// Linear: forces, torques, energies, counters.
    Linear,
    /// A smooth function of time: positions.
    Position,
    /// Angles, smooth modulo 2π.
    Angle,
    /// The time derivative of the signal of this name, component by component.
    RateOf(String),
    /// A unit quaternion.
    Rotation,
}

impl SignalKind {
    /// The kind of a signal in `unit` without further declaration.
    const fn of(unit: Unit) -> Self {
        match unit {
            Unit::Meter => Self::Position,
            Unit::Radian => Self::Angle,
            _ => Self::Linear,
        }
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
    /// Kind: by default a position in metres, an angle in radians, otherwise linear.
    pub kind: SignalKind,
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
            kind: SignalKind::of(unit),
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
            kind: SignalKind::of(unit),
        }
    }

    /// Declares the signal to be the time derivative of the signal `position`.
    #[must_use]
    pub fn rate_of(self, position: impl Into<String>) -> Self {
        let kind = SignalKind::RateOf(position.into());
        Self { kind, ..self }
    }

    /// Declares the signal to be a unit quaternion.
    #[must_use]
    pub fn rotation(self) -> Self {
        let kind = SignalKind::Rotation;
        Self { kind, ..self }
    }

    /// Returns whether `other` is the same signal in the opposite direction, whatever its kind.
    #[must_use]
    pub fn connects(&self, other: &Self) -> bool {
        (&self.name, self.unit, self.size) == (&other.name, other.unit, other.size)
            && self.direction == other.direction.opposite()
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
