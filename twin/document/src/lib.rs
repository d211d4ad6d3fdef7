//! TOML documents whose every value knows its place. A reader asks a [`Table`] for its keys by type; whatever is wrong (a
//! missing key, a wrong unit, a number out of range, a key that nobody asked for) becomes one [`DocumentError`] that shows
//! file, line, column and the nearest valid word, and never a panic, whatever the bytes.
//!
//! ```
//! use twinrig_document::{Document, Range};
//! use twinrig_kernel::Unit;
//!
//! let read = |text: &str| {
//!     Document::parse("leg.toml", text)?.check(|table| {
//!         let length = table.required("length", |item| item.quantity(Unit::Meter, &Range::POSITIVE));
//!         let period = table.required("period", |item| item.positive_duration());
//!         Ok((length?, period?))
//!     })
//! };
//! let (length, period) = read("length = '44.2 mm'\nperiod = '2 ms'").unwrap();
//! assert_eq!((length, period.as_nanos()), (0.0442, 2_000_000));
//!
//! let error = read("lenght = '44.2 mm'\nperiod = '2 Hz'").unwrap_err();
//! assert_eq!(error.problems.len(), 3);
//! assert_eq!(
//!     error.problems[1].to_string(),
//!     "error: unknown key `lenght`
//!  --> leg.toml:1:1
//!   |
//! 1 | lenght = '44.2 mm'
//!   | ^^^^^^
//!   = help: did you mean `length`?"
//! );
//! ```
//!
//! What is accepted and most likely a mistake is a [`Warning`] of [`Document::check_and_warn`],
//! with its place, too.
//!
//! Quantities are texts with a unit (`"12.6 cm"`), checked by dimension; a bare number is accepted only where there is no
//! dimension. A power of ten shifts the decimal point of the text and rounds once; durations become whole nanoseconds
//! without passing through a floating-point number.
//!
//! What it does not do: write TOML; know any file's meaning; keep comments; accept dates.

mod document;
mod error;
mod file;
mod item;
mod near;
mod node;
mod pattern;
mod quantity;
mod range;
mod source;
mod table;
mod units;

pub use document::{Document, Overrides, quoted};
pub use error::{DocumentError, Problem, Warning};
pub use file::{STREAM_MOST, TEXT_MOST, read_file};
pub use item::Item;
pub use near::{nearest, suggestion};
pub use pattern::{any_quantity_pattern, duration_pattern, percentage_pattern, quantity_pattern};
pub use quantity::{
    QuantityError, fitting_units, parse_duration, parse_quantity, print_quantity, quantity_name,
};
pub use range::Range;
pub use source::{Place, Source};
pub use table::{Reported, Table};
