//! Studies as self-contained HTML pages: no scripts, fonts or network access.

mod constraint_violation;
mod contact;
mod differences;
mod dominance;
mod ensemble;
mod error_axis;
mod error_control;
mod figure;
mod footsteps;
mod models;
mod optimization;
mod page;
mod precision;
mod references;
mod reproduction;
pub(crate) mod rows;
mod runs;
mod stability;
mod stiffness;
mod study;
mod sweep;
mod thesis;
mod tolerance;
mod transport;

pub(crate) use error_axis::LEAST_M;
use figure::{figure, legend};
pub use optimization::{best_cases, best_point, evaluation_class, optimization_page};
use page::{card, commanded, introduction};
pub(crate) use references::references;
pub use study::html;
pub use sweep::sweep_page;
