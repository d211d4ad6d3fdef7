//! Dimensions of units.

use crate::unit::Unit;

/// Exponents of the base units kg, m, s, A, K and rad.
pub type BaseExponents = [i32; 6];

/// Units of which symbols are composed.
const ATOMS: [(&str, BaseExponents); 18] = [
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

impl Unit {
    /// Returns the exponents of the base units, of which FMI counts the radian as one:
    ///
    /// ```
    /// use twinrig_kernel::Unit;
    ///
    /// assert_eq!(Unit::NewtonMeterPerRadian.base_exponents(), [1, 2, -2, 0, 0, -1]);
    /// ```
    pub fn base_exponents(self) -> BaseExponents {
        // The symbol has products before and after one stroke, the latter perhaps in parentheses.
        let (numerator, denominator) = match self.symbol().split_once('/') {
            Some((numerator, denominator)) => (numerator, Some(denominator)),
            None => (self.symbol(), None),
        };
        let denominator = denominator.map(|text| text.trim_matches(['(', ')']));
        let mut sum = [0; 6];
        let numerator = numerator.split('·').map(|factor| (factor, 1));
        let denominator = denominator.into_iter().flat_map(|text| text.split('·'));
        for (factor, sign) in numerator.chain(denominator.map(|factor| (factor, -1))) {
            let (symbol, power) = match factor.strip_suffix('²') {
                Some(symbol) => (symbol, 2 * sign),
                None => (factor, sign),
            };
            let exponents = ATOMS.iter().find(|(known, _)| *known == symbol);
            debug_assert!(exponents.is_some(), "{symbol} has no exponents");
            for (sum, exponent) in sum.iter_mut().zip(exponents.map_or([0; 6], |(_, it)| *it)) {
                *sum += power * exponent;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(unit: Unit) -> BaseExponents {
        unit.base_exponents()
    }

    fn times(a: BaseExponents, b: BaseExponents) -> BaseExponents {
        std::array::from_fn(|n| a[n] + b[n])
    }

    #[test]
    fn every_symbol_has_exponents() {
        let plain = [Unit::One, Unit::Hertz, Unit::BitPerSecond].map(of);
        assert_eq!(plain, [[0; 6], [0, 0, -1, 0, 0, 0], [0, 0, -1, 0, 0, 0]]);
        for unit in Unit::ALL {
            assert!(*unit == Unit::One || of(*unit) != [0; 6], "{unit}");
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
                times(of(Unit::RadianPerNewtonSecond), of(Unit::Newton)),
                of(Unit::RadianPerSecond),
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
