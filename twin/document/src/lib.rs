//! TOML documents with the source position of every value. A reader requests the keys of a
//! [`Table`] by type; every problem (a missing key, a wrong unit, a number out of range, an unknown
//! key) becomes part of one [`DocumentError`], which shows file, line, column and the nearest valid
//! word. No input causes a panic.
//!
//! ```
//! use twinrig_document::{Document, Range};
//! use twinrig_kernel::Unit;
//!
//! let read = |text: &str| {
//!     Document::parse("leg.toml", text)?.check(|table| {
//!         let positive = Range::POSITIVE;
//!         let length = table.required("length", |item| item.quantity(Unit::Meter, &positive));
//!         let period = table.required("period", |item| item.positive_duration());
//!         Ok((length?, period?))
//!     })
//! };
//! let (length, period) = read("length = '44.2 mm'\nperiod = '2 ms'").unwrap();
//! assert_eq!((length, period.as_nanos()), (0.0442, 2_000_000));
//!
//! let error = read("lenght = '44.2 mm'\nperiod = '2 Hz'").unwrap_err();
//! assert_eq!(error.problems.len(), 2);
//! assert_eq!(
//!     error.problems[0].to_string(),
//!     "error: unknown key `lenght`
//!  --> leg.toml:1:1
//!   |
//! 1 | lenght = '44.2 mm'
//!   | ^^^^^^
//!   |
//!   = help: did you mean `length`?"
//! );
//! ```
//!
//! Accepted values that are probably mistakes become a [`Warning`] of [`Document::check_and_warn`],
//! also with its position.
//!
//! Quantities are strings with a unit (`"12.6 cm"`), checked by dimension; a bare number is
//! accepted for dimensionless quantities only. A power of ten shifts the decimal point of the text
//! and the result is rounded once; durations become whole nanoseconds without an intermediate
//! floating-point number.
//!
//! Out of scope: writing TOML, the meaning of any file, comments, dates.

mod assumed;
pub mod declaration;
mod document;
mod error;
mod file;
mod fitted;
mod imported;
mod include;
mod item;
mod library;
mod near;
mod node;
mod overrides;
mod pattern;
pub mod probe;
mod problems;
mod quantity;
mod range;
mod source;
mod spelling;
mod syntax;
mod table;
mod toml_text;
mod units;
mod visible;
mod written_unit;

pub use assumed::AssumedValue;
pub use document::Document;
pub use error::{DocumentError, Placed, Problem, Warning};
pub use file::{STREAM_MOST, TEXT_MOST, read_file};
pub use imported::Import;
pub use item::Item;
pub use library::Library;
pub use near::{nearest, suggestion};
pub use overrides::Overrides;
pub use pattern::{any_quantity_pattern, duration_pattern, percentage_pattern, quantity_pattern};
pub use problems::Reported;
pub use quantity::{
    QuantityError, fitting_units, parse_duration, parse_quantity, parse_with_unit, print_quantity,
    quantity_name,
};
pub use range::Range;
pub use source::{Place, Source};
pub use table::Table;
pub use toml_text::quoted;
pub use visible::{escape_xml, escaped, visible};
pub use written_unit::WrittenUnit;
