//! Units in model descriptions: exponents of the base units, and the name of the quantity.

use twinrig_kernel::Unit;

/// Base units of FMI, in the order of the exponents.
pub(crate) const BASE: [&str; 6] = ["kg", "m", "s", "A", "K", "rad"];

/// Exponents of the base units.
pub(crate) type Exponents = [i32; 6];

/// Units of which symbols are composed.
const ATOMS: [(&str, Exponents); 18] = [
    ("1", [0, 0, 0, 0, 0, 0]),
    ("bit", [0, 0, 0, 0, 0, 0]),
    ("kg", [1, 0, 0, 0, 0, 0]),
    ("m", [0, 1, 0, 0, 0, 0]),
    ("s", [0, 0, 1, 0, 0, 0]),
    ("A", [0, 0, 0, 1, 0, 0]),
    ("K", [0, 0, 0, 0, 1, 0]),
    ("rad", [0, 0, 0, 0, 0, 1]),
    ("Hz", [0, 0, -1, 0, 0, 0]),
    ("N", [1, 1, -2, 0, 0, 0]),
    ("Pa", [1, -1, -2, 0, 0, 0]),
    ("J", [1, 2, -2, 0, 0, 0]),
    ("W", [1, 2, -3, 0, 0, 0]),
    ("V", [1, 2, -3, -1, 0, 0]),
    ("Ω", [1, 2, -3, -2, 0, 0]),
    ("S", [-1, -2, 3, 2, 0, 0]),
    ("C", [0, 0, 1, 1, 0, 0]),
    ("F", [-1, -2, 4, 2, 0, 0]),
];

/// Returns the exponents of the base units, from the symbol: products before and after one stroke;
/// none for a symbol with another atom.
pub(crate) fn exponents(unit: Unit) -> Option<Exponents> {
    let (numerator, denominator) = match unit.symbol().split_once('/') {
        Some((numerator, denominator)) => (numerator, Some(denominator)),
        None => (unit.symbol(), None),
    };
    let mut sum = [0; 6];
    let numerator = numerator.split('·').map(|factor| (factor, 1));
    let denominator = denominator.into_iter().flat_map(|text| text.split('·'));
    for (factor, sign) in numerator.chain(denominator.map(|factor| (factor, -1))) {
        let (symbol, power) = match factor.strip_suffix('²') {
            Some(symbol) => (symbol, 2 * sign),
            None => (factor, sign),
        };
        let (_, atom) = ATOMS.iter().find(|(known, _)| *known == symbol)?;
        for (sum, exponent) in sum.iter_mut().zip(atom) {
            *sum += power * exponent;
        }
    }
    Some(sum)
}

/// Returns the name of the quantity with this unit, also that of its declared type.
pub(crate) fn quantity(unit: Unit) -> &'static str {
    match unit {
        Unit::One => "Number",
        Unit::Radian => "Angle",
        Unit::RadianPerSecond => "AngularVelocity",
        Unit::RadianPerSecondSquared => "AngularAcceleration",
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
        // A unit of a later kernel.
        _ => "Quantity",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(unit: Unit) -> Exponents {
        exponents(unit).unwrap()
    }

    fn times(a: Exponents, b: Exponents) -> Exponents {
        std::array::from_fn(|n| a[n] + b[n])
    }

    #[test]
    fn every_unit_has_exponents_and_its_own_quantity() {
        for (n, unit) in Unit::ALL.iter().enumerate() {
            assert!(exponents(*unit).is_some(), "{unit}");
            let mut others = Unit::ALL[..n].iter();
            let of_other = others.find(|other| quantity(**other) == quantity(*unit));
            assert_eq!(of_other, None, "{unit}");
        }
    }

    #[test]
    fn exponents_obey_the_laws_of_physics() {
        let laws = [
            // Work, power, Ohm's law, conductance, pressure.
            (times(of(Unit::Newton), of(Unit::Meter)), of(Unit::Joule)),
            (times(of(Unit::Volt), of(Unit::Ampere)), of(Unit::Watt)),
            (times(of(Unit::Watt), of(Unit::Second)), of(Unit::Joule)),
            (times(of(Unit::Ohm), of(Unit::Ampere)), of(Unit::Volt)),
            (times(of(Unit::Siemens), of(Unit::Ohm)), of(Unit::One)),
            (
                times(times(of(Unit::Pascal), of(Unit::Meter)), of(Unit::Meter)),
                of(Unit::Newton),
            ),
            // Momentum, springs, dampers, motors.
            (
                times(of(Unit::Kilogram), of(Unit::MeterPerSecond)),
                of(Unit::NewtonSecond),
            ),
            (
                times(of(Unit::NewtonPerMeter), of(Unit::Meter)),
                of(Unit::Newton),
            ),
            (
                times(of(Unit::NewtonSecondPerMeter), of(Unit::MeterPerSecond)),
                of(Unit::Newton),
            ),
            (
                times(
                    of(Unit::NewtonMeterSecondPerRadian),
                    of(Unit::RadianPerSecond),
                ),
                of(Unit::NewtonMeter),
            ),
            (
                times(of(Unit::NewtonMeterPerAmpere), of(Unit::Ampere)),
                of(Unit::NewtonMeter),
            ),
            (
                times(of(Unit::SiemensPerNewton), of(Unit::Newton)),
                of(Unit::Siemens),
            ),
            (
                times(of(Unit::VoltSecondPerNewton), of(Unit::NewtonPerSecond)),
                of(Unit::Volt),
            ),
        ];
        for (n, (left, right)) in laws.into_iter().enumerate() {
            assert_eq!(left, right, "law {n}");
        }
    }
}
