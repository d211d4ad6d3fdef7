//! Identification of parameters from recordings: its search space.

mod space;

pub use space::{FitSpace, Prior, ResidualSpec, StartSpec};
