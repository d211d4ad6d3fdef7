//! Parameters of a servo on its bench.

use twinrig_document::declaration::{Defaulted, Type, quantity, record};
use twinrig_kernel::Unit;
use twinrig_robot::serial::{Controller, Friction, Gear, ServoMotor, Supply};

use crate::ranges;

record! {
    /// A servo that moves a mass on an arm, read from a file of `benches/`.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ServoBenchParameters = "bench of a servo" {
        /// Name, for reports.
        pub name: String = Type::TEXT,
        /// Arm and mass.
        pub load: BenchLoad = BenchLoad::TYPE,
        /// Power supply.
        pub supply: Supply = Supply::TYPE,
        /// Motor with its gear.
        pub motor: ServoMotor = ServoMotor::TYPE,
        /// Friction by the torques of motor and load.
        pub friction: Friction = Friction::TYPE,
        /// Backlash, and losses of the gear by the torque that it transmits.
        pub gear: Gear = Defaulted(Gear::TYPE, Gear::IDEAL, "no backlash, no losses"),
        /// Position controller.
        pub controller: Controller = Controller::TYPE,
    }
}

record! {
    /// Arm and mass on the shaft of the servo.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct BenchLoad = "[load]" {
        /// Mass at the end of the arm \[kg\].
        pub mass: f64 = quantity(Unit::Kilogram, ranges::MASS),
        /// Length of the arm \[m\].
        pub length: f64 = quantity(Unit::Meter, ranges::LENGTH),
        /// Mass of the arm, evenly along its length \[kg\].
        pub arm_mass: f64 = Defaulted(quantity(Unit::Kilogram, ranges::MASS), 0.0, "0"),
        /// Angle by which the zero of the encoder is before the lowest position of the arm
        /// \[rad\].
        pub offset: f64 = Defaulted(quantity(Unit::Radian, ranges::OFFSET), 0.0, "0"),
    }
}
