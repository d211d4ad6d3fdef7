//! Optimisations: from a search space to a scenario with the best settings.

mod best;
pub(crate) mod execute;
mod files;
pub(crate) mod outcome;
mod plan;
pub(crate) mod progress;
mod running;
pub(crate) mod table;

#[cfg(test)]
mod tests;
