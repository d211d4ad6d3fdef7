//! Fixed parameters of a script.

use crate::{ScriptError, Shape};

/// Parameters of a script that are constant while it runs. All others are process variables
/// ([`crate::Script`]).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plan {
    /// Shape of the hips.
    pub hip: Shape,
    /// Shape of the knees.
    pub knee: Shape,
    /// Phase lag of each leg relative to the one before it, in the robot's order, which starts with
    /// 0 \[rad\]. Legs that are not commanded count. Within ±[`Plan::PHASE_LAG_MAX`].
    pub phase_lag: f64,
    /// Whether hip abduction is commanded, too, by a constant.
    pub abduction: bool,
}

impl Plan {
    /// Greatest phase lag \[rad\]: a thousand radians are 159 cycles.
    pub const PHASE_LAG_MAX: f64 = 1000.0;

    /// Sets the shape of `drive`, which is `hip` or `knee`.
    ///
    /// # Errors
    /// [`ScriptError::UnknownDrive`] for any other drive.
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
