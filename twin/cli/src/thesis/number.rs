//! Numbers for readers: four significant digits.

use crate::thesis::verdict::Measurement;

/// Magnitudes in decimal notation; others are powers of ten.
const DECIMAL: std::ops::Range<f64> = 1e-3..1e6;
/// Magnitude up to which whole numbers have all their digits.
const WHOLE: f64 = 1e9;

/// Formats a number with four significant digits, and whole numbers with all of theirs.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if value.fract() == 0.0 && size < WHOLE {
        return format!("{value}");
    }
    if !value.is_finite() {
        return value.to_string();
    }
    if !DECIMAL.contains(&size) {
        let text = format!("{value:.3e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{exponent}", trimmed(mantissa));
    }
    // Rounded to four digits first: 9.9996 has one digit more before the point.
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    let before = libm::floor(libm::log10(rounded.abs()));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number from 0 to 6"
    )]
    let decimals = (3.0 - before).max(0.0) as usize;
    let text = format!("{rounded:.decimals$}");
    trimmed(&text).to_owned()
}

/// Returns a number without zeros at its end behind the point.
fn trimmed(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

/// Formats a measurement with its unit: `≥ 100 ms`, `0.92 (0.85 … 0.96)`.
pub(crate) fn measurement(found: &Measurement, unit: &str) -> String {
    let value = number(found.value);
    let text = match (found.low, found.high) {
        (Some(_), None) => format!("≥ {value}"),
        (None, Some(_)) => format!("≤ {value}"),
        (Some(low), Some(high)) if low < high => {
            format!("{value} ({} … {})", number(low), number(high))
        }
        _ => value,
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
            let size = mantissa * libm::pow(10.0, f64::from(exponent));
            let value = if sign { -size } else { size };
            let shown: f64 = number(value).parse().unwrap();
            prop_assert!((shown - value).abs() <= 0.5001e-3 * size, "{} of {}", shown, value);
        }
    }

    #[test]
    fn numbers_are_as_a_reader_writes_them() {
        let shown = [4_000_108.0, 253.27, 0.1, 9.9996, 541.96, 1e-9, 0.0].map(number);
        assert_eq!(shown, ["4000108", "253.3", "0.1", "10", "542", "1e-9", "0"]);
        let bound = measurement(&Measurement::at_least(100.0), "ms");
        assert_eq!(bound, "≥ 100 ms");
        let share = Measurement::within(92.0, 85.03, 95.89);
        assert_eq!(measurement(&share, "%"), "92 (85.03 … 95.89) %");
    }
}
