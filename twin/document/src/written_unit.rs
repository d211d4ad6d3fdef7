//! Units of numbers without text, as other programs write them.

use twinrig_kernel::Unit;

use crate::quantity::{self, QuantityError};
use crate::units::{self, Scale};

/// Unit of the numbers of another program, with its conversion to the SI unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrittenUnit {
    /// The SI unit of the same quantity.
    pub unit: Unit,
    multiplier: f64,
    divisor: f64,
}

impl WrittenUnit {
    /// Returns the unit of a spelling, such as `mV`; `1` and the empty spelling are a plain number.
    ///
    /// ```
    /// use twinrig_document::WrittenUnit;
    /// use twinrig_kernel::Unit;
    ///
    /// let unit = WrittenUnit::parse("mV").unwrap();
    /// assert_eq!((unit.unit, unit.to_si(12_300.0)), (Unit::Volt, 12.3));
    /// assert!(WrittenUnit::parse("mVolt").is_err());
    /// ```
    ///
    /// # Errors
    /// The unit is not known.
    pub fn parse(spelling: &str) -> Result<Self, QuantityError> {
        let spelling = if spelling == "1" { "" } else { spelling };
        let unit = quantity::any_unit(&format!("1 {spelling}"))?;
        let kind = units::kind(unit);
        let scale = kind.and_then(|kind| units::scale(kind, spelling));
        let (multiplier, divisor) = match scale.unwrap_or(Scale::Ten(0)) {
            Scale::Factor(factor) => (factor, 1.0),
            Scale::Ten(shift) if shift < 0 => (1.0, ten_to(-shift)),
            Scale::Ten(shift) => (ten_to(shift), 1.0),
        };
        Ok(Self {
            unit,
            multiplier,
            divisor,
        })
    }

    /// Converts a number to the SI unit, by one multiplication or one division: of a unit whose
    /// factor is a power of ten, the result is the nearest number.
    pub fn to_si(self, number: f64) -> f64 {
        number * self.multiplier / self.divisor
    }

    /// Power of ten from this unit to the SI unit: −3 for milliseconds; none for other factors.
    pub fn power_of_ten(self) -> Option<i32> {
        (0..=MOST).find_map(|power| {
            let same = |number: f64| number == ten_to(power);
            match (same(self.multiplier), same(self.divisor)) {
                (true, _) if self.divisor == 1.0 => Some(power),
                (_, true) if self.multiplier == 1.0 => Some(-power),
                _ => None,
            }
        })
    }
}

/// Greatest power of ten between a spelling and its SI unit.
const MOST: i32 = 9;

/// Returns a power of ten, which is exact up to 10²².
fn ten_to(power: i32) -> f64 {
    (0..power).fold(1.0, |product, _| product * 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::KINDS;

    #[test]
    fn numbers_convert_like_quantities_in_text() {
        for kind in KINDS {
            for (spelling, scale) in kind.spellings {
                let unit = WrittenUnit::parse(spelling).unwrap();
                let written = format!("12.6 {spelling}");
                let quantity = quantity::parse_quantity(&written, kind.unit).unwrap();
                assert_eq!(
                    (unit.unit, unit.to_si(12.6)),
                    (kind.unit, quantity),
                    "{written}"
                );
                let power = match scale {
                    Scale::Ten(power) => Some(*power),
                    Scale::Factor(_) => None,
                };
                assert_eq!(unit.power_of_ten(), power, "{written}");
            }
        }
    }

    #[test]
    fn misspelt_unit_is_refused() {
        for spelling in ["mVolt", "5 mm", "e3", "furlong"] {
            assert!(WrittenUnit::parse(spelling).is_err(), "{spelling}");
        }
        assert_eq!(WrittenUnit::parse("1").unwrap().unit, Unit::One);
    }
}
