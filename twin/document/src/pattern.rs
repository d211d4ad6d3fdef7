//! Regular expressions of quantities, for schemas. Text that does not match is also rejected by
//! [`crate::Item::quantity`].
//!
//! The expressions are in the common subset of ECMA 262, Python and Rust: no look-around, no
//! back-references. A pattern checks notation, unit and sign; magnitudes and whole nanoseconds are
//! checked by the reader.

use std::ops::Bound;

use twinrig_kernel::Unit;

use crate::range::Range;
use crate::units;

const NUMBER: &str = r"[0-9]+(?:\.[0-9]+)?";
const NONZERO: &str = r"(?:0*[1-9][0-9]*(?:\.[0-9]+)?|0+\.0*[1-9][0-9]*)";
const ZERO: &str = r"0+(?:\.0+)?";
const EXPONENT: &str = r"(?:[eE][+-]?[0-9]+)?";

/// Returns a pattern that every text accepted by [`crate::parse_quantity`] in `unit` matches, and
/// hardly any other. Of `range`, only the sign is checked.
///
/// ```
/// use twinrig_document::{Range, quantity_pattern};
/// use twinrig_kernel::Unit;
///
/// let pattern = quantity_pattern(Unit::Hertz, &Range::NOT_NEGATIVE);
/// assert!(pattern.contains("kHz"));
/// ```
pub fn quantity_pattern(unit: Unit, range: &Range) -> String {
    anchored(&signed(range), &of_units(&[unit]))
}

/// Returns a pattern that every text accepted by [`crate::parse_duration`] matches; zero is
/// excluded if `positive`.
pub fn duration_pattern(positive: bool) -> String {
    let number = if positive { NONZERO } else { NUMBER };
    anchored(
        &format!(r"\+?{number}{EXPONENT}"),
        &of_units(&[Unit::Second]),
    )
}

/// Returns a pattern that every quantity of a known unit matches.
pub fn any_quantity_pattern(range: &Range) -> String {
    let units: Vec<Unit> = units::KINDS.iter().map(|kind| kind.unit).collect();
    anchored(&signed(range), &of_units(&units))
}

/// Returns a pattern that every non-negative percentage matches.
pub fn percentage_pattern() -> String {
    anchored(&signed(&Range::NOT_NEGATIVE), "%")
}

fn anchored(number: &str, unit: &str) -> String {
    format!(r"^\s*{number}\s*{unit}\s*$")
}

/// Pattern of a number with the signs admitted by `range`.
fn signed(range: &Range) -> String {
    match range.min {
        Bound::Excluded(min) if min >= 0.0 => format!(r"\+?{NONZERO}{EXPONENT}"),
        Bound::Included(min) if min > 0.0 => format!(r"\+?{NONZERO}{EXPONENT}"),
        Bound::Included(0.0) => format!(r"(?:\+?{NUMBER}|-{ZERO}){EXPONENT}"),
        _ => format!(r"[+-]?{NUMBER}{EXPONENT}"),
    }
}

/// Pattern of all spellings of `units`; the unit is optional for dimensionless numbers.
fn of_units(units: &[Unit]) -> String {
    let kinds = units.iter().filter_map(|unit| units::kind(*unit));
    let spellings = kinds.flat_map(|kind| kind.spellings);
    let spellings: Vec<String> = spellings
        .map(|(spelling, _)| spelled(spelling))
        .filter(|spelling| !spelling.is_empty())
        .collect();
    let optional = if units.contains(&Unit::One) { "?" } else { "" };
    format!("(?:{}){optional}", spellings.join("|"))
}

/// Pattern of all notations of one spelling, as accepted by `units::scale`: `kg·m²`, `kg*m^2`,
/// `kg m2`.
fn spelled(spelling: &str) -> String {
    const DOT: &str = "[*·⋅. ]";
    let mut pattern = String::new();
    for part in spelling.replace("deg", "°").chars() {
        match part {
            '·' => pattern.extend([DOT, "+"]),
            '/' => pattern.extend([DOT, "*/", DOT, "*"]),
            '²' => pattern.push_str(r"\^*[²2]"),
            'u' => pattern.push_str("[uµμ]"),
            '°' => pattern.push_str("(?:deg|°)"),
            '(' | ')' => pattern.extend(['\\', part]),
            part => pattern.push(part),
        }
    }
    pattern
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use regex_lite::Regex;

    use super::*;
    use crate::units::KINDS;
    use crate::{parse_duration, parse_quantity};

    const RANGES: [Range; 3] = [Range::ANY, Range::NOT_NEGATIVE, Range::POSITIVE];

    fn matches(pattern: &str, text: &str) -> bool {
        Regex::new(pattern).unwrap().is_match(text)
    }

    fn number() -> impl Strategy<Value = String> {
        "[+-]?(0{0,2}|[1-9])[0-9]{1,2}(\\.(0|[0-9]{1,3}))?([eE][+-]?[0-9])?"
    }

    /// A unit spelling of one of the kinds, in one of its notations.
    fn notation() -> impl Strategy<Value = (usize, String)> {
        let kind = (0..KINDS.len(), any::<prop::sample::Index>());
        let notation = (
            prop::sample::select(vec!["·", "*", " ", "⋅", " * "]),
            prop::sample::select(vec!["²", "2", "^2"]),
            prop::sample::select(vec!["u", "µ", "μ"]),
            prop::sample::select(vec!["deg", "°"]),
            prop::sample::select(vec!["/", " / ", "/ "]),
        );
        (kind, notation).prop_map(|((kind, index), (dot, square, micro, degree, per))| {
            let spellings = KINDS[kind].spellings;
            let (spelling, _) = spellings[index.index(spellings.len())];
            let spelling = spelling
                .replace('·', dot)
                .replace('²', square)
                .replace('u', micro)
                .replace("deg", degree)
                .replace('/', per);
            (kind, spelling)
        })
    }

    proptest! {
        #[test]
        fn accepted_quantities_match((kind, spelling) in notation(), number in number(), space in " ?") {
            let unit = KINDS[kind].unit;
            let text = format!("{number}{space}{spelling}");
            let value = parse_quantity(&text, unit).unwrap();
            for range in RANGES {
                let matched = matches(&quantity_pattern(unit, &range), &text);
                prop_assert_eq!(matched, range.contains(value), "{} {:?}", text, range);
                prop_assert!(matches(&any_quantity_pattern(&range), &text) || !matched);
            }
        }

        #[test]
        fn unit_of_another_dimension_does_not_match(
            (kind, spelling) in notation(), other in 0..KINDS.len(), number in number(),
        ) {
            let text = format!("{number} {spelling}");
            let pattern = quantity_pattern(KINDS[other].unit, &Range::ANY);
            let read = parse_quantity(&text, KINDS[other].unit).is_ok();
            prop_assert_eq!(matches(&pattern, &text), read);
            prop_assert_eq!(read, kind == other);
        }

        #[test]
        fn accepted_durations_match(number in number(), unit in "s|ms|us|µs|ns|min|h|") {
            let text = format!("{number} {unit}");
            if let Ok(duration) = parse_duration(&text) {
                prop_assert!(matches(&duration_pattern(false), &text));
                prop_assert_eq!(matches(&duration_pattern(true), &text), !duration.is_zero());
            }
        }

        #[test]
        fn rejected_texts_do_not_match(text in "[-+0-9.eE mskHz%]{0,8}", kind in 0..KINDS.len()) {
            let unit = KINDS[kind].unit;
            let matched = matches(&quantity_pattern(unit, &Range::ANY), &text);
            prop_assert_eq!(matched, parse_quantity(&text, unit).is_ok(), "{}", text);
        }
    }
}
