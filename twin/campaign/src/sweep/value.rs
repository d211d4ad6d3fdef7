//! Values of the settings of a point.

use serde::{Serialize, Serializer};
use twinrig_document::{Item, Range, parse_quantity, print_quantity, quoted};
use twinrig_kernel::Unit;

/// Value of a setting.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepValue {
    /// In TOML: `"2.5 m"` with its quotes.
    pub toml: String,
    /// Its number in the SI unit, if it has one.
    pub number: Option<f64>,
    /// The SI unit; [`Unit::One`] without a number.
    pub unit: Unit,
}

impl SweepValue {
    /// Returns the value as the document has it. A text that begins with a number and ends with a
    /// known unit is a quantity.
    pub(super) fn of(item: &Item<'_>) -> Self {
        let toml = toml(item);
        if item.is_text() {
            let unit = item.spelled_unit();
            let number = item.text().ok();
            let number = number.and_then(|text| parse_quantity(text, unit).ok());
            return Self {
                toml,
                number,
                unit: number.map_or(Unit::One, |_| unit),
            };
        }
        let number = toml.replace('_', "").parse().ok();
        Self {
            number: number.filter(|number: &f64| number.is_finite()),
            toml,
            unit: Unit::One,
        }
    }

    /// Returns a quantity. A time is rounded to the nanosecond, as durations of a scenario are
    /// whole nanoseconds.
    pub fn quantity(number: f64, unit: Unit) -> Self {
        let number = match unit {
            Unit::Second => libm::round(number * 1e9) / 1e9,
            _ => number,
        };
        let text = print_quantity(number, unit);
        Self {
            toml: match unit {
                Unit::One => text,
                _ => format!("\"{text}\""),
            },
            number: Some(number),
            unit,
        }
    }

    /// Returns a whole number.
    pub fn whole(number: u64) -> Self {
        Self {
            toml: number.to_string(),
            number: Some(number as f64),
            unit: Unit::One,
        }
    }

    /// Returns the value for readers: without the quotes of a text.
    pub fn shown(&self) -> &str {
        let quoted = self.toml.strip_prefix('"');
        let inner = quoted.and_then(|rest| rest.strip_suffix('"'));
        // An escaped text stays as it is written.
        inner
            .filter(|inner| !inner.contains('\\'))
            .unwrap_or(&self.toml)
    }

    /// Returns the cell of a table: the number in the SI unit, otherwise the text.
    pub fn cell(&self) -> String {
        match (self.natural(), self.number) {
            (None, Some(number)) => number.to_string(),
            _ => self.shown().to_owned(),
        }
    }

    /// Returns a plain whole number, which may have more digits than `f64`.
    fn natural(&self) -> Option<u64> {
        self.toml.parse().ok()
    }

    pub(super) const RANGE: Range = Range::ANY;
}

/// Returns a value of a document in TOML: a text in double quotes, anything else as it is written.
pub(super) fn toml(item: &Item<'_>) -> String {
    if item.is_text() {
        item.text().map_or_else(|_| String::new(), quoted)
    } else {
        item.toml().to_owned()
    }
}

/// The number in the SI unit, otherwise the text.
impl Serialize for SweepValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match (self.natural(), self.number) {
            (Some(number), _) => serializer.serialize_u64(number),
            (None, Some(number)) => serializer.serialize_f64(number),
            (None, None) => serializer.serialize_str(self.shown()),
        }
    }
}
