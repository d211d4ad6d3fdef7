//! Drives of the robot: the table `[actuator]`.

use twinrig_kernel::SimDuration;

use crate::language::Words;

/// `[actuator]`
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActuatorSpec {
    /// Actuator model.
    pub kind: ActuatorKind,
    /// Place of the firmware of serial servos.
    pub firmware: FirmwarePlace,
    /// Course of the set-points between commands; none for the default, which depends on the plant.
    pub set_point: Option<SetPointKind>,
    /// Overrides of the parameters of the hip servos.
    pub hip: ServoOverride,
    /// Overrides of the parameters of the knee servos.
    pub knee: ServoOverride,
}

/// Model of the actuator between a command and a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ActuatorKind {
    /// No motors and no cables.
    None,
    /// The joint follows its command exactly.
    Ideal,
    /// A position servo with lag, limits and dead band.
    #[default]
    Servo,
    /// A direct-current motor driven by the output voltage of a board.
    Motor,
    /// A serial servo: a motor with supply and gear, under the position controller of its firmware.
    Serial,
}

impl ActuatorKind {
    /// Returns the name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Ideal => "ideal",
            Self::Servo => "servo",
            Self::Motor => "motor",
            Self::Serial => "serial",
        }
    }

    /// Returns whether the drives have set-points.
    pub const fn has_set_points(self) -> bool {
        matches!(self, Self::Ideal | Self::Servo)
    }
}

impl Words for ActuatorKind {
    const WORDS: &'static [(&'static str, Self)] = &[
        (Self::Servo.name(), Self::Servo),
        (Self::Ideal.name(), Self::Ideal),
        (Self::None.name(), Self::None),
        (Self::Motor.name(), Self::Motor),
        (Self::Serial.name(), Self::Serial),
    ];
}

/// Place of the firmware of serial servos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FirmwarePlace {
    /// In the plant, which follows commands.
    #[default]
    Plant,
    /// In the emulated servos of a bus.
    Bus,
}

impl FirmwarePlace {
    /// Returns the name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plant => "plant",
            Self::Bus => "bus",
        }
    }
}

impl Words for FirmwarePlace {
    const WORDS: &'static [(&'static str, Self)] = &[
        (Self::Plant.name(), Self::Plant),
        (Self::Bus.name(), Self::Bus),
    ];
}

/// Course of the set-points of servos from one command to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetPointKind {
    /// The last command.
    Held,
    /// Linear approach to the last command over one control period.
    Linear,
}

impl SetPointKind {
    /// Returns the name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Linear => "linear",
        }
    }

    /// Returns the delays of the motion that this course adds to held set-points, for a control
    /// period: in the mean, and at most.
    pub fn added_delays(self, period: SimDuration) -> [SimDuration; 2] {
        match self {
            Self::Held => [SimDuration::ZERO; 2],
            Self::Linear => [period / 2, period],
        }
    }
}

impl Words for SetPointKind {
    const WORDS: &'static [(&'static str, Self)] = &[
        (Self::Held.name(), Self::Held),
        (Self::Linear.name(), Self::Linear),
    ];
}

/// Parameters of a servo that override those of the robot file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoOverride {
    /// \[s\]
    pub lag: Option<f64>,
    /// \[rad/s\]
    pub speed: Option<f64>,
    /// \[N·m\]
    pub torque: Option<f64>,
    /// \[rad\]
    pub dead_band: Option<f64>,
}
