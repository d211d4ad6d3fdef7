//! A value that is being read.

mod list;

use twinrig_kernel::{SimDuration, Unit};

use crate::error::{Placed, Problem};
use crate::near;
use crate::node::{Node, Value};
use crate::overrides::{Overrides, SET_TWICE};
use crate::probe;
use crate::problems::{Problems, Reported};
use crate::quantity::{self, QuantityError};
use crate::range::{Range, readable};
use crate::source::Place;

/// A value of a document. Each accessor returns the value as a type, or reports why it is of
/// another.
#[derive(Debug)]
pub struct Item<'d> {
    pub(crate) node: &'d Node,
    pub(crate) path: String,
    pub(crate) problems: &'d Problems,
}

impl<'d> Item<'d> {
    pub(crate) fn new(node: &'d Node, path: String, problems: &'d Problems) -> Self {
        Item {
            node,
            path,
            problems,
        }
    }

    /// Dotted path in the document: `plant.step`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Last part of the path: `step`.
    pub fn key(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or(&self.path)
    }

    /// Position of the value.
    pub fn place(&self) -> Place {
        self.node.place.clone()
    }

    /// Value as it is written, in TOML.
    pub fn toml(&self) -> &'d str {
        self.node.place.text()
    }

    /// Reports a problem with this value.
    pub fn report(&self, message: impl Into<String>, help: impl Into<String>) -> Reported {
        self.problems
            .report(Problem::at(&self.node.place, message, help))
    }

    /// Adds a warning about this value.
    pub fn warn(&self, code: &'static str, message: impl Into<String>, help: impl Into<String>) {
        self.problems
            .warn(code, Problem::at(&self.node.place, message, help));
    }

    /// Reports a problem at `place` in this document.
    pub fn report_at(
        &self,
        place: &Place,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.problems.report(Problem::at(place, message, help))
    }

    /// Reports that `word` is not among `candidates`, which `label` describes
    /// (`models in this build`).
    pub fn report_word<'c>(
        &self,
        message: impl Into<String>,
        word: &str,
        label: &str,
        candidates: impl IntoIterator<Item = &'c str>,
    ) -> Reported {
        self.report(message, near::suggestion(word, label, candidates))
    }

    /// Whether the value is a string.
    pub fn is_text(&self) -> bool {
        matches!(self.node.value, Value::Text(_))
    }

    /// Whether the value is true or false.
    pub fn is_boolean(&self) -> bool {
        matches!(self.node.value, Value::Boolean(_))
    }

    /// Whether the value is a table.
    pub fn is_table(&self) -> bool {
        matches!(self.node.value, Value::Table(_))
    }

    /// Keys of a table, in the order of the text; `None` for another type. The keys do not count as
    /// requested.
    pub fn keys(&self) -> Option<impl Iterator<Item = &'d str> + use<'d>> {
        match &self.node.value {
            Value::Table(entries) => Some(entries.iter().map(|entry| entry.key.as_str())),
            _ => None,
        }
    }

    /// Returns the value of `key`, if this is a table with that key. Unlike
    /// [`Table::get`](crate::Table::get) this does not count as a request for the key.
    pub fn peek(&self, key: &str) -> Option<Item<'d>> {
        let Value::Table(entries) = &self.node.value else {
            return None;
        };
        let entry = entries.iter().find(|entry| entry.key == key)?;
        let path = format!("{}.{key}", self.path);
        Some(Item::new(&entry.node, path, self.problems))
    }

    /// Unit in which a quantity is written; [`Unit::One`] for a bare number and for other types.
    pub fn spelled_unit(&self) -> Unit {
        match &self.node.value {
            Value::Text(text) => quantity::spelled_unit(text),
            _ => Unit::One,
        }
    }

    /// Unit in which a quantity is written, where any unit is accepted.
    ///
    /// # Errors
    /// The unit is unknown.
    pub fn any_unit(&self) -> Result<Unit, Reported> {
        match &self.node.value {
            Value::Text(text) => {
                quantity::any_unit(text).map_err(|error| self.report(error.message, error.help))
            }
            _ => Ok(Unit::One),
        }
    }

    /// Whether the value is a list.
    pub fn is_list(&self) -> bool {
        matches!(self.node.value, Value::List(_))
    }

    /// Returns the value as a string.
    ///
    /// # Errors
    /// The value has another type.
    pub fn text(&self) -> Result<&'d str, Reported> {
        match &self.node.value {
            Value::Text(text) => Ok(text),
            _ => Err(self.wrong_type("a text in quotes")),
        }
    }

    /// Returns the value as a string with its position.
    ///
    /// # Errors
    /// The value has another type.
    pub fn placed_text(&self) -> Result<Placed<String>, Reported> {
        let value = self.text()?.to_owned();
        let place = self.place();
        Ok(Placed { value, place })
    }

    /// Returns the value that belongs to one of several words.
    ///
    /// # Errors
    /// The value is another word or not a string.
    pub fn choice<T: Clone>(&self, choices: &[(&str, T)]) -> Result<T, Reported> {
        let text = self.text()?;
        if let Some((_, value)) = choices.iter().find(|(word, _)| *word == text) {
            return Ok(value.clone());
        }
        let message = format!("`{text}` is not a valid `{}`", self.key());
        let words = choices.iter().map(|(word, _)| *word);
        Err(self.report_word(message, text, "it may be", words))
    }

    /// Returns the value as a boolean.
    ///
    /// # Errors
    /// The value has another type.
    pub fn boolean(&self) -> Result<bool, Reported> {
        match &self.node.value {
            Value::Boolean(value) => Ok(*value),
            _ => Err(self.wrong_type("true or false")),
        }
    }

    /// Returns the value as a non-negative integer.
    ///
    /// # Errors
    /// The value has another type, is negative, or exceeds 2⁶⁴ − 1.
    pub fn natural(&self) -> Result<u64, Reported> {
        match &self.node.value {
            Value::Integer(digits) => digits.parse().map_err(|_| {
                let message = format!("`{}` is {digits}", self.key());
                self.report(
                    message,
                    "expected a whole number from 0 to 18446744073709551615",
                )
            }),
            _ => Err(self.wrong_type("a whole number")),
        }
    }

    /// Returns a quantity in the SI unit `unit`, within `range`. A bare number is accepted only if
    /// `unit` is [`Unit::One`].
    ///
    /// # Errors
    /// The value is not a quantity, has another dimension, is not finite, or is outside the range.
    pub fn quantity(&self, unit: Unit, range: &Range) -> Result<f64, Reported> {
        let value = match &self.node.value {
            Value::Text(text) => quantity::parse_quantity(text, unit),
            Value::Integer(digits) | Value::Float(digits) if unit == Unit::One => number(digits),
            Value::Integer(digits) | Value::Float(digits) => Err(QuantityError {
                message: format!(
                    "`{}` is {digits} without a unit; expected {}",
                    self.key(),
                    quantity::quantity_name(unit)
                ),
                help: quantity::example_of(digits, unit),
            }),
            _ => {
                return Err(self
                    .wrong_type_with_help(quantity::quantity_name(unit), quantity::example(unit)));
            }
        };
        let value = value.map_err(|error| self.report(error.message, error.help))?;
        let value = value * probe::factor(&self.path, &self.node.place);
        if range.contains(value) {
            return Ok(value);
        }
        let text = match &self.node.value {
            Value::Text(text) => text.as_str(),
            _ => "",
        };
        // Limits are in the unit of the value, if that is no power of ten of the SI unit.
        let (shown, range) = match quantity::spelled_factor(text, unit) {
            Some((symbol, factor)) => (text.to_owned(), range.scaled(1.0 / factor).words(symbol)),
            None => (print_readable(value, unit), range.words(unit.symbol())),
        };
        let message = format!("`{}` is {shown}, which is out of range", self.key());
        let help = format!("it must be {range}");
        Err(self.report(message, help))
    }

    /// Returns a dimensionless number within `range`.
    ///
    /// # Errors
    /// As [`Item::quantity`].
    pub fn number(&self, range: &Range) -> Result<f64, Reported> {
        self.quantity(Unit::One, range)
    }

    /// Returns a duration, exact to the nanosecond; zero is accepted.
    ///
    /// # Errors
    /// The value is not a duration, is negative, or is not a whole number of nanoseconds.
    pub fn duration(&self) -> Result<SimDuration, Reported> {
        // For other types than strings the accessor of quantities has the best message.
        let Value::Text(text) = &self.node.value else {
            self.quantity(Unit::Second, &Range::NOT_NEGATIVE)?;
            return Err(self.wrong_type("a duration"));
        };
        let duration = quantity::parse_duration(text);
        let duration = duration.map_err(|error| self.report(error.message, error.help))?;
        let factor = probe::factor(&self.path, &self.node.place);
        Ok(if factor.to_bits() == 1.0_f64.to_bits() {
            duration
        } else {
            SimDuration::try_from_secs_f64(duration.as_secs_f64() * factor).unwrap_or(duration)
        })
    }

    /// Returns a duration greater than zero.
    ///
    /// # Errors
    /// As [`Item::duration`]; also zero.
    pub fn positive_duration(&self) -> Result<SimDuration, Reported> {
        let duration = self.duration()?;
        if duration.as_nanos() == 0 {
            let message = format!("`{}` is zero", self.key());
            return Err(self.report(message, "it must be longer than 0 s"));
        }
        Ok(duration)
    }

    /// Returns a table whose entries replace those of another document, where its keys are checked.
    ///
    /// # Errors
    /// The value is not a table.
    pub fn overrides(&self) -> Result<Overrides, Reported> {
        match &self.node.value {
            Value::Table(_) => {
                let overrides = Overrides::of(self.node);
                for problem in overrides.set_twice() {
                    self.problems.warn(SET_TWICE, problem);
                }
                Ok(overrides)
            }
            _ => Err(self.wrong_type("a table")),
        }
    }

    fn wrong_type(&self, expected: &str) -> Reported {
        self.wrong_type_with_help(expected, String::new())
    }

    pub(crate) fn wrong_type_with_help(&self, expected: &str, help: String) -> Reported {
        let message = format!(
            "`{}` is {}; expected {expected}",
            self.key(),
            self.node.value.type_name()
        );
        self.report(message, help)
    }
}

/// Formats a quantity in the SI unit for a message.
fn print_readable(value: f64, unit: Unit) -> String {
    match unit.symbol() {
        "" | "1" => readable(value),
        symbol => format!("{} {symbol}", readable(value)),
    }
}

fn number(digits: &str) -> Result<f64, QuantityError> {
    match digits.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(QuantityError {
            message: format!("`{digits}` is not a finite number"),
            help: String::new(),
        }),
    }
}
