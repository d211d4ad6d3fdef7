//! Shaft: a motor with its load.

use twinrig_robot::Motor;

use super::error::DrivesError;
use super::response::{Course, Response};
use crate::{DcMotor, MotorLine};

/// Load of a shaft, behind the gear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Inertia without the rotor's \[kg·m²\].
    pub inertia: f64,
    /// Viscous friction \[N·m·s/rad\].
    pub friction: f64,
}

/// A motor and its load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaft {
    /// The motor with its gear.
    pub motor: Motor,
    /// The load.
    pub load: Load,
}

impl Shaft {
    /// Returns a motor without a load.
    pub const fn bare(motor: Motor) -> Self {
        Self {
            motor,
            load: Load {
                inertia: 0.0,
                friction: 0.0,
            },
        }
    }
}

/// Constant data of a shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShaftModel {
    motor: DcMotor,
    inertia: f64,
    friction: f64,
}

/// Responses of a step, with open and with closed bridge.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Responses {
    open: Response,
    closed: Response,
}

/// Motion of a shaft under constant inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drive {
    line: MotorLine,
    /// Final rate \[rad/s\].
    final_rate: f64,
    bridge: Bridge,
}

/// State of a bridge, which determines the decay of rates.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Bridge {
    Open,
    Closed,
    /// Closed for a share of the time: decay \[1/s\].
    Modulated(f64),
}

/// Result of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShaftStep {
    pub(crate) rate: f64,
    pub(crate) travel: f64,
    /// Mean torque of the motor at the output \[N·m\].
    pub(crate) torque: f64,
    /// Work of the motor, and work dissipated by friction \[J\].
    pub(crate) motor_work: f64,
    pub(crate) friction_work: f64,
}

impl ShaftModel {
    pub(crate) fn new(drive: &'static str, shaft: &Shaft) -> Result<Self, DrivesError> {
        let Load { inertia, friction } = shaft.load;
        for (what, value) in [("inertia", inertia), ("friction", friction)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(DrivesError::Load { drive, what, value });
            }
        }
        let motor = DcMotor::new(&shaft.motor).map_err(|why| DrivesError::Motor { drive, why })?;
        Ok(Self {
            motor,
            inertia: motor.inertia() + inertia,
            friction,
        })
    }

    /// Total inertia \[kg·m²\].
    pub(crate) fn inertia(&self) -> f64 {
        self.inertia
    }

    pub(crate) fn responses(&self, seconds: f64) -> Responses {
        let decay = |damping: f64| (damping + self.friction) / self.inertia;
        Responses {
            open: Response::new(decay(0.0), seconds),
            closed: Response::new(decay(self.motor.damping()), seconds),
        }
    }

    /// Motion at a voltage \[V\] and a bridge, 0 … 1.
    pub(crate) fn drive(&self, voltage: f64, bridge: f64) -> Drive {
        let line = self.motor.line(voltage, bridge);
        let damping = line.damping + self.friction;
        // Without damping there is no torque either, and the rate is constant.
        let final_rate = if damping > 0.0 {
            line.torque / damping
        } else {
            0.0
        };
        let bridge = if bridge <= 0.0 {
            Bridge::Open
        } else if bridge >= 1.0 {
            Bridge::Closed
        } else {
            Bridge::Modulated(damping / self.inertia)
        };
        Drive {
            line,
            final_rate,
            bridge,
        }
    }

    /// Advances by `seconds` from the rate `from` \[rad/s\].
    pub(crate) fn step(
        &self,
        drive: &Drive,
        from: f64,
        responses: &Responses,
        seconds: f64,
    ) -> ShaftStep {
        let modulated;
        let response = match drive.bridge {
            Bridge::Open => &responses.open,
            Bridge::Closed => &responses.closed,
            Bridge::Modulated(decay) => {
                modulated = Response::new(decay, seconds);
                &modulated
            }
        };
        let course = Course::new(from, drive.final_rate, response, seconds);
        let MotorLine { torque, damping } = drive.line;
        ShaftStep {
            rate: course.rate,
            travel: course.travel,
            torque: torque - damping * (course.travel / seconds),
            motor_work: torque * course.travel - damping * course.squares,
            friction_work: self.friction * course.squares,
        }
    }
}

impl Drive {
    /// Whether a shaft at rest stays at rest without effect.
    pub(crate) fn coasts(&self) -> bool {
        self.bridge == Bridge::Open
    }
}
