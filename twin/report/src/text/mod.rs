//! Text for terminals: aligned columns, styles, and lines that fit.

pub mod grid;
pub mod harmless;
pub mod layout;
pub mod style;
pub mod width;
