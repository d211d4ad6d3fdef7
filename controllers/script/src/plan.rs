//! What a script is told once, before it runs.

use crate::{ScriptError, Shape};

/// The part of a script that stays as it is while it runs. Everything else is a process variable ([`crate::Script`]).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plan {
    /// What the hips play.
    pub hip: Shape,
    /// What the knees play.
    pub knee: Shape,
    /// By how much of a cycle each leg is behind the one before it, in the robot's order, which begins with 0 \[rad\]. Legs
    /// that are left out count. Within ±[`Plan::PHASE_LAG_MAX`].
    pub phase_lag: f64,
    /// Whether hip abduction is commanded, too: a constant.
    pub abduction: bool,
}

impl Plan {
    /// The greatest phase lag \[rad\]: a thousand radians are 159 cycles.
    pub const PHASE_LAG_MAX: f64 = 1000.0;

    /// Gives `drive`, which is `hip` or `knee`, another shape.
    ///
    /// # Errors
    /// [`ScriptError::UnknownDrive`] if it is neither.
    pub fn with_shape(mut self, drive: &str, shape: Shape) -> Result<Self, ScriptError> {
        match drive {
            "hip" => self.hip = shape,
            "knee" => self.knee = shape,
            name => {
                return Err(ScriptError::UnknownDrive {
                    name: name.to_owned(),
                });
            }
        }
        Ok(self)
    }
}
