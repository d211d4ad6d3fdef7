//! Minimisation within bounds: a particle swarm, and the evolution strategy CMA-ES.
//!
//! A [`Search`] is asked for a generation of points and is told their costs. It evaluates nothing
//! itself, so that costs may come from threads, from a cluster, or from a store of earlier runs:
//! the next generation is a function of the settings and of the costs so far. [`Swarm`] and
//! [`CmaEs`] minimise a function of this process by it.

mod cma;
mod dimension;
mod eigen;
mod error;
mod minimise;
mod particles;
mod swarm;

pub use cma::{CmaEs, CmaSearch};
pub use dimension::Dimension;
pub(crate) use eigen::{Eigen, Matrix};
pub use error::SearchError;
pub use minimise::{Found, Progress};
pub use particles::SwarmSearch;
pub use swarm::Swarm;

/// A search that is asked for points and told their costs.
///
/// Points are shares of the ranges of all parameters, from 0 to 1. Costs only have to be ordered:
/// a search compares them, and calculates with none. NaN counts as infinity.
pub trait Search {
    /// Returns the points of the next generation; none when the search has ended. Asked again
    /// before it is told costs, it returns the same points.
    ///
    /// # Errors
    /// [`SearchError::Optimiser`] if the optimiser fails.
    fn ask(&mut self) -> Result<Option<Vec<Vec<f64>>>, SearchError>;

    /// Takes the costs of the points of the last generation, in their order.
    ///
    /// # Errors
    /// [`SearchError::Costs`] if the search has not asked for as many costs.
    fn tell(&mut self, costs: &[f64]) -> Result<(), SearchError>;
}

/// Returns the costs without NaN, if there is one for each of `points`.
fn checked_costs(costs: &[f64], points: usize) -> Result<Vec<f64>, SearchError> {
    if costs.len() != points || points == 0 {
        return Err(SearchError::Costs {
            given: costs.len(),
            points,
        });
    }
    let number = |cost: &f64| if cost.is_nan() { f64::INFINITY } else { *cost };
    Ok(costs.iter().map(number).collect())
}
