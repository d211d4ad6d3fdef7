//! Conversion of quantities from and to text, without avoidable rounding.

use std::fmt;

use twinrig_kernel::{SimDuration, Unit};

use crate::spelling::{Miswritten, foreign_characters, meant_unit, miswritten};
use crate::units::{self, Scale};
use crate::visible::code_point;

/// Reason why a text is not the expected quantity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QuantityError {
    /// Description of the problem.
    pub message: String,
    /// Remedy; may be empty.
    pub help: String,
}

impl fmt::Display for QuantityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.help.is_empty() {
            f.write_str(&self.message)
        } else {
            write!(f, "{} ({})", self.message, self.help)
        }
    }
}

impl std::error::Error for QuantityError {}

/// Returns the number of `text` in the SI unit `unit`.
///
/// ```
/// use twinrig_document::parse_quantity;
/// use twinrig_kernel::Unit;
///
/// assert_eq!(parse_quantity("12.6 cm", Unit::Meter), Ok(0.126));
/// assert!(parse_quantity("12.6 Hz", Unit::Meter).is_err());
/// ```
///
/// # Errors
/// No number, a unit of another dimension, a missing unit, or a number too large for `f64`.
pub fn parse_quantity(text: &str, unit: Unit) -> Result<f64, QuantityError> {
    let (digits, spelling) = split(text);
    let kind = units::kind(unit).ok_or_else(|| QuantityError {
        message: format!("a quantity in {unit} cannot be written in a document"),
        help: String::new(),
    })?;
    if digits.is_empty() {
        return Err(no_number(text, kind));
    }
    let Some(scale) = units::scale(kind, spelling) else {
        return Err(wrong_unit(text, spelling, unit));
    };
    let value = match scale {
        Scale::Ten(shift) => shifted(digits, shift),
        Scale::Factor(factor) => digits.parse::<f64>().ok().map(|number| number * factor),
    };
    value
        .filter(|value| value.is_finite())
        .ok_or_else(|| QuantityError {
            message: format!("`{text}` is too large a number"),
            help: String::new(),
        })
}

/// Returns the number of a text in SI units, with the unit; none if it is no quantity.
///
/// ```
/// use twinrig_document::parse_with_unit;
/// use twinrig_kernel::Unit;
///
/// assert_eq!(parse_with_unit("490 g"), Some((0.49, Unit::Kilogram)));
/// assert_eq!(parse_with_unit("490 apples"), None);
/// ```
pub fn parse_with_unit(text: &str) -> Option<(f64, Unit)> {
    let unit = units::kind_of_spelling(split(text).1)?.unit;
    Some((parse_quantity(text, unit).ok()?, unit))
}

/// Maximum duration in a document: a hundred years. [`twinrig_kernel::SimTime`] overflows after 584
/// years; an instant of a run plus a period and two delays remains below that.
const LONGEST_NANOS: u64 = 100 * 31_557_600 * 1_000_000_000;

/// Returns the duration of `text`, exact to the nanosecond, without floating-point arithmetic.
///
/// ```
/// use twinrig_document::parse_duration;
/// use twinrig_kernel::SimDuration;
///
/// assert_eq!(parse_duration("0.1 ms"), Ok(SimDuration::from_nanos(100_000)));
/// ```
///
/// # Errors
/// As [`parse_quantity`]; also a negative duration, one that is not a whole number of nanoseconds,
/// and one longer than a hundred years.
pub fn parse_duration(text: &str) -> Result<SimDuration, QuantityError> {
    parse_quantity(text, Unit::Second)?;
    let (digits, spelling) = split(text);
    let (shift, factor) = match spelling.trim() {
        "min" => (9, 60),
        "s" => (9, 1),
        "ms" => (6, 1),
        "ns" => (0, 1),
        _ => (3, 1),
    };
    if digits.starts_with('-') {
        return Err(QuantityError {
            message: format!("`{text}` is negative; a duration is not"),
            help: String::new(),
        });
    }
    whole(digits, shift)
        .and_then(|nanos| nanos.checked_mul(factor))
        .and_then(|nanos| u64::try_from(nanos).ok())
        .filter(|nanos| *nanos <= LONGEST_NANOS)
        .map(SimDuration::from_nanos)
        .ok_or_else(|| QuantityError {
            message: format!("`{text}` is not a whole number of nanoseconds that a clock can hold"),
            help: "time counts in whole nanoseconds, 100 years at most".into(),
        })
}

/// Formats `value` in the SI unit, so that [`parse_quantity`] returns the same bits.
///
/// ```
/// use twinrig_document::print_quantity;
/// use twinrig_kernel::Unit;
///
/// assert_eq!(print_quantity(0.126, Unit::Meter), "0.126 m");
/// ```
pub fn print_quantity(value: f64, unit: Unit) -> String {
    match units::kind(unit).and_then(si_spelling) {
        Some("") | None => format!("{value}"),
        Some(spelling) => format!("{value} {spelling}"),
    }
}

/// Name of a quantity in `unit`, with its article: `a length`.
pub fn quantity_name(unit: Unit) -> &'static str {
    units::kind(unit).map_or("a quantity", |kind| kind.name)
}

/// Spellings that fit `unit`: `m, cm, mm, um, km`.
pub fn fitting_units(unit: Unit) -> String {
    let spellings = units::kind(unit).map_or(&[][..], |kind| kind.spellings);
    spellings
        .iter()
        .map(|(spelling, _)| *spelling)
        .filter(|spelling| !spelling.is_empty())
        .collect::<Vec<_>>()
        .join(", ")
}

/// Unit in which `text` is written; [`Unit::One`] if there is none.
pub(crate) fn spelled_unit(text: &str) -> Unit {
    let (_, spelling) = split(text);
    units::kind_of_spelling(spelling).map_or(Unit::One, |kind| kind.unit)
}

/// Spelling and factor of the unit in which `text` is written, if that is no power of ten of
/// `unit`: degrees, minutes.
pub(crate) fn spelled_factor(text: &str, unit: Unit) -> Option<(&str, f64)> {
    let (_, spelling) = split(text);
    match units::scale(units::kind(unit)?, spelling)? {
        Scale::Factor(factor) => Some((spelling, factor)),
        Scale::Ten(_) => None,
    }
}

/// Unit in which `text` is written, which may be any known unit.
pub(crate) fn any_unit(text: &str) -> Result<Unit, QuantityError> {
    let (digits, spelling) = split(text);
    if digits.is_empty() {
        // Of `nan N` the unit says which quantity is meant.
        let last = text.rsplit(' ').next();
        let kind = last.and_then(units::kind_of_spelling);
        return Ok(kind.map_or(Unit::One, |kind| kind.unit));
    }
    if spelling.is_empty() {
        return Ok(Unit::One);
    }
    if let Some(kind) = units::kind_of_spelling(spelling) {
        return Ok(kind.unit);
    }
    let first = |kind: &units::Kind| {
        let mut spellings = kind.spellings.iter().map(|(spelling, _)| *spelling);
        spellings.find(|spelling| !spelling.is_empty())
    };
    let known: Vec<&str> = units::KINDS.iter().filter_map(first).collect();
    let plain = |spelling: &str| spelling.replace('·', "").to_lowercase();
    let meant = units::KINDS
        .iter()
        .flat_map(|kind| kind.spellings)
        .find(|(known, _)| plain(known) == plain(spelling));
    let meant = meant.map_or_else(String::new, |(known, _)| {
        format!("did you mean `{known}`? ")
    });
    Err(QuantityError {
        message: format!("`{spelling}` is not a known unit"),
        help: format!(
            "{meant}known units are {} and their multiples",
            known.join(", ")
        ),
    })
}

/// Remedy with an example; for a length: `write it as in "3 m"; units that fit: m, cm, …`.
pub(crate) fn example(unit: Unit) -> String {
    example_of("3", unit)
}

/// As [`example`], with a number that is given.
pub(crate) fn example_of(number: &str, unit: Unit) -> String {
    let first = units::kind(unit).map_or("", |kind| kind.spellings[0].0);
    if first.is_empty() {
        "write a number, as in 0.5".into()
    } else {
        format!(
            "write it as in \"{number} {first}\"; units that fit: {}",
            fitting_units(unit)
        )
    }
}

fn si_spelling(kind: &units::Kind) -> Option<&'static str> {
    kind.spellings
        .iter()
        .find(|(_, scale)| *scale == Scale::Ten(0))
        .map(|(spelling, _)| *spelling)
}

fn wrong_unit(text: &str, spelling: &str, unit: Unit) -> QuantityError {
    let expected = quantity_name(unit);
    if let Some(error) = miswritten_number(text, expected) {
        return error;
    }
    if let Some(help) = of_data_sheet(text, spelling, unit) {
        let message = format!("`{spelling}` is no unit of a scenario; expected {expected}");
        return QuantityError { message, help };
    }
    let meant = units::kind(unit).and_then(|kind| meant_unit(kind, spelling));
    let meant = meant.map(|unit| format!("did you mean `{unit}`?"));
    let fitting = match fitting_units(unit) {
        units if units.is_empty() => "write the number without a unit".into(),
        units => format!("units that fit: {units}"),
    };
    let foreign = foreign_characters(spelling);
    let parts = [meant, Some(fitting), foreign].into_iter().flatten();
    let help = parts.collect::<Vec<_>>().join("; ").replace("?; ", "? ");
    let is_quantity_too = spelling.contains(|c: char| c.is_ascii_digit())
        && !spelling.contains('^')
        && units::kind_of_spelling(spelling).is_none();
    let message = if is_quantity_too {
        format!("`{text}` is not one number with one unit; expected {expected}")
    } else if spelling.is_empty() {
        format!("`{text}` has no unit; expected {expected}")
    } else if let Some(kind) = units::kind_of_spelling(spelling) {
        format!("`{text}` is {}; expected {expected}", kind.name)
    } else {
        format!("`{spelling}` is not a known unit; expected {expected}")
    };
    QuantityError { message, help }
}

/// Remedy for a unit of data sheets: the value with four digits, if it has one (0 s for 60° has
/// none).
fn of_data_sheet(text: &str, spelling: &str, unit: Unit) -> Option<String> {
    let number = split(text).0.parse().ok()?;
    let value = units::of_data_sheet(unit, spelling, number)?;
    let digits = format!("{value:.3e}").parse::<f64>().ok()?;
    digits
        .is_finite()
        .then(|| format!("write `\"{}\"`", print_quantity(digits, unit)))
}

/// Error of a text without a number at its beginning.
fn no_number(text: &str, kind: &units::Kind) -> QuantityError {
    if let Some(error) = miswritten_number(text, kind.name) {
        return error;
    }
    let message = if text.trim().is_empty() {
        format!("the text is empty; expected {}", kind.name)
    } else {
        format!(
            "`{text}` does not begin with a number; expected {}",
            kind.name
        )
    };
    QuantityError {
        message,
        help: example(kind.unit),
    }
}

/// Error of a number with a decimal comma, with separated thousands or with foreign characters.
fn miswritten_number(text: &str, expected: &str) -> Option<QuantityError> {
    let message = format!("`{text}` does not begin with a decimal number; expected {expected}");
    let help = match miswritten(text)? {
        Miswritten::Meant(meant) => {
            let meant: Vec<String> = meant.iter().map(|text| format!("`{text}`")).collect();
            format!(
                "did you mean {}? numbers have a decimal point and no other separators",
                meant.join(" or ")
            )
        }
        Miswritten::Foreign(c) => format!(
            "`{c}` is {}; write the sign as `-` and the number in the digits 0 to 9",
            code_point(c)
        ),
    };
    Some(QuantityError { message, help })
}

/// Splits `text` into its leading decimal number (empty if there is none) and the rest, both
/// trimmed.
fn split(text: &str) -> (&str, &str) {
    let text = text.trim();
    let bytes = text.as_bytes();
    let digits_from = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let start = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole_end = digits_from(start);
    let mut end = whole_end;
    if bytes.get(end) == Some(&b'.') {
        let fraction_end = digits_from(end + 1);
        if fraction_end > end + 1 {
            end = fraction_end;
        }
    }
    if whole_end == start {
        return ("", text);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent_end = digits_from(end + 1 + sign);
        if exponent_end > end + 1 + sign {
            end = exponent_end;
        }
    }
    (&text[..end], text[end..].trim())
}

/// Splits a number returned by [`split`] into mantissa and exponent.
fn scientific(digits: &str) -> Option<(&str, i32)> {
    match digits.split_once(['e', 'E']) {
        None => Some((digits, 0)),
        // An exponent of more than four digits is an error, and would make `whole` format very long
        // numbers.
        Some((mantissa, exponent)) => {
            let exponent: i32 = exponent.parse().ok()?;
            (exponent.abs() < 10_000).then_some((mantissa, exponent))
        }
    }
}

/// Returns the number times 10^`shift`, rounded once.
fn shifted(digits: &str, shift: i32) -> Option<f64> {
    let (mantissa, exponent) = scientific(digits)?;
    format!("{mantissa}e{}", exponent + shift).parse().ok()
}

/// Returns the number times 10^`shift`, if that is a non-negative integer of at most 128 bits.
fn whole(digits: &str, shift: i32) -> Option<u128> {
    let (mantissa, exponent) = scientific(digits.trim_start_matches('+'))?;
    let (integer, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let fraction = fraction.trim_end_matches('0');
    let number: u128 = format!("{integer}{fraction}").parse().ok()?;
    if number == 0 {
        return Some(0);
    }
    let power = exponent + shift - i32::try_from(fraction.len()).ok()?;
    let ten = 10_u128.checked_pow(power.unsigned_abs())?;
    if power >= 0 {
        number.checked_mul(ten)
    } else {
        number.is_multiple_of(ten).then(|| number / ten)
    }
}

#[cfg(test)]
mod tests;
