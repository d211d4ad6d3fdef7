//! Lines of a robot file, each with the source of its value.

use core::fmt::Write;

use twinrig_document::print_quantity;
use twinrig_kernel::Unit;

/// Least width of an entry, before its comment.
const WIDTH: usize = 43;
/// Significant digits of values: the last ones of a sum are roundings.
const DIGITS: usize = 13;
/// Significant digits of assumed values.
const DIGITS_ASSUMED: usize = 4;

/// Where a value is from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    /// The description.
    File,
    /// Cheetah-cub.
    Assumed,
}

/// Lines of a robot file.
#[derive(Default)]
pub(super) struct Lines {
    pub(super) text: String,
    pub(super) read: usize,
    pub(super) assumed: usize,
}

impl Lines {
    pub(super) fn raw(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// Adds an entry, with the source of its value and a note in the comment.
    pub(super) fn entry(&mut self, key: &str, value: &str, from: Origin, note: &str) {
        let source = match from {
            Origin::File => {
                self.read += 1;
                "FILE"
            }
            Origin::Assumed => {
                self.assumed += 1;
                "ASSUMED"
            }
        };
        let entry = format!("{key} = {value}");
        let colon = if note.is_empty() { "" } else { ": " };
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{entry:WIDTH$} # {source}{colon}{note}");
    }

    /// Adds a value that may be unknown, and then is `scaled`.
    pub(super) fn either(&mut self, key: &str, value: Option<f64>, scaled: f64, unit: Unit) {
        match value {
            Some(value) => self.entry(key, &quantity(value, unit), Origin::File, ""),
            None => self.entry(key, &assumed(scaled, unit), Origin::Assumed, ""),
        }
    }
}

/// Returns the value as a string of TOML, in the unit in which people write it.
pub(super) fn quantity(value: f64, unit: Unit) -> String {
    written(value, unit, DIGITS)
}

/// Returns an assumed value as a string of TOML.
pub(super) fn assumed(value: f64, unit: Unit) -> String {
    written(value, unit, DIGITS_ASSUMED)
}

fn written(value: f64, unit: Unit, digits: usize) -> String {
    let rounded = |value: f64| {
        let text = format!("{value:.*e}", digits - 1);
        // A formatted number is a number; zero has no sign.
        text.parse().unwrap_or(value) + 0.0
    };
    let (scale, spelling) = match unit {
        Unit::Meter => (1e3, "mm"),
        Unit::Kilogram => (1e3, "g"),
        Unit::Second => (1e3, "ms"),
        Unit::Radian => return format!("\"{} deg\"", rounded(value.to_degrees())),
        _ => return format!("\"{}\"", print_quantity(rounded(value), unit)),
    };
    format!("\"{} {spelling}\"", rounded(value * scale))
}
