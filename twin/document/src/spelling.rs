//! Quantities as people write them by mistake, and the quantity that they mean.

use crate::units::{self, Kind};
use crate::visible::code_point;

/// Spellings that are no units here, and the units they mean.
const MEANT: &[(&str, &str)] = &[
    ("second", "s"),
    ("seconds", "s"),
    ("sec", "s"),
    ("secs", "s"),
    ("msec", "ms"),
    ("milliseconds", "ms"),
    ("usec", "us"),
    ("mus", "us"),
    ("minute", "min"),
    ("minutes", "min"),
    ("hertz", "Hz"),
    ("1/s", "Hz"),
    ("s^-1", "Hz"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("º", "deg"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("meter", "m"),
    ("meters", "m"),
    ("metre", "m"),
    ("metres", "m"),
    ("gr", "g"),
    ("gram", "g"),
    ("grams", "g"),
    ("kgs", "kg"),
    ("kilo", "kg"),
    ("newton", "N"),
    ("newtons", "N"),
    ("percent", "%"),
];

/// Returns the spelling of `kind` that the unknown `spelling` means.
pub(crate) fn meant_unit(kind: &Kind, spelling: &str) -> Option<&'static str> {
    let plain = |text: &str| -> String {
        let kept = text.chars().filter(|c| !"·⋅*×•/. ".contains(*c));
        kept.collect::<String>().to_lowercase()
    };
    let lower = spelling.trim().to_lowercase();
    let alias = MEANT.iter().find(|(wrong, _)| *wrong == lower);
    let fits = |unit: &str| units::scale(kind, unit).is_some();
    if let Some((_, unit)) = alias.filter(|(_, unit)| fits(unit)) {
        return Some(unit);
    }
    let mut spellings = kind.spellings.iter().map(|(known, _)| *known);
    spellings.find(|known| !known.is_empty() && plain(known) == plain(spelling))
}

/// Mistake in a number, and its correct form.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Miswritten {
    /// Another spelling of the same number, or two if the text has two meanings.
    Meant(Vec<String>),
    /// A character that is no ASCII digit or sign.
    Foreign(char),
}

/// Returns how the number at the beginning of `text` is to be written; `None` if it is not
/// miswritten in a known way.
pub(crate) fn miswritten(text: &str) -> Option<Miswritten> {
    let text = text.trim();
    let foreign = |c: &char| matches!(c, '−' | '–' | '—') || (c.is_numeric() && !c.is_ascii());
    if let Some(c) = text.chars().next().filter(foreign) {
        return Some(Miswritten::Foreign(c));
    }
    if let Some(rest) = text.strip_prefix('.') {
        let digit = rest.starts_with(|c: char| c.is_ascii_digit());
        return digit.then(|| Miswritten::Meant(vec![format!("0.{rest}")]));
    }
    let is_part = |c: char| c.is_ascii_digit() || "+-.,_' ".contains(c);
    let end = text.find(|c| !is_part(c)).unwrap_or(text.len());
    let number = text[..end].trim_end();
    let unit = text[number.len()..].trim();
    let with_unit = |number: String| match unit {
        "" => number,
        unit => format!("{number} {unit}"),
    };
    if let Some(whole) = number.strip_suffix('.') {
        let whole_number = !whole.is_empty() && whole.chars().all(|c| c.is_ascii_digit());
        return whole_number.then(|| Miswritten::Meant(vec![with_unit(whole.to_owned())]));
    }
    let mut groups = number.split([' ', '_', '\'']).skip(1);
    if !groups.all(|group| group.chars().take_while(char::is_ascii_digit).count() == 3) {
        return None;
    }
    let joined = number.replace([' ', '_', '\''], "");
    let meant = match joined.matches(',').count() {
        0 if joined != number => vec![joined],
        1 => {
            let decimal = joined.replace(',', ".");
            let thousands = joined
                .split_once(',')
                .is_some_and(|(_, end)| end.len() == 3);
            let whole = thousands.then(|| joined.replace(',', ""));
            std::iter::once(decimal).chain(whole).collect()
        }
        _ => return None,
    };
    let is_number = |text: &String| text.parse::<f64>().is_ok();
    let meant: Vec<String> = meant.into_iter().filter(is_number).map(with_unit).collect();
    (!meant.is_empty()).then_some(Miswritten::Meant(meant))
}

/// Names the characters of `text` that are not ASCII and in no unit: `` `ѕ` is U+0455 ``.
pub(crate) fn foreign_characters(text: &str) -> Option<String> {
    let of_units = |c: char| "·⋅²µμ°Ω".contains(c);
    let c = text.chars().find(|c| !c.is_ascii() && !of_units(*c))?;
    Some(format!(
        "`{}` is {}",
        crate::visible::visible(&c.to_string()),
        code_point(c)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comma_before_three_digits_has_two_meanings() {
        let meant = |text| match miswritten(text) {
            Some(Miswritten::Meant(meant)) => meant,
            other => panic!("{other:?}"),
        };
        assert_eq!(meant("3,5 Hz"), ["3.5 Hz"]);
        assert_eq!(meant("1,000 ms"), ["1.000 ms", "1000 ms"]);
        assert_eq!(meant("20 000 ms"), ["20000 ms"]);
        assert_eq!(miswritten("3.5 Hz"), None);
        assert_eq!(miswritten("3, 5, 7 Hz"), None);
    }
}
