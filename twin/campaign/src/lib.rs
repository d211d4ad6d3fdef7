//! Campaigns: many runs, of which each is independent. [`search`] minimises a cost, of covariances
//! of filters, gaits and the like; [`sweep`] runs a scenario at the points of a design and judges
//! shares of the runs; [`optimization`] lets a search choose the points; [`radius`] finds the
//! disturbance at which an expectation fails; [`spread`] evaluates an ensemble; [`engine`] does
//! independent tasks, on threads or on workers of a cluster.
//!
//! ```
//! use twinrig_campaign::search::{Dimension, Swarm};
//!
//! let swarm = Swarm {
//!     dimensions: vec![Dimension::linear(-5.0, 5.0), Dimension::logarithmic(1e-6, 1e2)],
//!     particles: 30,
//!     iterations: 100,
//!     seed: 1,
//!     threads: 2,
//! };
//! // Minimum 0 at (3, 10⁻³).
//! let cost = |x: &[f64]| (x[0] - 3.0).abs() + libm::log(x[1] / 1e-3).abs();
//! let found = swarm.minimise(&cost, &mut |_| true)?;
//! assert!(found.cost < 1e-3);
//! # Ok::<(), twinrig_campaign::search::SearchError>(())
//! ```
//!
//! The result is a function of the swarm and the costs: the number of threads and their timing have
//! no influence, if the objective is a function of its argument. A search ends early on Ctrl-C
//! (`twinrig_runtime::interrupt`) and at the wish of the caller.
//!
//! # Limits
//!
//! - A search is a heuristic: the best point is not proven to be a minimum, and another seed may
//!   find a better one.
//! - No constraints except bounds: an objective returns infinity where a point is impossible.
//! - A search has no state on disk. It is repeated with stored costs instead, of which it is a
//!   function.
//! - Results are the same with the same versions of `argmin` and `rand`, whose formulas they
//!   contain.
//! - A search is not saved and resumed.
//! - No `search` and no `optimization` in WebAssembly.
//! - A sweep knows no scenario: the caller turns points into runs, and files and settings into
//!   keys.

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_campaign;

pub mod engine;
#[cfg(not(target_family = "wasm"))]
pub mod identification;
#[cfg(not(target_family = "wasm"))]
pub mod least_squares;
#[cfg(not(target_family = "wasm"))]
pub mod optimization;
#[cfg(not(target_family = "wasm"))]
mod places;
pub mod radius;
#[cfg(not(target_family = "wasm"))]
pub mod search;
pub mod spread;
pub mod sweep;
#[cfg(test)]
mod tests;
