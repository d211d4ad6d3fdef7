//! Minimisation of a function by a particle swarm.

use serde::{Deserialize, Serialize};

use super::dimension::check;
use super::minimise::Minimisation;
use super::{Dimension, Found, Progress, SearchError, SwarmSearch};

/// Particle swarm: each particle is drawn to the best point that it has met and to the best of all.
///
/// The swarm is that of `argmin`, with the weights of SPSO 2011 and one neighbourhood. Random
/// numbers are of the stream `campaign/search` under `seed`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Swarm {
    /// Ranges of the parameters.
    pub dimensions: Vec<Dimension>,
    /// Number of particles; 40 is usual.
    pub particles: usize,
    /// Iterations after the initial points; each evaluates the objective once for every particle.
    pub iterations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of threads that evaluate the objective, without influence on the result.
    pub threads: usize,
}

impl Swarm {
    /// Minimises `objective`, which is called with parameters within their bounds, on several
    /// threads at once. NaN counts as infinity.
    ///
    /// `progress` is called after the initial points and each iteration, on one thread, and returns
    /// whether the search continues.
    ///
    /// # Errors
    /// [`SearchError`] for an invalid swarm, an interrupted search, and if no cost is finite.
    ///
    /// # Panics
    /// If the objective panics.
    pub fn minimise(
        &self,
        objective: &(dyn Fn(&[f64]) -> f64 + Sync),
        progress: &mut dyn FnMut(Progress<'_>) -> bool,
    ) -> Result<Found, SearchError> {
        let counts = [("particles", self.particles), ("threads", self.threads)];
        check(&self.dimensions, &counts)?;
        let dimensions = self.dimensions.len();
        let mut search = SwarmSearch::new(dimensions, self.particles, self.iterations, self.seed)?;
        let minimisation = Minimisation {
            dimensions: &self.dimensions,
            objective,
            of: self.iterations,
            threads: self.threads,
        };
        minimisation.run(&mut search, progress)
    }
}
