//! Sweeps: from a specification to rows, files and reports.

pub(crate) mod execute;
pub(crate) mod files;
pub(crate) mod plan;
pub(crate) mod rows;
mod text;
mod view;

pub use text::share_sentence;
pub use view::sweep_page;
