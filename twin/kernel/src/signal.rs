//! Standard signals: the one place where their names are spelled.
//!
//! A signal of a leg is `leg/NAME/…`; tables and constants of legs have the part after the name.
//!
//! ```
//! use twinrig_kernel::signal;
//!
//! assert_eq!(signal::of_leg("LF", signal::FOOT_LOAD), "leg/LF/foot/load");
//! assert_eq!(signal::parse_leg("leg/LF/foot/load"), Some(("LF", "foot/load")));
//! assert_eq!(signal::parse_leg(signal::BODY_POSITION), None);
//! ```

use crate::{Port, Unit};

/// Prefix of the signals of legs.
pub const LEG_PREFIX: &str = "leg/";
/// Prefix of the signals of motors that drive no leg.
pub const MOTOR_PREFIX: &str = "motor/";
/// Prefix of the terms of the energy balance.
pub const ENERGY_PREFIX: &str = "energy/";

/// Position of the trunk's centre of mass, world frame.
pub const BODY_POSITION: &str = "body/position";
/// Attitude of the trunk as a quaternion w, x, y, z.
pub const BODY_ORIENTATION: &str = "body/orientation";
/// Roll, pitch and yaw of the trunk.
pub const BODY_RPY: &str = "body/rpy";
/// Velocity of the trunk's centre of mass, world frame.
pub const BODY_VELOCITY: &str = "body/velocity";
/// Angular velocity of the trunk.
pub const BODY_ANGULAR_VELOCITY: &str = "body/angular_velocity";
/// Force of the ground on the trunk, world frame; a signal of plants with that contact only.
pub const BODY_CONTACT_FORCE: &str = "body/contact/force";
/// Force and torque of pushes on the trunk, world frame, means over the observation window.
pub const BODY_PUSH_FORCE: &str = "body/push/force";
/// See [`BODY_PUSH_FORCE`]; without the torque of forces beside the centre of mass.
pub const BODY_PUSH_TORQUE: &str = "body/push/torque";
/// Work of pushes; a signal of plants with pushes only.
pub const ENERGY_EXTERNAL: &str = "energy/external";
/// Residual of the energy balance.
pub const ENERGY_RESIDUAL: &str = "energy/residual";

/// Angle of the hip drive.
pub const HIP_POSITION: &str = "hip/position";
/// Angular velocity of the hip drive.
pub const HIP_RATE: &str = "hip/rate";
/// Torque of the hip drive.
pub const HIP_TORQUE: &str = "hip/torque";
/// Angle of the knee drive.
pub const KNEE_POSITION: &str = "knee/position";
/// Angular velocity of the knee drive.
pub const KNEE_RATE: &str = "knee/rate";
/// Torque of the knee drive.
pub const KNEE_TORQUE: &str = "knee/torque";
/// Angle and torque of the drives.
pub const DRIVES: [(&str, &str); 2] = [(HIP_POSITION, HIP_TORQUE), (KNEE_POSITION, KNEE_TORQUE)];
/// Angle of abduction of the hip, positive to the left.
pub const ABDUCTION_POSITION: &str = "abduction/position";
/// Torque of its drive.
pub const ABDUCTION_TORQUE: &str = "abduction/torque";
/// Angular velocity of abduction.
pub const ABDUCTION_RATE: &str = "abduction/rate";
/// Angles of hip, knee and ankle.
pub const ANGLES: &str = "angles";
/// Position of the foot, world frame.
pub const FOOT_POSITION: &str = "foot/position";
/// Normal force of the ground on the foot.
pub const FOOT_LOAD: &str = "foot/load";
/// Force of the ground on the foot, world frame.
pub const FOOT_FORCE: &str = "foot/force";
/// Force of the ground on knee and ankle, world frame; a signal of plants with that contact only.
pub const SEGMENTS_FORCE: &str = "segments/force";
/// Height of the contact point of the foot above the ground, along its normal.
pub const FOOT_CLEARANCE: &str = "foot/clearance";
/// Force of pushes on the foot, world frame, mean over the observation window.
pub const PUSH_FORCE: &str = "push/force";
/// Phase of a leg's controller: swing from 0 to π, stance from π to 2π.
pub const PHASE: &str = "phase";

/// Greatest magnitude of the commanded angle of a joint \[rad\]: 16 turns, more than any drive with
/// a pose can mean. A drive that turns on is commanded by its rate.
pub const COMMAND_ANGLE_MAX: f64 = 100.0;

/// Declaration of a standard signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standard {
    /// Name.
    pub name: &'static str,
    /// Unit of every component.
    pub unit: Unit,
    /// Number of components.
    pub size: usize,
    /// Name of the signal of which it is the time derivative.
    pub rate_of: Option<&'static str>,
}

const fn plain(name: &'static str, unit: Unit, size: usize) -> Standard {
    Standard {
        name,
        unit,
        size,
        rate_of: None,
    }
}

const fn rate(name: &'static str, unit: Unit, size: usize, of: &'static str) -> Standard {
    Standard {
        rate_of: Some(of),
        ..plain(name, unit, size)
    }
}

/// Motion of the trunk.
pub const BODY: [Standard; 6] = [
    plain(BODY_POSITION, Unit::Meter, 3),
    plain(BODY_ORIENTATION, Unit::One, 4),
    plain(BODY_RPY, Unit::Radian, 3),
    rate(BODY_VELOCITY, Unit::MeterPerSecond, 3, BODY_POSITION),
    plain(BODY_ANGULAR_VELOCITY, Unit::RadianPerSecond, 3),
    plain(BODY_CONTACT_FORCE, Unit::Newton, 3),
];

/// Energy balance.
pub const ENERGY: [Standard; 8] = [
    plain("energy/kinetic", Unit::Joule, 1),
    plain("energy/spring", Unit::Joule, 1),
    plain("energy/gravity", Unit::Joule, 1),
    plain("energy/dissipated", Unit::Joule, 1),
    plain("energy/actuator", Unit::Joule, 1),
    plain("energy/impact", Unit::Joule, 1),
    plain("energy/exchanged", Unit::Joule, 1),
    plain(ENERGY_RESIDUAL, Unit::Joule, 1),
];

/// Measurements of a leg.
pub const LEG: [Standard; 23] = [
    plain(HIP_POSITION, Unit::Radian, 1),
    rate(HIP_RATE, Unit::RadianPerSecond, 1, HIP_POSITION),
    plain(HIP_TORQUE, Unit::NewtonMeter, 1),
    plain(KNEE_POSITION, Unit::Radian, 1),
    rate(KNEE_RATE, Unit::RadianPerSecond, 1, KNEE_POSITION),
    plain(KNEE_TORQUE, Unit::NewtonMeter, 1),
    plain("cable/tension", Unit::Newton, 1),
    plain(ANGLES, Unit::Radian, 3),
    plain(FOOT_POSITION, Unit::Meter, 3),
    rate("foot/velocity", Unit::MeterPerSecond, 3, FOOT_POSITION),
    plain(FOOT_LOAD, Unit::Newton, 1),
    plain(FOOT_FORCE, Unit::Newton, 3),
    plain(FOOT_CLEARANCE, Unit::Meter, 1),
    plain(ABDUCTION_POSITION, Unit::Radian, 1),
    plain(ABDUCTION_TORQUE, Unit::NewtonMeter, 1),
    plain(SEGMENTS_FORCE, Unit::Newton, 3),
    rate(ABDUCTION_RATE, Unit::RadianPerSecond, 1, ABDUCTION_POSITION),
    plain("hip/current", Unit::Ampere, 1),
    plain("knee/current", Unit::Ampere, 1),
    plain("abduction/current", Unit::Ampere, 1),
    plain("hip/supply", Unit::Volt, 1),
    plain("knee/supply", Unit::Volt, 1),
    plain("abduction/supply", Unit::Volt, 1),
];

impl Standard {
    /// Returns the output of a plant.
    #[must_use]
    pub fn output(&self) -> Port {
        self.named(str::to_owned)
    }

    /// Returns the output of a plant for a leg.
    #[must_use]
    pub fn output_of_leg(&self, leg: &str) -> Port {
        self.named(|name| of_leg(leg, name))
    }

    fn named(&self, name: impl Fn(&str) -> String) -> Port {
        let port = Port::output(name(self.name), self.unit, self.size);
        match self.rate_of {
            Some(of) => port.rate_of(name(of)),
            None if self.name == BODY_ORIENTATION => port.rotation(),
            None => port,
        }
    }
}

/// Returns the path of a leg: `leg/LF`.
#[must_use]
pub fn leg_path(leg: &str) -> String {
    format!("{LEG_PREFIX}{leg}")
}

/// Returns the name of a signal of a leg.
#[must_use]
pub fn of_leg(leg: &str, name: &str) -> String {
    format!("{LEG_PREFIX}{leg}/{name}")
}

/// Returns the name of the command of a joint: `leg/LF/hip/command`.
#[must_use]
pub fn command(leg: &str, joint: &str) -> String {
    of_leg(leg, &format!("{joint}/command"))
}

/// Returns the greatest magnitude of the values of this port, which is known of the commanded
/// angles of joints ([`COMMAND_ANGLE_MAX`]).
#[must_use]
pub fn magnitude_max(port: &Port) -> Option<f64> {
    let is_command = parse_leg(&port.name).is_some_and(|(_, rest)| rest.ends_with("/command"));
    (is_command && port.unit == Unit::Radian).then_some(COMMAND_ANGLE_MAX)
}

/// Returns the name of a signal of a motor that drives no leg: `motor/cam/position`.
#[must_use]
pub fn of_motor(motor: &str, name: &str) -> String {
    format!("{MOTOR_PREFIX}{motor}/{name}")
}

/// Splits the name of a signal of a motor on a free shaft into the motor and the rest.
#[must_use]
pub fn parse_motor(name: &str) -> Option<(&str, &str)> {
    name.strip_prefix(MOTOR_PREFIX)?.split_once('/')
}

/// Splits the name of a signal of a leg into the leg and the rest.
#[must_use]
pub fn parse_leg(name: &str) -> Option<(&str, &str)> {
    name.strip_prefix(LEG_PREFIX)?.split_once('/')
}

/// Replaces leg names in a signal name by `*`, so that signals of all legs share a line.
pub fn folded(signal: &str, legs: &[impl AsRef<str>]) -> String {
    let part = |part| {
        if legs.iter().any(|leg| leg.as_ref() == part) {
            "*"
        } else {
            part
        }
    };
    signal.split('/').map(part).collect::<Vec<_>>().join("/")
}
