//! Parts of self-contained HTML pages: no fonts or network access.

pub mod axis;
pub mod drawing;
pub mod element;
pub mod line_plot;
pub mod marker;
pub mod plot;
pub mod surface;
pub(crate) mod table;

/// Style sheet of all pages.
pub const STYLE: &str = include_str!("style.css");
