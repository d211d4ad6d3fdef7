//! Units in model descriptions.

use twinrig_kernel::Unit;

/// Names of the base units in FMI, in the order of [`Unit::base_exponents`].
pub(crate) const BASE: [&str; 6] = ["kg", "m", "s", "A", "K", "rad"];

/// Returns the name of the quantity with this unit, also that of its declared type.
pub(crate) fn quantity(unit: Unit) -> &'static str {
    match unit {
        Unit::One => "Number",
        Unit::Radian => "Angle",
        Unit::RadianPerSecond => "AngularVelocity",
        Unit::RadianPerSecondSquared => "AngularAcceleration",
        Unit::RadianPerNewtonSecond => "AngularVelocityPerForce",
        Unit::Meter => "Length",
        Unit::MeterPerSecond => "Velocity",
        Unit::MeterPerSecondSquared => "Acceleration",
        Unit::Newton => "Force",
        Unit::NewtonPerSecond => "ForceRate",
        Unit::NewtonSecond => "Impulse",
        Unit::NewtonMeter => "Torque",
        Unit::NewtonPerMeter => "Stiffness",
        Unit::NewtonSecondPerMeter => "Damping",
        Unit::NewtonMeterPerRadian => "RotationalStiffness",
        Unit::NewtonMeterSecondPerRadian => "RotationalDamping",
        Unit::Joule => "Energy",
        Unit::Watt => "Power",
        Unit::Kilogram => "Mass",
        Unit::KilogramSquareMeter => "MomentOfInertia",
        Unit::Second => "Time",
        Unit::Hertz => "Frequency",
        Unit::BitPerSecond => "DataRate",
        Unit::Volt => "Voltage",
        Unit::Ampere => "Current",
        Unit::Ohm => "Resistance",
        Unit::Siemens => "Conductance",
        Unit::SiemensPerNewton => "PiezoresistiveSensitivity",
        Unit::VoltSecondPerNewton => "PiezoelectricSensitivity",
        Unit::NewtonMeterPerAmpere => "TorqueConstant",
        Unit::Pascal => "Pressure",
        Unit::Kelvin => "Temperature",
        Unit::JoulePerKelvin => "HeatCapacity",
        // A unit of a later kernel.
        _ => "Quantity",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_has_its_own_quantity() {
        for (n, unit) in Unit::ALL.iter().enumerate() {
            let mut others = Unit::ALL[..n].iter();
            let of_other = others.find(|other| quantity(**other) == quantity(*unit));
            assert_eq!(of_other, None, "{unit}");
        }
    }
}
