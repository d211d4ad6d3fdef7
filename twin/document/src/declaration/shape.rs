//! Accepted values of the keys of tables.

use twinrig_kernel::Unit;

use super::accepts::bounded;
use super::{Accepts, TableSpec};
use crate::Range;

/// Values that the files of one crate accept beside those of all files.
pub trait Dialect: Copy + 'static {
    /// The schema of a table, to which [`TableSpec::refined`] adds conditions.
    type Schema: 'static;

    /// Returns a description: `kind of plant`.
    fn words(&self) -> String;
}

/// Dialect without values of its own.
#[derive(Clone, Copy, Debug)]
pub enum Plain {}

impl Dialect for Plain {
    type Schema = ();

    fn words(&self) -> String {
        match *self {}
    }
}

/// Accepted values of a key of a table.
#[derive(Clone)]
pub enum Shape<X: Dialect = Plain> {
    /// Any value.
    Any,
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
        /// Its items.
        of: &'static Shape<X>,
        /// Least number of items.
        least: usize,
        /// Whether the items are distinct.
        distinct: bool,
    },
    /// A table with names chosen by the user and a value for each.
    ByName(&'static Shape<X>),
    /// One of several.
    Either(&'static [Shape<X>]),
    /// A table.
    Table(&'static TableSpec<X>),
    /// Several tables.
    Tables(&'static TableSpec<X>),
    /// One table or several of them.
    TableOrTables(&'static TableSpec<X>),
    /// A table of a measure in a unit, none for any unit.
    TableIn(Option<Unit>, &'static TableSpec<X>),
    /// A table of settings of another file.
    Settings,
    /// A value of the dialect.
    Other(X),
}

impl<X: Dialect> Shape<X> {
    /// Returns a list of at least so many items.
    pub const fn list(of: &'static Shape<X>, least: usize) -> Self {
        let distinct = false;
        Shape::List {
            of,
            least,
            distinct,
        }
    }

    /// Returns a list of at least so many distinct items.
    pub const fn set(of: &'static Shape<X>, least: usize) -> Self {
        let distinct = true;
        Shape::List {
            of,
            least,
            distinct,
        }
    }

    /// Returns the tables that it contains.
    pub fn tables(&self) -> Vec<&'static TableSpec<X>> {
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
            Shape::Any => "value".to_owned(),
            Shape::One(accepts) => accepts.words(),
            Shape::Measured(range) => bounded("quantity", range, ""),
            Shape::Tolerance => "quantity, at least 0, or percentage".to_owned(),
            Shape::Choice(words) => {
                let words: Vec<_> = words().iter().map(|word| format!("`{word}`")).collect();
                words.join(", ")
            }
            Shape::Pattern(_) => "text".to_owned(),
            Shape::False => "`false`".to_owned(),
            Shape::List { of, .. } => match of {
                Shape::Any | Shape::One(_) | Shape::Other(_) => {
                    // The plural of `length, at most 10 m` is that of the length.
                    let words = of.words();
                    let ends = [", ", " of "].into_iter().filter_map(|end| words.find(end));
                    let (name, range) = words.split_at(ends.min().unwrap_or(words.len()));
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
            Shape::Settings => "table".to_owned(),
            Shape::Other(other) => other.words(),
        }
    }
}
