//! Identification of parameters from recordings: its search space, and the distribution that it
//! finds.

mod distribution;
mod space;

pub use distribution::FittedDistribution;
pub use space::{FitSpace, Prior, ResidualSpec, StartSpec};
