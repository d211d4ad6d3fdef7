//! A number that follows from a robot file.

use serde::{Serialize, Serializer};
use twinrig_kernel::Unit;

use super::assumed::Assumed;

/// A number, or several of the same unit, that follow from a robot file.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Fact {
    /// Name for programs.
    pub key: &'static str,
    /// Name for readers.
    pub name: &'static str,
    /// Values in SI units; empty where there is none, for the reason in `note`.
    #[serde(serialize_with = "one_or_many")]
    pub value: Vec<f64>,
    /// Unit of the values.
    #[serde(serialize_with = "symbol")]
    pub unit: Unit,
    /// Condition or explanation; may be empty.
    pub note: String,
    /// Keys of the file from which the values follow; a table stands for all its keys.
    #[serde(skip)]
    pub from: Vec<String>,
    /// Keys of the file among them that are marked as assumed.
    pub assumed: Vec<String>,
}

impl Fact {
    /// Creates a fact that follows from the keys `from`, separated by spaces.
    pub fn new(
        key: &'static str,
        name: &'static str,
        value: impl IntoIterator<Item = f64>,
        unit: Unit,
        from: &str,
    ) -> Self {
        Self {
            key,
            name,
            value: value.into_iter().collect(),
            unit,
            note: String::new(),
            from: from.split_whitespace().map(str::to_owned).collect(),
            assumed: Vec::new(),
        }
    }

    /// Adds a condition or an explanation.
    pub fn with_note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Determines the keys that are assumed.
    pub fn mark(&mut self, assumed: &Assumed) {
        let keys = self.from.iter().flat_map(|key| assumed.about(key));
        self.assumed = keys.map(str::to_owned).collect();
        self.assumed.sort();
        self.assumed.dedup();
    }
}

fn one_or_many<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    match values {
        [] => serializer.serialize_none(),
        [one] => one.serialize(serializer),
        many => many.serialize(serializer),
    }
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde requires"
)]
fn symbol<S: Serializer>(unit: &Unit, serializer: S) -> Result<S::Ok, S::Error> {
    unit.symbol().serialize(serializer)
}

/// Returns the values for readers, with four digits and a unit: lengths in millimetres, angles in
/// degrees, masses below 1 kg in grams.
pub(crate) fn shown(values: &[f64], unit: Unit) -> String {
    let light = values.iter().all(|value| value.abs() < 1.0);
    let (scale, symbol) = match unit {
        Unit::Meter => (1e3, "mm"),
        Unit::Radian => (180.0 / core::f64::consts::PI, "°"),
        Unit::Kilogram if light => (1e3, "g"),
        Unit::KilogramSquareMeter => (1e6, "kg·mm²"),
        Unit::Second => (1e3, "ms"),
        unit => (1.0, unit.symbol()),
    };
    let numbers: Vec<_> = values.iter().map(|value| digits(value * scale)).collect();
    format!("{} {symbol}", numbers.join(" … "))
}

/// Returns a number with four significant digits, without trailing zeros behind the point.
fn digits(value: f64) -> String {
    let magnitude = value.abs();
    let places = match magnitude {
        m if m >= 1000.0 => 0,
        m if m >= 100.0 => 1,
        m if m >= 10.0 => 2,
        m if m >= 1.0 => 3,
        m if m >= 0.1 => 4,
        _ => 5,
    };
    let text = format!("{value:.places$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    match text {
        "-0" => "0".to_owned(),
        text => text.to_owned(),
    }
}
