//! The figures and tables of the thesis beside ours: printed, ours, verdict.
//!
//! An [`item::Item`] declares the printed figures of a figure, table or section, each with its
//! place and the rule of its verdict, and a function that determines ours by running scenarios,
//! studies and closed forms. A verdict follows from both numbers; only "not reproducible" is
//! declared, with its reason. An item is one declaration in the module of its chapter.

mod chapter_1;
mod chapter_2;
mod chapter_4_bench;
mod chapter_4_cells;
mod chapter_5;
mod context;
pub(crate) mod error;
pub(crate) mod item;
mod number;
mod page;
mod progress;
pub(crate) mod record;
pub(crate) mod registry;
pub(crate) mod result;
pub(crate) mod run;
#[cfg(test)]
mod tests;
pub(crate) mod text;
pub(crate) mod verdict;
