//! Summaries and pages of studies that measure plants, sweeps and optimizations.

mod commanded;
mod constraint_violation;
mod contact;
mod differences;
mod dominance;
mod ensemble;
mod error_axis;
mod error_control;
mod figure;
mod footsteps;
mod lines;
mod models;
mod optimization;
mod precision;
mod references;
pub(crate) mod rows;
mod runs;
mod stability;
mod stiffness;
mod study;
mod summary;
mod sweep;
#[cfg(test)]
mod tests;
mod thesis;
mod tolerance;
mod transport;
#[cfg(test)]
mod walk_tests;

use commanded::commanded;
pub(crate) use error_axis::LEAST_M;
use figure::{curve_swatch, figure};
pub use optimization::{best_cases, best_point, evaluation_class, optimization_page};
pub(crate) use references::references;
pub use sweep::sweep_page;
