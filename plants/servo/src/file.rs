//! Files of servo benches.

use std::path::Path;

use twinrig_document::declaration::TableReference;
use twinrig_document::{Document, DocumentError, Overrides, Warning, suggestion};
use twinrig_robot::SERVO_BENCHES;

use crate::parameters::ServoBenchParameters;

/// File of a servo bench.
#[derive(Clone, Debug)]
pub struct ServoBenchFile {
    document: Document,
}

impl ServoBenchFile {
    /// Returns the tables of a file of a servo bench with their keys, beginning with the top level.
    pub fn tables() -> Vec<TableReference> {
        TableReference::of(ServoBenchParameters::TABLE)
    }

    /// Reads the file `name` of the folder `benches`, for a scenario in the folder `beside`. `None`
    /// if there is none of that name.
    ///
    /// # Errors
    /// If it cannot be read or is not TOML.
    pub fn find(name: &str, beside: &Path) -> Result<Option<Self>, DocumentError> {
        let document = SERVO_BENCHES.find(name, beside)?;
        Ok(document.map(|document| Self { document }))
    }

    /// Returns a list of the files that [`ServoBenchFile::find`] finds, with the one meant by
    /// `name`.
    pub fn suggestion(name: &str, beside: &Path) -> String {
        let known = SERVO_BENCHES.names(beside);
        suggestion(name, "benches", known.iter().map(String::as_str))
    }

    /// Parses `text`, with `file` as its name in messages.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn parse(file: &str, text: &str) -> Result<Self, DocumentError> {
        let document = Document::parse(file, text)?;
        Ok(Self { document })
    }

    /// Text of the file.
    pub fn text(&self) -> &str {
        self.document.text()
    }

    /// Replaces values of the file.
    ///
    /// # Errors
    /// A part of a key's path is not a table.
    pub fn override_with(&mut self, overrides: &Overrides) -> Result<(), DocumentError> {
        self.document.override_with(overrides)
    }

    /// Returns a warning for each value outside of the data of an included fit.
    pub fn warnings(&self) -> Vec<Warning> {
        self.document.beyond_fits()
    }

    /// Reads and validates the bench.
    ///
    /// # Errors
    /// Every parameter that is missing, unknown, of a wrong unit or out of range, at its place.
    pub fn bench(&self) -> Result<ServoBenchParameters, DocumentError> {
        self.document.check(ServoBenchParameters::read_from)
    }
}
