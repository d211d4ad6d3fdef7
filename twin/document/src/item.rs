//! One value that is being read.

use twinrig_kernel::{SimDuration, Unit};

use crate::document::{Overrides, SET_TWICE};
use crate::error::Problem;
use crate::near;
use crate::node::{Node, Value};
use crate::quantity::{self, QuantityError};
use crate::range::Range;
use crate::source::Place;
use crate::table::{Problems, Reported, Table};

/// A value of a document. Each accessor gives the value as a type, or reports why it is not one.
#[derive(Debug)]
pub struct Item<'d> {
    node: &'d Node,
    path: String,
    problems: &'d Problems,
}

impl<'d> Item<'d> {
    pub(crate) fn new(node: &'d Node, path: String, problems: &'d Problems) -> Self {
        Item {
            node,
            path,
            problems,
        }
    }

    /// Its dotted path in the document: `plant.step`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The last part of its path: `step`.
    pub fn key(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or(&self.path)
    }

    /// Where it stands.
    pub fn place(&self) -> Place {
        self.node.place.clone()
    }

    /// Notes that this value is wrong.
    pub fn report(&self, message: impl Into<String>, help: impl Into<String>) -> Reported {
        self.problems
            .report(Problem::at(&self.node.place, message, help))
    }

    /// Notes a warning about this value.
    pub fn warn(&self, code: &'static str, message: impl Into<String>, help: impl Into<String>) {
        self.problems
            .warn(code, Problem::at(&self.node.place, message, help));
    }

    /// Notes that what stands at `place`, in this document, is wrong.
    pub fn report_at(
        &self,
        place: &Place,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.problems.report(Problem::at(place, message, help))
    }

    /// Notes that the word `word` is not one of `candidates`, which are `what` (`models in this build`).
    pub fn report_word<'c>(
        &self,
        message: impl Into<String>,
        word: &str,
        what: &str,
        candidates: impl IntoIterator<Item = &'c str>,
    ) -> Reported {
        self.report(message, near::suggestion(word, what, candidates))
    }

    /// Whether it is a text.
    pub fn is_text(&self) -> bool {
        matches!(self.node.value, Value::Text(_))
    }

    /// Whether it is a table.
    pub fn is_table(&self) -> bool {
        matches!(self.node.value, Value::Table(_))
    }

    /// The keys of a table, in the order of the text; none if it is something else. Asks for none of them.
    pub fn keys(&self) -> Option<impl Iterator<Item = &'d str> + use<'d>> {
        match &self.node.value {
            Value::Table(entries) => Some(entries.iter().map(|entry| entry.key.as_str())),
            _ => None,
        }
    }

    /// The value of `key`, if it is a table that has it. Unlike [`Table::get`] this does not ask for the key: it is for
    /// looking before reading.
    pub fn peek(&self, key: &str) -> Option<Item<'d>> {
        let Value::Table(entries) = &self.node.value else {
            return None;
        };
        let entry = entries.iter().find(|entry| entry.key == key)?;
        let path = format!("{}.{key}", self.path);
        Some(Item::new(&entry.node, path, self.problems))
    }

    /// The unit that a quantity is spelled in; [`Unit::One`] for a bare number and for what is no quantity.
    pub fn spelled_unit(&self) -> Unit {
        match &self.node.value {
            Value::Text(text) => quantity::spelled_unit(text),
            _ => Unit::One,
        }
    }

    /// The unit that a quantity is spelled in, where any unit goes.
    ///
    /// # Errors
    /// There is a unit, and it is not known.
    pub fn any_unit(&self) -> Result<Unit, Reported> {
        match &self.node.value {
            Value::Text(text) => {
                quantity::any_unit(text).map_err(|error| self.report(error.message, error.help))
            }
            _ => Ok(Unit::One),
        }
    }

    /// Whether it is a list.
    pub fn is_list(&self) -> bool {
        matches!(self.node.value, Value::List(_))
    }

    /// A text.
    ///
    /// # Errors
    /// It is something else.
    pub fn text(&self) -> Result<&'d str, Reported> {
        match &self.node.value {
            Value::Text(text) => Ok(text),
            _ => Err(self.not("a text in quotes")),
        }
    }

    /// One of several words, each with what it stands for.
    ///
    /// # Errors
    /// It is another word or not a text.
    pub fn choice<T: Clone>(&self, choices: &[(&str, T)]) -> Result<T, Reported> {
        let text = self.text()?;
        if let Some((_, value)) = choices.iter().find(|(word, _)| *word == text) {
            return Ok(value.clone());
        }
        let message = format!("`{text}` is no `{}`", self.key());
        let words = choices.iter().map(|(word, _)| *word);
        Err(self.report_word(message, text, "it may be", words))
    }

    /// True or false.
    ///
    /// # Errors
    /// It is something else.
    pub fn boolean(&self) -> Result<bool, Reported> {
        match &self.node.value {
            Value::Boolean(value) => Ok(*value),
            _ => Err(self.not("true or false")),
        }
    }

    /// A whole number, not negative.
    ///
    /// # Errors
    /// It is something else, negative, or larger than 2⁶⁴ − 1.
    pub fn natural(&self) -> Result<u64, Reported> {
        match &self.node.value {
            Value::Integer(digits) => digits.parse().map_err(|_| {
                let message = format!("`{}` is {digits}", self.key());
                self.report(
                    message,
                    "wanted is a whole number from 0 to 18446744073709551615",
                )
            }),
            _ => Err(self.not("a whole number")),
        }
    }

    /// A quantity, in the unit of the International System, within `range`. A bare number is accepted only where
    /// `unit` is [`Unit::One`].
    ///
    /// # Errors
    /// It is no quantity, of another dimension, not finite, or outside the range.
    pub fn quantity(&self, unit: Unit, range: &Range) -> Result<f64, Reported> {
        let value = match &self.node.value {
            Value::Text(text) => quantity::parse_quantity(text, unit),
            Value::Integer(digits) | Value::Float(digits) if unit == Unit::One => number(digits),
            Value::Integer(digits) | Value::Float(digits) => Err(QuantityError {
                message: format!(
                    "`{}` is {digits} without a unit; wanted is {}",
                    self.key(),
                    quantity::quantity_name(unit)
                ),
                help: quantity::example(unit),
            }),
            _ => return Err(self.not_help(quantity::quantity_name(unit), quantity::example(unit))),
        };
        let value = value.map_err(|error| self.report(error.message, error.help))?;
        if range.contains(value) {
            return Ok(value);
        }
        let shown = quantity::print_quantity(value, unit);
        let message = format!("`{}` is {shown}, which is out of range", self.key());
        let help = format!("it must be {}", range.words(unit.symbol()));
        Err(self.report(message, help))
    }

    /// A number without a dimension, within `range`.
    ///
    /// # Errors
    /// As [`Item::quantity`].
    pub fn number(&self, range: &Range) -> Result<f64, Reported> {
        self.quantity(Unit::One, range)
    }

    /// A duration, exact to the nanosecond; zero is one.
    ///
    /// # Errors
    /// It is no duration, negative, or not a whole number of nanoseconds.
    pub fn duration(&self) -> Result<SimDuration, Reported> {
        // The accessor of quantities says best what is wrong with something that is not a text.
        let Value::Text(text) = &self.node.value else {
            self.quantity(Unit::Second, &Range::NOT_NEGATIVE)?;
            return Err(self.not("a duration"));
        };
        quantity::parse_duration(text).map_err(|error| self.report(error.message, error.help))
    }

    /// A duration longer than zero.
    ///
    /// # Errors
    /// As [`Item::duration`], and zero.
    pub fn positive_duration(&self) -> Result<SimDuration, Reported> {
        let duration = self.duration()?;
        if duration.as_nanos() == 0 {
            let message = format!("`{}` is zero", self.key());
            return Err(self.report(message, "it must be longer than 0 s"));
        }
        Ok(duration)
    }

    /// A table.
    ///
    /// # Errors
    /// It is something else.
    pub fn table(&self) -> Result<Table<'d>, Reported> {
        match &self.node.value {
            Value::Table(_) => Ok(Table::new(self.node, &self.path, self.problems)),
            _ => Err(self.not_help(
                "a table",
                format!("write it as in {} = {{ … }}", self.key()),
            )),
        }
    }

    /// The items of a list.
    ///
    /// # Errors
    /// It is something else.
    pub fn list(&self) -> Result<Vec<Item<'d>>, Reported> {
        let Value::List(nodes) = &self.node.value else {
            return Err(self.not("a list"));
        };
        let item = |node| Item::new(node, self.path.clone(), self.problems);
        Ok(nodes.iter().map(item).collect())
    }

    /// The list that `read` makes, item by item; every item is read, even after a problem.
    ///
    /// # Errors
    /// It is no list, or `read` reported something.
    pub fn each<T>(
        &self,
        read: impl FnMut(&Item<'d>) -> Result<T, Reported>,
    ) -> Result<Vec<T>, Reported> {
        let read: Vec<_> = self.list()?.iter().map(read).collect();
        read.into_iter().collect()
    }

    /// A list of texts.
    ///
    /// # Errors
    /// It is something else.
    pub fn texts(&self) -> Result<Vec<&'d str>, Reported> {
        self.each(Item::text)
    }

    /// A table whose entries are to replace those of another document. Its keys are checked there.
    ///
    /// # Errors
    /// It is not a table.
    pub fn overrides(&self) -> Result<Overrides, Reported> {
        match &self.node.value {
            Value::Table(_) => {
                let overrides = Overrides::of(self.node);
                for problem in overrides.set_twice() {
                    self.problems.warn(SET_TWICE, problem);
                }
                Ok(overrides)
            }
            _ => Err(self.not("a table")),
        }
    }

    fn not(&self, wanted: &str) -> Reported {
        self.not_help(wanted, String::new())
    }

    fn not_help(&self, wanted: &str, help: String) -> Reported {
        let message = format!(
            "`{}` is {}; wanted is {wanted}",
            self.key(),
            self.node.value.what()
        );
        self.report(message, help)
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
