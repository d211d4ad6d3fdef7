//! Reports for readers: numbers, tables and plots, as text for terminals, as HTML pages and as
//! Markdown.
//!
//! ```
//! use twinrig_report::number::si;
//!
//! assert_eq!(si(1.3e-7, "m"), "130 nm");
//! ```
//!
//! # Limits
//!
//! - It knows no scenario, no study and no run.
//! - Pages have no fonts and no network access; scripts are those of a caller.

pub mod comparison;
pub mod html;
pub mod number;
pub mod page;
pub mod summary;
pub mod table;
pub mod text;
