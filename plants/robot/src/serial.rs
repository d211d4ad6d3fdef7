//! Serial servos: a position controller in firmware, a bridge at a supply with resistance, a
//! direct-current motor whose winding heats up, and a gear with friction. The drive of a leg and of
//! a bench have the same parameters; the dynamics are in the crates of the plants.

mod friction;
mod ranges;

use twinrig_document::declaration::{Defaulted, Optional, Type, quantity, record};
use twinrig_document::{Reported, Table};
use twinrig_kernel::Unit;

pub use friction::{Friction, Gear};
use ranges::zero;

record! {
    /// Serial servo of hip and knee of all legs.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SerialServo = "[serial]", checked by check_in_leg {
        /// Power supply of each servo.
        pub supply: Supply = Supply::TYPE,
        /// Motor with its gear.
        pub motor: ServoMotor = ServoMotor::TYPE,
        /// Friction by the torques of motor and load.
        pub friction: Friction = Friction::TYPE,
        /// Losses of the gear by the torque that it transmits.
        pub gear: Gear = Defaulted(Gear::TYPE, Gear::IDEAL, "no losses"),
        /// Position controller.
        pub controller: Controller = Controller::TYPE,
    }
}

/// Refuses a gear that legs do not have.
fn check_in_leg(table: &Table<'_>, servo: &SerialServo) -> Result<(), Reported> {
    if servo.gear.backlash == 0.0 {
        return Ok(());
    }
    let message = "the gear of a servo in a leg has no backlash";
    let help = "leave `backlash` out, or write gear.backlash = \"0 deg\" beside a bench";
    Err(table.report("gear", message, help))
}

record! {
    /// Power supply.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Supply = "supply" {
        /// Voltage without load \[V\].
        pub voltage: f64 = quantity(Unit::Volt, ranges::VOLTAGE),
        /// Resistance of supply, cable and fuse before the bridge \[Ω\].
        pub resistance: f64 = zero(quantity(Unit::Ohm, ranges::SERIES_RESISTANCE)),
    }
}

record! {
    /// Direct-current motor; torques, rates and inertia refer to the output of its gear.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ServoMotor = "servo motor" {
        /// Resistance of winding and bridge, cold \[Ω\].
        pub resistance: f64 = quantity(Unit::Ohm, ranges::RESISTANCE),
        /// Torque per current, and induced voltage per rate \[N·m/A = V·s/rad\].
        pub torque_constant: f64 = quantity(Unit::NewtonMeterPerAmpere, ranges::TORQUE_CONSTANT),
        /// Inertia of rotor and gear \[kg·m²\].
        pub inertia: f64 = quantity(Unit::KilogramSquareMeter, ranges::INERTIA),
        /// Greatest current; without it there is no limit \[A\].
        pub current_limit: Option<f64> = Optional(quantity(Unit::Ampere, ranges::CURRENT)),
        /// Current at which the torque is half of the product of torque constant and current, as
        /// iron saturates: τ = k I/(1 + |I|/I_s); without it the torque is in proportion \[A\].
        pub saturation_current: Option<f64> =
            Optional(quantity(Unit::Ampere, ranges::SATURATION)),
        /// Voltage of the two diodes through which an open bridge conducts into the supply what the
        /// motor induces above both; without it an open bridge has no current \[V\].
        pub diode_voltage: Option<f64> = Optional(quantity(Unit::Volt, ranges::DIODES)),
        /// Heating of the winding; without it the resistance is constant.
        pub heating: Option<Heating> = Optional(Heating::TYPE),
    }
}

record! {
    /// Heating of a winding of copper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Heating = "heating" {
        /// Heat capacity of the winding \[J/K\].
        pub capacity: f64 = quantity(Unit::JoulePerKelvin, ranges::HEAT_CAPACITY),
        /// Time constant with which the winding cools; without it, it keeps its heat \[s\].
        pub cooling: Option<f64> = Optional(quantity(Unit::Second, ranges::COOLING)),
    }
}

record! {
    /// Position controller of the firmware: a duty cycle in proportion to the error of position.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Controller = "controller", checked by check_counts {
        /// Register of the gain.
        pub gain: f64 = quantity(Unit::One, ranges::GAIN),
        /// Duty cycle for a gain of 1 and an error of one count \[1\].
        pub duty_per_count: f64 = quantity(Unit::One, ranges::DUTY),
        /// Error of position without a duty cycle, which begins behind it \[counts\].
        pub dead_zone: f64 = zero(quantity(Unit::One, ranges::DEAD_ZONE)),
        /// Duty cycle at the end of the dead zone \[1\].
        pub starting_duty: f64 = zero(quantity(Unit::One, ranges::STARTING_DUTY)),
        /// Greatest duty cycle \[1\].
        pub duty_limit: f64 = Defaulted(quantity(Unit::One, ranges::DUTY), 1.0, "1"),
        /// Counts of the encoder in a turn.
        pub counts: u64 = Type::NATURAL,
        /// Whether the controller knows the position in whole counts.
        pub quantized: bool = Defaulted(Type::BOOLEAN, true, "true"),
        /// Period of the controller \[s\].
        pub period: f64 = quantity(Unit::Second, ranges::PERIOD),
        /// Time from the arrival of a command to its effect \[s\].
        pub command_delay: f64 = zero(quantity(Unit::Second, ranges::DELAY)),
        /// Age of a position when it is read, on a bench \[s\].
        pub reading_delay: f64 = zero(quantity(Unit::Second, ranges::DELAY)),
        /// Greatest speed of the set-point; without it the set-point is the command \[rad/s\].
        pub profile_speed: Option<f64> = Optional(quantity(Unit::RadianPerSecond, ranges::SPEED)),
        /// Greatest acceleration of the set-point \[rad/s²\].
        pub profile_acceleration: Option<f64> =
            Optional(quantity(Unit::RadianPerSecondSquared, ranges::ACCELERATION)),
    }
}

/// Checks that the encoder has counts.
fn check_counts(table: &Table<'_>, controller: &Controller) -> Result<(), Reported> {
    if ranges::COUNTS.contains(&controller.counts) {
        return Ok(());
    }
    let message = format!("an encoder does not have {} counts", controller.counts);
    Err(table.report("counts", message, "expected 1 to 16777216"))
}
