//! Comparisons of two signals.

mod closed_forms;
#[path = "../common/mod.rs"]
mod common;
mod evidence;
mod run;
