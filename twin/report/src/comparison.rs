//! Units and digits of a measured value beside its bounds.

use std::f64::consts::PI;

/// Maximum relative rounding error of the common number of decimals of a row; numbers that exceed
/// it are formatted individually, so that a bound of 1e-6 is not shown as 0.
const ROUNDING_MAX: f64 = 0.2;

/// A measured value and its bounds, in a coherent unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Measured value.
    pub measured: Option<f64>,
    /// Bound that it is closest to.
    pub bound: Option<f64>,
    /// Opposite bound, if there are two.
    pub other_bound: Option<f64>,
    /// Distance to the bound.
    pub margin: Option<f64>,
}

/// Format of the numbers of a comparison: a unit according to their magnitude, and a common number
/// of decimals if it resolves both the measured value and the bound.
pub struct Shown<'u> {
    factor: f64,
    /// Symbol of the unit; empty for numbers without one.
    pub symbol: &'u str,
    digits: Digits,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Digits {
    /// Number of decimals.
    Decimals(usize),
    /// Three significant digits with an exponent.
    Exponent,
    /// Three significant digits for each number, with an exponent if necessary.
    Individual,
}

impl<'u> Shown<'u> {
    /// Returns the format of a comparison in the unit with this symbol.
    pub fn of(comparison: &Comparison, unit: &'u str) -> Self {
        let Comparison {
            measured,
            bound,
            other_bound,
            margin,
        } = *comparison;
        let numbers = [measured, bound, other_bound, margin];
        let numbers = numbers.into_iter().flatten();
        let greatest = numbers.clone().map(f64::abs).fold(0.0, f64::max);
        let (factor, symbol) = scale(unit, greatest);
        let whole = numbers
            .clone()
            .all(|number| (number * factor).fract() == 0.0);
        let greatest = greatest * factor;
        let compared = [measured, bound].into_iter().flatten();
        let mut compared = compared.map(|number| number * factor);
        let digits = if whole && greatest < 1e9 {
            Digits::Decimals(0)
        } else if !(1e-3..1e9).contains(&greatest) {
            Digits::Exponent
        } else {
            // Three significant digits, and more if the margin would be rounded to zero.
            let margin = margin.unwrap_or(0.0).abs() * factor;
            let for_margin = if margin > 0.0 { -exponent(margin) } else { 0 };
            let decimals = (2 - exponent(greatest)).max(for_margin);
            let decimals = usize::try_from(decimals.clamp(0, 9)).unwrap_or(0);
            if compared.any(|number| is_lost(number, decimals)) {
                Digits::Individual
            } else {
                Digits::Decimals(decimals)
            }
        };
        Self {
            factor,
            symbol,
            digits,
        }
    }

    /// Returns a number of the comparison with its unit.
    pub fn with_unit(&self, value: f64) -> String {
        let text = format!("{} {}", self.number(value), self.symbol);
        text.trim_end().to_owned()
    }

    /// Returns a number of the comparison, without the unit.
    pub fn number(&self, value: f64) -> String {
        let value = value * self.factor;
        match self.digits {
            // The other end of a range may be of another magnitude than the compared numbers.
            Digits::Decimals(decimals) if is_lost(value, decimals) => three_digits(value),
            Digits::Decimals(decimals) => format!("{value:.decimals$}"),
            Digits::Exponent if value == 0.0 => "0".to_owned(),
            Digits::Exponent => format!("{value:.2e}"),
            Digits::Individual => three_digits(value),
        }
    }
}

impl Shown<'_> {
    /// Returns an error of a number of the comparison, without the unit: `± 2e-5`.
    pub fn error(&self, error: f64) -> String {
        let error = error.abs() * self.factor;
        if error == 0.0 {
            "± 0".to_owned()
        } else if (0.01..100.0).contains(&error) {
            let decimals = usize::try_from(1 - exponent(error)).unwrap_or(0);
            format!("± {error:.decimals$}")
        } else {
            format!("± {error:.0e}")
        }
    }
}

/// Returns whether rounding to `decimals` exceeds [`ROUNDING_MAX`].
fn is_lost(value: f64, decimals: usize) -> bool {
    if !value.is_finite() {
        return false;
    }
    let rounded: f64 = format!("{value:.decimals$}").parse().unwrap_or(value);
    (rounded - value).abs() > ROUNDING_MAX * value.abs()
}

/// Formats a number with three significant digits.
fn three_digits(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (1e-2..1e6).contains(&size) {
        let decimals = usize::try_from(2 - exponent(size)).unwrap_or(0);
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

/// Returns the decimal exponent of the positive number `value`.
fn exponent(value: f64) -> i32 {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "exponents of ten are small"
    )]
    let exponent = libm::log10(value).floor() as i32;
    exponent
}

/// Returns the scale factor and the symbol of the unit in which numbers in `unit` are shown.
fn scale(unit: &str, greatest: f64) -> (f64, &str) {
    match unit {
        "rad" => (180.0 / PI, "°"),
        "m" if greatest < 0.1 => (1e3, "mm"),
        "s" if greatest < 1e-4 => (1e6, "µs"),
        "s" if greatest < 0.1 => (1e3, "ms"),
        "1" => (1.0, ""),
        other => (1.0, other),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns measured value, bound, margin and unit as they are shown.
    fn shown(measured: f64, bound: f64, margin: f64, unit: &str) -> [String; 4] {
        let comparison = Comparison {
            measured: Some(measured),
            bound: Some(bound),
            other_bound: None,
            margin: Some(margin),
        };
        let shown = Shown::of(&comparison, unit);
        let [measured, bound, margin] = [measured, bound, margin].map(|it| shown.number(it));
        [measured, bound, margin, shown.symbol.to_owned()]
    }

    #[test]
    fn unit_depends_on_magnitude() {
        let of = shown;
        assert_eq!(
            of(0.0031, 0.005, 0.0019, "m"),
            ["3.10", "5.00", "1.90", "mm"]
        );
        assert_eq!(
            of(0.107, 0.05, 0.057, "m"),
            ["0.107", "0.050", "0.057", "m"]
        );
        let degree = PI / 180.0;
        let angles = of(1.11 * degree, 4.0 * degree, 2.89 * degree, "rad");
        assert_eq!(angles, ["1.11", "4.00", "2.89", "°"]);
        assert_eq!(of(0.0, 0.0, 0.0, "1"), ["0", "0", "0", ""]);
        assert_eq!(
            of(2e-9, 1e-6, 9.98e-7, "1"),
            ["2.00e-9", "1.00e-6", "9.98e-7", ""]
        );
    }

    #[test]
    fn numbers_of_different_magnitude_are_formatted_individually() {
        let of = |measured, bound, margin| {
            let [measured, bound, margin, _] = shown(measured, bound, margin, "1");
            [measured, bound, margin]
        };
        let close = of(0.00168, 1e-6, 1e-6 - 0.00168);
        assert_eq!(close, ["1.68e-3", "1.00e-6", "-1.68e-3"]);
        let balance = of(1_337_729.4, 0.02, 0.02 - 1_337_729.4);
        assert_eq!(balance, ["1.34e6", "0.0200", "-1.34e6"]);
        assert_eq!(of(1.8e-5, 0.02, 0.019_982), ["1.80e-5", "0.0200", "0.0200"]);
        // A common number of decimals is kept if it resolves all numbers.
        assert_eq!(of(0.62, 20.0, 19.38), ["0.6", "20.0", "19.4"]);
        assert_eq!(of(0.0, 0.02, 0.02), ["0.0000", "0.0200", "0.0200"]);
        let balance = of(3.95e-7, 1e-6, 6.05e-7);
        assert_eq!(balance, ["3.95e-7", "1.00e-6", "6.05e-7"]);
    }

    proptest! {
        #[test]
        fn nonzero_margin_is_shown_with_sign(bound in 1e-2..1e3_f64, share in 1e-6..0.5_f64, fails: bool) {
            let margin = if fails { -share * bound } else { share * bound };
            let [_, _, text, _] = shown(bound - margin, bound, margin, "1");
            let shown: f64 = text.parse().unwrap();
            prop_assert!(shown != 0.0 && (shown < 0.0) == fails, "{margin} is shown as {text}");
        }

        #[test]
        fn measured_value_and_bound_are_resolved(measured in -9.0..7.0_f64, bound in -9.0..7.0_f64) {
            let [measured, bound] = [measured, bound].map(|power| libm::pow(10.0, power));
            let [left, right, _, _] = shown(measured, bound, bound - measured, "1");
            for (text, value) in [(left, measured), (right, bound)] {
                let shown: f64 = text.parse().unwrap();
                // `ROUNDING_MAX` of the common number of decimals.
                prop_assert!((shown - value).abs() <= 0.2 * value, "{value} is shown as {text}");
            }
        }
    }
}
