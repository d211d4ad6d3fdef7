//! In which unit and with how many digits the numbers of an expectation are shown.

use std::f64::consts::PI;

use twinrig_kernel::Unit;
use twinrig_scenario::Outcome;

/// A number that rounding to the row's decimals changes by more than this share of itself gets digits of its own: a bound
/// of 1e-6 is not 0.
const ROUNDING_MAX: f64 = 0.2;

/// How the numbers of one row are shown: in a unit that suits their size, all with the same number of decimals where that
/// shows both what was measured and the bound.
pub(super) struct Shown {
    factor: f64,
    pub(super) symbol: &'static str,
    digits: Digits,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Digits {
    /// So many behind the point.
    Decimals(usize),
    /// Three, with an exponent.
    Exponent,
    /// Three for each number, with an exponent where it wants one.
    Own,
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
            // Three digits, and more where the margin would vanish.
            let margin = outcome.margin.unwrap_or(0.0).abs() * factor;
            let vanishing = if margin > 0.0 { -exponent(margin) } else { 0 };
            let decimals = (2 - exponent(greatest)).max(vanishing);
            let decimals = usize::try_from(decimals.clamp(0, 9)).unwrap_or(0);
            if compared.any(|number| lost(number, decimals)) {
                Digits::Own
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
            // The far end of a range may be of another size than what was compared.
            Digits::Decimals(decimals) if lost(value, decimals) => own(value),
            Digits::Decimals(decimals) => format!("{value:.decimals$}"),
            Digits::Exponent if value == 0.0 => "0".to_owned(),
            Digits::Exponent => format!("{value:.2e}"),
            Digits::Own => own(value),
        }
    }
}

/// Whether so many decimals do not show a number.
fn lost(value: f64, decimals: usize) -> bool {
    if !value.is_finite() {
        return false;
    }
    let seen: f64 = format!("{value:.decimals$}").parse().unwrap_or(value);
    (seen - value).abs() > ROUNDING_MAX * value.abs()
}

/// A number with three digits.
fn own(value: f64) -> String {
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

/// The exponent of ten of `value`, which is positive.
fn exponent(value: f64) -> i32 {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "exponents of ten are small"
    )]
    let exponent = libm::log10(value).floor() as i32;
    exponent
}

/// What a number in `unit` is multiplied by to be shown, and in what it then is.
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
