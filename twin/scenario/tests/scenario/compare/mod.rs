//! Comparisons of two signals.

mod closed_forms;
mod evidence;
mod run;
