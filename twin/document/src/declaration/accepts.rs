//! Values that are accepted by themselves.

use std::convert::Infallible;
use std::ops::RangeInclusive;

use twinrig_kernel::Unit;

use crate::{Range, quantity_name};

/// Accepted values of a key; `O` is the declaration of a key of a group.
#[derive(Clone, Debug, PartialEq)]
pub enum Accepts<O = Infallible> {
    /// A quantity with a unit; a bare number where the unit is [`Unit::One`].
    Quantity {
        /// Its unit.
        unit: Unit,
        /// Its range, in that unit.
        range: Range,
    },
    /// A duration, in whole nanoseconds.
    Duration,
    /// A duration longer than zero.
    PositiveDuration,
    /// A whole number within a range.
    Natural(RangeInclusive<u64>),
    /// True or false.
    Boolean,
    /// A plain number, true or false, or a text: only the part itself knows the type.
    Scalar,
    /// Any text.
    Text,
    /// A name that only the part itself can resolve, or a file name; its position is kept for
    /// errors of the part.
    Name,
    /// A list of at least one such name.
    Names,
    /// One of these words.
    Choice(Vec<String>),
    /// A time model: a duration, a distribution, or a recorded trace.
    Time,
    /// A table of options.
    Group(Vec<O>),
    /// A table with names chosen by the user and a value for each.
    Table(Box<Accepts<O>>),
    /// One value for all members of a set (boards, legs), or a table with values of named members.
    Each(Box<Accepts<O>>),
}

impl<O> Accepts<O> {
    /// Returns a description: `length, greater than 0 m`.
    pub fn words(&self) -> String {
        match self {
            Accepts::Quantity { unit, range } => {
                let (noun, degrees) = (noun(*unit), |angle: f64| angle.to_degrees());
                match unit {
                    Unit::Radian => {
                        let (min, max) = (range.min.map(degrees), range.max.map(degrees));
                        bounded(noun, &Range { min, max }, "deg")
                    }
                    _ => bounded(noun, range, unit.symbol()),
                }
            }
            Accepts::Duration => "duration".to_owned(),
            Accepts::PositiveDuration => "duration above 0".to_owned(),
            Accepts::Natural(range) => match (*range.start(), *range.end()) {
                (0, u64::MAX) => "whole number".to_owned(),
                (start, u64::MAX) => format!("whole number from {start}"),
                (start, end) => format!("whole number from {start} to {end}"),
            },
            Accepts::Boolean => "boolean".to_owned(),
            Accepts::Scalar => "number, boolean or text".to_owned(),
            Accepts::Time => "time".to_owned(),
            _ => "text".to_owned(),
        }
    }
}

/// Returns a noun with a range, unless that is all numbers.
pub(super) fn bounded(noun: &str, range: &Range, symbol: &str) -> String {
    if *range == Range::ANY {
        return noun.to_owned();
    }
    format!("{noun}, {}", range.words(symbol))
}

/// Returns the name of the quantity in a unit, without article.
fn noun(unit: Unit) -> &'static str {
    match unit {
        Unit::One => "number",
        _ => quantity_name(unit)
            .split_once(' ')
            .map_or("quantity", |(_, noun)| noun),
    }
}
