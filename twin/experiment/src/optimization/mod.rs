//! Optimizations: settings of a scenario with the best value of an expectation.

mod best;
pub(crate) mod execute;
mod files;
pub(crate) mod outcome;
mod plan;
mod running;
#[cfg(test)]
mod tests;
mod text;
mod view;

pub use view::optimization_page;
pub(crate) use view::{best_cases, best_point, evaluation_class};
