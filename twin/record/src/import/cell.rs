//! Values of a log, before their conversion.

/// A value of a row or of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell<'a> {
    /// No value: null, or an empty field.
    Missing,
    /// Decimal digits.
    Digits(&'a str),
    /// A binary number.
    Number(f64),
    /// A whole number.
    Integer(i128),
    /// A time in nanoseconds, whatever the unit of the mapping.
    Nanos(i128),
    Boolean(bool),
    Text(&'a str),
    /// A list or an object.
    Composite(&'static str),
}

impl Cell<'_> {
    /// Returns the nearest number; none of other values.
    pub(super) fn number(&self) -> Option<f64> {
        match *self {
            Cell::Digits(digits) => digits.parse().ok(),
            Cell::Number(number) => Some(number),
            #[expect(clippy::cast_precision_loss, reason = "the nearest number")]
            Cell::Integer(whole) | Cell::Nanos(whole) => Some(whole as f64),
            Cell::Boolean(value) => Some(f64::from(u8::from(value))),
            Cell::Missing | Cell::Text(_) | Cell::Composite(_) => None,
        }
    }

    /// Describes the value in a message.
    pub(super) fn words(&self) -> String {
        match *self {
            Cell::Missing => "missing".to_owned(),
            Cell::Digits(digits) => digits.to_owned(),
            Cell::Number(number) => number.to_string(),
            Cell::Integer(whole) | Cell::Nanos(whole) => whole.to_string(),
            Cell::Boolean(value) => value.to_string(),
            Cell::Text(text) => {
                const SHOWN: usize = 40;
                let shown: String = text.chars().take(SHOWN).collect();
                format!("the text `{shown}`")
            }
            Cell::Composite(kind) => kind.to_owned(),
        }
    }
}

/// Returns the value of a field of text, as tables of other programs write it.
pub(super) fn of_field(field: &str) -> Cell<'_> {
    let field = field.trim();
    let word = |words: &[&str]| words.iter().any(|word| field.eq_ignore_ascii_case(word));
    if field.is_empty() || word(&["null", "none", "na", "n/a", "nil"]) {
        Cell::Missing
    } else if word(&["true", "false"]) {
        Cell::Boolean(word(&["true"]))
    } else {
        match field.parse::<f64>() {
            Ok(number) if number.is_finite() => Cell::Digits(field),
            Ok(number) => Cell::Number(number),
            Err(_) => Cell::Text(field),
        }
    }
}

/// Returns decimal digits times 10^`power`, rounded to the nearest integer, halves away from zero;
/// none if it exceeds 64 bits, or for other text.
pub(super) fn rounded(digits: &str, power: i32) -> Option<i64> {
    let (mantissa, exponent) = match digits.split_once(['e', 'E']) {
        None => (digits, 0),
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
    };
    let (negative, mantissa) = match mantissa.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, mantissa.strip_prefix('+').unwrap_or(mantissa)),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = || whole.bytes().chain(fraction.bytes());
    if digits().next().is_none() || !digits().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    if digits().all(|digit| digit == b'0') {
        return Some(0);
    }
    // The decimal point lies behind so many of the digits.
    let point = i64::try_from(whole.len()).ok()? + i64::from(exponent) + i64::from(power);
    if point < 0 {
        return Some(0);
    }
    let mut digits = digits();
    let mut value: i64 = 0;
    // Zeros before the first other digit are digits of the text; after it, the value overflows.
    for _ in 0..point {
        let digit = i64::from(digits.next().map_or(0, |digit| digit - b'0'));
        value = value.checked_mul(10)?.checked_add(digit)?;
    }
    let is_up = digits.next().is_some_and(|digit| digit >= b'5');
    let value = value.checked_add(i64::from(is_up))?;
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn decimal_times_round_once() {
        for (digits, nanos) in [
            ("0.01368856430053711", 13_688_564),
            ("8.449999950244091e-05", 84_500),
            ("1705312345.123456789", 1_705_312_345_123_456_789),
            ("-0.0000000005", -1),
            ("0.00000000049999", 0),
            ("0e400", 0),
            ("1e-400", 0),
            ("0.000000001e9", 1_000_000_000),
            ("+12", 12_000_000_000),
        ] {
            assert_eq!(rounded(digits, 9), Some(nanos), "{digits}");
        }
        for digits in [
            "",
            "-",
            ".",
            "1e400",
            "1e99999999999",
            "9223372036.9",
            "1x",
            "1.2.3",
        ] {
            assert_eq!(rounded(digits, 9), None, "{digits}");
        }
    }

    proptest! {
        #[test]
        fn rounding_is_that_of_floating_point_below_a_month(nanos in 0_i64..2_592_000_000_000_000) {
            let seconds = nanos as f64 / 1e9;
            prop_assert_eq!(rounded(&seconds.to_string(), 9), Some(nanos));
            prop_assert_eq!(rounded(&format!("{seconds:e}"), 9), Some(nanos));
            prop_assert_eq!((seconds * 1e9).round(), nanos as f64);
        }

        #[test]
        fn any_text_is_a_cell(text in "\\PC{0,12}", power in -20..20) {
            let _ = of_field(&text).words();
            let _ = rounded(&text, power);
        }
    }
}
