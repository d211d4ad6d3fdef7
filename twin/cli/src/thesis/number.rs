//! Numbers for readers: four significant digits.

use crate::thesis::verdict::Measurement;

/// Magnitudes in decimal notation; others are powers of ten.
const DECIMAL: std::ops::Range<f64> = 1e-3..1e6;
/// Magnitude up to which whole numbers have all their digits.
const WHOLE: f64 = 1e9;
/// Significant digits.
const DIGITS: usize = 4;
/// Most significant digits of a printed number; a computed one has more.
const PRINTED_DIGITS: usize = 7;

/// Formats a number with four significant digits, and whole numbers with all of theirs.
pub(crate) fn number(value: f64) -> String {
    rounded(value, DIGITS)
}

/// Formats a printed number with all of its digits, and a number computed of printed ones with
/// four.
pub(crate) fn printed(value: f64) -> String {
    rounded(value, digits_like(value))
}

/// Returns the digits in which a number is comparable with a printed one.
fn digits_like(printed: f64) -> usize {
    let text = format!("{:e}", printed.abs());
    let mantissa = text.split('e').next().unwrap_or_default();
    let digits = mantissa.chars().filter(char::is_ascii_digit).count();
    if digits > PRINTED_DIGITS {
        DIGITS
    } else {
        digits.max(DIGITS)
    }
}

fn rounded(value: f64, digits: usize) -> String {
    let size = value.abs();
    if value.fract() == 0.0 && size < WHOLE {
        return format!("{value}");
    }
    if !value.is_finite() {
        return value.to_string();
    }
    // The digits behind the first.
    let behind = digits - 1;
    let text = format!("{value:.behind$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    if !DECIMAL.contains(&size) {
        return format!("{}e{exponent}", trimmed(mantissa));
    }
    // Of the rounded number: 9.9996 has one digit more before the point.
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let decimals = i32::try_from(behind).unwrap_or(0) - exponent;
    let decimals = usize::try_from(decimals).unwrap_or(0);
    let nearest: f64 = text.parse().unwrap_or(value);
    trimmed(&format!("{nearest:.decimals$}")).to_owned()
}

/// Returns a number without zeros at its end behind the point.
fn trimmed(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

/// Formats a measurement with its unit, in the digits of a printed value: `≥ 100 ms`,
/// `0.92 (0.85 … 0.96)`.
pub(crate) fn measurement(found: &Measurement, like: Option<f64>, unit: &str) -> String {
    let digits = like.map_or(DIGITS, digits_like);
    let number = |value| rounded(value, digits);
    let text = match (found.low, found.high) {
        (Some(low), None) => format!("≥ {}", number(low)),
        (None, Some(high)) => format!("≤ {}", number(high)),
        (Some(low), Some(high)) if low < high => {
            let [value, low, high] = [found.value, low, high].map(number);
            format!("{value} ({low} … {high})")
        }
        _ => number(found.value),
    };
    format!("{text} {unit}").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn text_is_the_number_to_four_digits(mantissa in 1.0..10.0, exponent in -12..12_i32, sign: bool) {
            let size: f64 = mantissa * libm::pow(10.0, f64::from(exponent));
            let value = if sign { -size } else { size };
            let shown: f64 = number(value).parse().unwrap();
            prop_assert!((shown - value).abs() <= 0.5001e-3 * size, "{} of {}", shown, value);
        }
    }

    #[test]
    fn numbers_are_as_a_reader_writes_them() {
        let shown = [4_000_108.0, 253.27, 0.1, 9.9996, 541.96, 1e-9, 0.0].map(number);
        assert_eq!(shown, ["4000108", "253.3", "0.1", "10", "542", "1e-9", "0"]);
        let shown = [253.27, 500.0135, 7.85e-6, 166.1 / 15.0, 0.9994].map(printed);
        assert_eq!(shown, ["253.27", "500.0135", "7.85e-6", "11.07", "0.9994"]);
    }

    #[test]
    fn measurements_have_their_bounds_and_the_digits_of_the_printed_value() {
        let bound = measurement(&Measurement::at_least(100.0), Some(1.69), "ms");
        assert_eq!(bound, "≥ 100 ms");
        let share = Measurement::within(92.0, 85.03, 95.89);
        assert_eq!(measurement(&share, None, "%"), "92 (85.03 … 95.89) %");
        let rate = Measurement::exact(500.013_501);
        assert_eq!(measurement(&rate, Some(500.0135), "Hz"), "500.0135 Hz");
    }
}
