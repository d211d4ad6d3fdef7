//! Units and digits of the numbers of an expectation.

use std::f64::consts::PI;

use twinrig_kernel::Unit;
use twinrig_scenario::Outcome;

/// Maximum relative rounding error of the common number of decimals of a row; numbers that exceed
/// it are formatted individually, so that a bound of 1e-6 is not shown as 0.
const ROUNDING_MAX: f64 = 0.2;

/// Format of the numbers of one row: a unit according to their magnitude, and a common number of
/// decimals if it resolves both the measured value and the bound.
pub(super) struct Shown {
    factor: f64,
    pub(super) symbol: &'static str,
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

impl Shown {
    pub(super) fn of(outcome: &Outcome) -> Self {
        let numbers = [
            outcome.measured,
            outcome.bound,
            outcome.other_bound,
            outcome.margin,
        ];
        let numbers = numbers.into_iter().flatten();
        let greatest = numbers.clone().map(f64::abs).fold(0.0, f64::max);
        let (factor, symbol) = scale(outcome.unit, greatest);
        let whole = numbers
            .clone()
            .all(|number| (number * factor).fract() == 0.0);
        let greatest = greatest * factor;
        let compared = [outcome.measured, outcome.bound].into_iter().flatten();
        let mut compared = compared.map(|number| number * factor);
        let digits = if whole && greatest < 1e9 {
            Digits::Decimals(0)
        } else if !(1e-3..1e9).contains(&greatest) {
            Digits::Exponent
        } else {
            // Three significant digits, and more if the margin would be rounded to zero.
            let margin = outcome.margin.unwrap_or(0.0).abs() * factor;
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

    pub(super) fn number(&self, value: f64) -> String {
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
fn scale(unit: Unit, greatest: f64) -> (f64, &'static str) {
    match unit {
        Unit::Radian => (180.0 / PI, "°"),
        Unit::Meter if greatest < 0.1 => (1e3, "mm"),
        Unit::Second if greatest < 1e-4 => (1e6, "µs"),
        Unit::Second if greatest < 0.1 => (1e3, "ms"),
        Unit::One => (1.0, ""),
        other => (1.0, other.symbol()),
    }
}
