//! The figures and tables of the thesis beside ours: printed, ours, verdict.
//!
//! An [`item::Item`] declares the printed figures of a figure, table or section, each with its
//! place and the rule of its verdict, and a function that determines ours by running scenarios,
//! studies and closed forms. A verdict follows from both numbers and the basis of ours
//! ([`item::Source`]); only "not run" is declared, with its reason. An item is one declaration in
//! the module of its chapter.

mod context;
pub(crate) mod flips;
mod gaits;
pub(crate) mod item;
pub(crate) mod items;
mod number;
#[cfg(test)]
mod page;
mod progress;
pub(crate) mod record;
pub(crate) mod result;
pub(crate) mod run;
#[cfg(test)]
mod tests;
pub(crate) mod text;
pub(crate) mod verdict;
