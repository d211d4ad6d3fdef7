//! Accepted values of the keys of built-in tables.

use twinrig_document::{Range, quantity_name};
use twinrig_kernel::Unit;

use super::TableSpec;
use crate::domain::Domain;
use crate::options::Accepts;

/// Accepted values of a key of a built-in table.
#[derive(Clone)]
pub(crate) enum Shape {
    /// A value that options of kinds have as well.
    One(Accepts),
    /// A quantity of any dimension, or, in a table of a measure, in its unit.
    Measured(Range),
    /// As `Measured`, or a percentage.
    Tolerance,
    /// One of these words.
    Choice(fn() -> Vec<&'static str>),
    /// A text that matches a pattern.
    Pattern(&'static str),
    /// The boolean `false`.
    False,
    /// A list.
    List {
        of: &'static Shape,
        /// Least number of items.
        least: usize,
        /// Whether the items are distinct.
        distinct: bool,
    },
    /// A table with names chosen by the user and a value for each.
    ByName(&'static Shape),
    /// One of several.
    Either(&'static [Shape]),
    /// A table.
    Table(&'static TableSpec),
    /// Several tables.
    Tables(&'static TableSpec),
    /// One table or several of them.
    TableOrTables(&'static TableSpec),
    /// A table of a measure in a unit, none for any unit.
    TableIn(Option<Unit>, &'static TableSpec),
    /// Limits of a measure in a unit.
    Limits(Unit, Domain),
    /// Name of a kind of part.
    Kind(Part),
    /// Name of a plant.
    Plant,
    /// Values of a robot file.
    Overrides,
}

/// Sort of part with kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Plant,
    Controller,
    Bus,
}

impl Part {
    /// Returns the singular and the plural in messages.
    pub const fn nouns(self) -> (&'static str, &'static str) {
        match self {
            Part::Plant => ("plant", "plants"),
            Part::Controller => ("controller", "controllers"),
            Part::Bus => ("bus", "buses"),
        }
    }
}

impl Shape {
    /// Returns the tables that it contains.
    pub fn tables(&self) -> Vec<&'static TableSpec> {
        match self {
            Shape::Table(table)
            | Shape::Tables(table)
            | Shape::TableOrTables(table)
            | Shape::TableIn(_, table) => vec![table],
            Shape::List { of, .. } | Shape::ByName(of) => of.tables(),
            Shape::Either(shapes) => shapes.iter().flat_map(Shape::tables).collect(),
            _ => Vec::new(),
        }
    }

    /// Returns a description: `a length (m, cm, mm, um, km)`.
    pub fn words(&self) -> String {
        match self {
            Shape::One(accepts) => of_accepted(accepts),
            Shape::Measured(range) => bounded("quantity", range, ""),
            Shape::Tolerance => "quantity, at least 0, or percentage".to_owned(),
            Shape::Choice(words) => {
                let words: Vec<_> = words().iter().map(|word| format!("`{word}`")).collect();
                words.join(", ")
            }
            Shape::Pattern(_) => "text".to_owned(),
            Shape::False => "`false`".to_owned(),
            Shape::List { of, .. } => match of {
                Shape::One(_) | Shape::Plant => {
                    // The plural of `length, at most 10 m` is that of the length.
                    let words = of.words();
                    let (name, range) = words.split_at(words.find(", ").unwrap_or(words.len()));
                    format!("list of {name}s{range}")
                }
                Shape::Either(_) => format!("list of ({})", of.words()),
                _ => format!("list of {}", of.words()),
            },
            Shape::ByName(of) => format!("table by name, each a {}", of.words()),
            Shape::Either(shapes) => {
                let words: Vec<_> = shapes.iter().map(Shape::words).collect();
                words.join("; or ")
            }
            Shape::Table(table) | Shape::TableIn(_, table) => format!("table `{}`", table.name),
            Shape::Tables(table) => format!("tables `{}`", table.name),
            Shape::TableOrTables(table) => format!("table `{}`, or several", table.name),
            Shape::Limits(unit, _) => {
                format!("limits of {}", quantity_name(*unit).replace("plain ", ""))
            }
            Shape::Kind(part) => format!("kind of {}", part.nouns().0),
            Shape::Plant => "plant".to_owned(),
            Shape::Overrides => "table".to_owned(),
        }
    }
}

fn of_accepted(accepts: &Accepts) -> String {
    match accepts {
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

fn bounded(noun: &str, range: &Range, symbol: &str) -> String {
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
