//! Summaries and pages of studies of plants.

mod commanded;
mod constraint_violation;
mod contact;
mod differences;
mod dominance;
mod ensemble;
mod error_axis;
mod error_control;
mod footsteps;
mod lines;
mod models;
mod precision;
mod references;
pub(crate) mod rows;
mod runs;
mod stability;
mod stiffness;
mod study;
mod summary;
#[cfg(test)]
mod tests;
mod thesis;
mod tolerance;
mod transport;
#[cfg(test)]
mod walk_tests;

use crate::figure::{curve_swatch, figure};
use commanded::commanded;
pub(crate) use error_axis::LEAST_M;
pub(crate) use references::references;
