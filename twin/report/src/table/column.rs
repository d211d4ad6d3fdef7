//! Columns: their names, roles and units.

use crate::number::{fixed, plain, si};

/// Column of a table.
#[derive(Clone, Debug)]
pub struct Column {
    pub(super) name: String,
    pub(super) role: Role,
    unit: String,
    places: Option<usize>,
    pub(super) only_on_pages: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Names the row.
    Label,
    Text,
    /// Verdict of the row.
    Status,
    Number,
    /// Reason why the row has no values, which may be long.
    Reason,
}

impl Column {
    fn of(name: impl Into<String>, role: Role) -> Self {
        Self {
            name: name.into(),
            role,
            unit: String::new(),
            places: None,
            only_on_pages: false,
        }
    }

    /// Creates a column of texts that name their rows.
    pub fn label(name: impl Into<String>) -> Self {
        Self::of(name, Role::Label)
    }

    /// Creates a column of texts.
    pub fn text(name: impl Into<String>) -> Self {
        Self::of(name, Role::Text)
    }

    /// Creates a column of verdicts.
    pub fn status(name: impl Into<String>) -> Self {
        Self::of(name, Role::Status)
    }

    /// Creates a column of numbers with three significant digits.
    pub fn number(name: impl Into<String>) -> Self {
        Self::of(name, Role::Number)
    }

    /// Creates a last column of reasons, which have a row of their own where there is no room.
    pub fn reason() -> Self {
        Self::of("why", Role::Reason)
    }

    /// Sets the unit of the numbers: its symbol.
    #[must_use]
    pub fn in_unit(mut self, symbol: impl Into<String>) -> Self {
        self.unit = symbol.into();
        self
    }

    /// Sets the number of decimal places. The unit then has no prefix, and pages show it in the
    /// head.
    #[must_use]
    pub fn with_places(mut self, places: usize) -> Self {
        self.places = Some(places);
        self
    }

    /// Omits the column from text, where there is less room.
    #[must_use]
    pub fn only_on_pages(mut self) -> Self {
        self.only_on_pages = true;
        self
    }

    /// Returns the head where all numbers are in the unit of the column.
    pub(super) fn head(&self) -> String {
        match (&*self.unit, self.places) {
            ("", _) | (_, None) => self.name.clone(),
            (unit, Some(_)) => format!("{} [{unit}]", self.name),
        }
    }

    /// Formats a number without the unit that the head has.
    pub(super) fn bare(&self, value: f64) -> String {
        match self.places {
            Some(places) => fixed(value, places),
            None if self.unit.is_empty() => plain(value),
            None => si(value, &self.unit),
        }
    }

    /// Formats a number with its unit.
    pub(super) fn with_unit(&self, value: f64) -> String {
        match (&*self.unit, self.places) {
            ("", _) | (_, None) => self.bare(value),
            (unit, Some(_)) => format!("{} {unit}", self.bare(value)),
        }
    }
}
