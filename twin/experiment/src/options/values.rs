//! Values of options.

use twinrig_campaign::sweep::POINTS_MOST;
use twinrig_document::{parse_duration, parse_quantity};
use twinrig_kernel::{SimDuration, Unit};

/// Returns a duration: `300 ms`.
///
/// # Errors
/// A text that is none.
pub fn any_duration(text: &str) -> Result<SimDuration, String> {
    parse_duration(text).map_err(|error| error.to_string())
}

/// Returns a duration above zero.
///
/// # Errors
/// A text that is none.
pub fn duration(text: &str) -> Result<SimDuration, String> {
    let duration = any_duration(text)?;
    if duration.is_zero() {
        return Err("it must be positive".to_owned());
    }
    Ok(duration)
}

/// A greater one is a mistake in the unit: a run has tens of plateaus.
pub(crate) fn plateau(text: &str) -> Result<SimDuration, String> {
    let length = duration(text)?;
    if length > SimDuration::from_secs(3600) {
        return Err("it must be at most 3600 s".to_owned());
    }
    Ok(length)
}

/// Returns a length of zero or more \[m\].
///
/// # Errors
/// A text that is none.
pub fn length(text: &str) -> Result<f64, String> {
    non_negative(text, Unit::Meter)
}

/// Returns a share of zero or more, as `5 %` or as a number.
///
/// # Errors
/// A text that is none.
pub fn share(text: &str) -> Result<f64, String> {
    non_negative(text, Unit::One)
}

/// Returns the greatest deviation of a phase, as a share of the cycle.
///
/// # Errors
/// A text that is none.
pub(crate) fn deviation(text: &str) -> Result<f64, String> {
    let deviation = share(text)?;
    if deviation > 0.5 {
        return Err("it must be at most 0.5: no phases are farther apart".to_owned());
    }
    Ok(deviation)
}

fn non_negative(text: &str, unit: Unit) -> Result<f64, String> {
    let value = parse_quantity(text, unit).map_err(|error| error.to_string())?;
    if value < 0.0 {
        return Err("it must not be negative".to_owned());
    }
    Ok(value)
}

/// Returns a whole number of 1 or more.
///
/// # Errors
/// A text that is none.
pub fn whole_number(text: &str) -> Result<usize, String> {
    number_from(1, text)
}

/// One run has nothing to be compared with.
pub(crate) fn runs_of_ensemble(text: &str) -> Result<usize, String> {
    number_from(2, text)
}

/// Returns a length above zero \[m\].
pub(crate) fn tolerance(text: &str) -> Result<f64, String> {
    match parse_quantity(text, Unit::Meter) {
        Ok(length) if length > 0.0 => Ok(length),
        Ok(_) => Err("it must be positive".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// Returns a whole number of 0 or more.
///
/// # Errors
/// A text that is none.
pub fn whole_number_or_none(text: &str) -> Result<usize, String> {
    number_from(0, text)
}

fn number_from(least: usize, text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (least..=POINTS_MOST).contains(&count) => Ok(count),
        _ => Err(format!(
            "it must be a whole number from {least} to {POINTS_MOST}"
        )),
    }
}

/// Returns a budget \[s\], as `30 s` or as a number of seconds.
///
/// # Errors
/// A text that is none.
pub fn seconds(text: &str) -> Result<f64, String> {
    let seconds = match text.parse() {
        Ok(seconds) => seconds,
        Err(_) => duration(text)?.as_secs_f64(),
    };
    if seconds > 0.0 && seconds < 1e6 {
        return Ok(seconds);
    }
    Err("it must be above 0 and below 1000000 s".to_owned())
}

/// Returns key and value of `KEY=VALUE`.
///
/// # Errors
/// A text without a key, or with several.
pub fn key_value(text: &str) -> Result<(String, String), String> {
    if text.trim_start().starts_with('{') {
        return Err("KEY=VALUE is required, not JSON".to_owned());
    }
    let (key, value) = match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => (key.trim(), value.trim()),
        _ => return Err("KEY=VALUE is required".to_owned()),
    };
    match second_setting(value) {
        Some(second) => Err(format!("each setting needs its own --set: --set {second}")),
        None => Ok((key.to_owned(), value.to_owned())),
    }
}

/// Returns the rest of a value that begins with `KEY=`, behind a blank that is neither in quotes
/// nor in brackets.
fn second_setting(value: &str) -> Option<&str> {
    let (mut quote, mut depth) = (None, 0_usize);
    for (index, character) in value.char_indices() {
        match (quote, character) {
            (Some(open), _) => quote = quote.filter(|_| open != character),
            (None, '"' | '\'') => quote = Some(character),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, blank) if blank.is_whitespace() && depth == 0 => {
                let rest = value[index..].trim_start();
                let key = rest.split_once('=')?.0.trim_end();
                let is_key = |one: char| one.is_ascii_alphanumeric() || "._-".contains(one);
                if !key.is_empty() && key.chars().all(is_key) {
                    return Some(rest);
                }
            }
            (None, _) => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_no_memory_holds_are_refused() {
        assert_eq!(whole_number("1000000"), Ok(POINTS_MOST));
        for text in [
            "0",
            "1000001",
            "9223372036854775807",
            "18446744073709551616",
        ] {
            let error = whole_number(text).unwrap_err();
            assert_eq!(error, "it must be a whole number from 1 to 1000000");
        }
    }

    #[test]
    fn setting_is_split_at_first_equals_sign() {
        let parsed = key_value("plant.step = a=b").unwrap();
        assert_eq!(parsed, ("plant.step".to_owned(), "a=b".to_owned()));
        assert!(key_value("plant.step").is_err() && key_value("=1").is_err());
    }

    #[test]
    fn second_setting_is_refused_outside_of_quotes_and_brackets() {
        for text in [
            r#"duration = "2 s" seed = 2"#,
            "name=a b  c.d=e",
            "a=[1, 2] b-c={d = 1}",
        ] {
            let error = key_value(text).unwrap_err();
            assert!(error.contains("its own --set"), "{text}: {error}");
        }
        for text in [
            r#"name="a b=c""#,
            "ground={ friction = 0.6, profile = 'flat b=c' }",
            "name=a (b = c)",
            "duration=2 s",
            r#"order=["a b=c", { d=1 }]"#,
        ] {
            assert!(key_value(text).is_ok(), "{text}");
        }
    }
}
