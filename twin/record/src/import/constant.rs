//! Constants of a log.

use super::cell::Cell;

/// Longest text of a constant that is kept \[bytes\].
const CONSTANT_MOST: usize = 4096;

/// A constant of a log.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Constant {
    /// As written.
    pub written: String,
    pub number: Option<f64>,
    pub is_boolean: bool,
}

impl Constant {
    /// Returns the constant of a value; none if there is no value.
    pub(super) fn of(cell: Cell<'_>) -> Option<Self> {
        let written = match cell {
            Cell::Missing | Cell::Composite(_) => return None,
            Cell::Text(text) => {
                let mut end = text.len().min(CONSTANT_MOST);
                while !text.is_char_boundary(end) {
                    end -= 1;
                }
                text[..end].to_owned()
            }
            other => other.words(),
        };
        Some(Self {
            written,
            number: cell.number(),
            is_boolean: matches!(cell, Cell::Boolean(_)),
        })
    }
}

/// A constant that has two values.
#[derive(Debug, Clone)]
pub(super) struct Changed {
    pub other: String,
    pub row: u64,
    pub line: Option<u64>,
}
