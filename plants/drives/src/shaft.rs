//! A motor with what hangs at its shaft.

use twinrig_actuator::{DcMotor, MotorLine};
use twinrig_robot::Motor;

use crate::error::DrivesError;
use crate::response::{Course, Response};

/// What hangs at a shaft, behind the gear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Inertia besides the rotor's \[kg·m²\].
    pub inertia: f64,
    /// Viscous friction \[N·m·s/rad\].
    pub friction: f64,
}

/// A motor and its load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaft {
    /// The motor with its gear.
    pub motor: Motor,
    /// What hangs at it.
    pub load: Load,
}

impl Shaft {
    /// A motor with nothing at its shaft.
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

/// A shaft ready for use: what never changes of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fixture {
    motor: DcMotor,
    inertia: f64,
    friction: f64,
}

/// How rates decay in a step, bridge open and bridge closed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Responses {
    open: Response,
    closed: Response,
}

/// What a shaft does while its inputs stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drive {
    line: MotorLine,
    /// The rate it tends to \[rad/s\].
    last: f64,
    bridge: Bridge,
}

/// What a bridge does to how rates decay.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Bridge {
    Open,
    Closed,
    /// Closed for a share of the time: a decay of its own \[1/s\].
    Between(f64),
}

/// A step of a shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Turn {
    pub(crate) rate: f64,
    pub(crate) turned: f64,
    /// Mean torque of the motor at the output \[N·m\].
    pub(crate) torque: f64,
    /// What the motor gave, and what friction took \[J\].
    pub(crate) given: f64,
    pub(crate) taken: f64,
}

impl Fixture {
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

    /// All that turns \[kg·m²\].
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

    /// Under a voltage \[V\] and a bridge, 0 … 1.
    pub(crate) fn drive(&self, voltage: f64, bridge: f64) -> Drive {
        let line = self.motor.line(voltage, bridge);
        let damping = line.damping + self.friction;
        // Nothing drives where nothing damps: then it turns on as it does.
        let last = if damping > 0.0 {
            line.torque / damping
        } else {
            0.0
        };
        let bridge = if bridge <= 0.0 {
            Bridge::Open
        } else if bridge >= 1.0 {
            Bridge::Closed
        } else {
            Bridge::Between(damping / self.inertia)
        };
        Drive { line, last, bridge }
    }

    /// A step of `seconds` from the rate `from` \[rad/s\].
    pub(crate) fn turn(
        &self,
        drive: &Drive,
        from: f64,
        responses: &Responses,
        seconds: f64,
    ) -> Turn {
        let between;
        let response = match drive.bridge {
            Bridge::Open => &responses.open,
            Bridge::Closed => &responses.closed,
            Bridge::Between(decay) => {
                between = Response::new(decay, seconds);
                &between
            }
        };
        let course = Course::new(from, drive.last, response, seconds);
        let MotorLine { torque, damping } = drive.line;
        Turn {
            rate: course.rate,
            turned: course.turned,
            torque: torque - damping * (course.turned / seconds),
            given: torque * course.turned - damping * course.squares,
            taken: self.friction * course.squares,
        }
    }
}

impl Drive {
    /// Whether a shaft that is at rest stays there, and nobody feels it.
    pub(crate) fn coasts(&self) -> bool {
        self.bridge == Bridge::Open
    }
}
