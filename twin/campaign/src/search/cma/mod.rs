//! The evolution strategy CMA-ES (Hansen, *The CMA Evolution Strategy: A Tutorial*,
//! arXiv:1604.00772), with restarts of growing populations.

mod distribution;
mod parameters;
#[cfg(test)]
mod tests;

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Stream, stream};

use super::dimension::check;
use super::minimise::Minimisation;
use super::{Dimension, Found, Progress, Search, SearchError, checked_costs};
use crate::places::share;
use crate::sweep::POINTS_MOST;
use distribution::Distribution;
use parameters::usual_population;

/// Least population: two parents.
const POPULATION_LEAST: usize = 4;
/// Initial standard deviation, as a share of each range.
const STEP: f64 = 0.3;
/// CMA-ES: a normal distribution whose mean, step size and covariances follow the better half of
/// its samples. It learns which parameters depend on each other, is invariant to rotations of the
/// parameters far from bounds, and to monotone maps of the cost.
///
/// Random numbers are of the stream `campaign/cma-es` under `seed`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CmaEs {
    /// Ranges of the parameters.
    pub dimensions: Vec<Dimension>,
    /// Points of a generation, at least 4; none: 4 + ⌊3 ln n⌋ for n parameters.
    pub population: Option<usize>,
    /// Greatest number of generations after the first one.
    pub iterations: usize,
    /// Restarts after convergence, each with twice the population, from a random mean, up to a
    /// million.
    pub restarts: usize,
    /// Standard deviation below which a search has converged, as a share of each range.
    pub tolerance: f64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of threads that evaluate the objective, without influence on the result.
    pub threads: usize,
}

impl CmaEs {
    /// Returns the search of the evolution strategy.
    ///
    /// # Errors
    /// [`SearchError`] for a strategy without parameters, or with too small a population.
    pub fn search(&self) -> Result<CmaSearch, SearchError> {
        let count = self.dimensions.len();
        if count == 0 {
            return Err(SearchError::NoDimensions);
        }
        let population = self.population.unwrap_or_else(|| usual_population(count));
        if population < POPULATION_LEAST {
            return Err(SearchError::Population {
                population,
                least: POPULATION_LEAST,
            });
        }
        Ok(CmaSearch {
            numbers: stream(self.seed, "campaign/cma-es"),
            distribution: Distribution::new(vec![0.5; count], STEP, population),
            population,
            iterations: self.iterations,
            restarts: self.restarts,
            tolerance: self.tolerance,
            done: 0,
            samples: Vec::new(),
            bests: Vec::new(),
            has_ended: false,
        })
    }

    /// Minimises `objective`, as [`Swarm::minimise`](super::Swarm::minimise) does.
    ///
    /// # Errors
    /// [`SearchError`] for an invalid strategy, an interrupted search, and if no cost is finite.
    ///
    /// # Panics
    /// If the objective panics.
    pub fn minimise(
        &self,
        objective: &(dyn Fn(&[f64]) -> f64 + Sync),
        progress: &mut dyn FnMut(Progress<'_>) -> bool,
    ) -> Result<Found, SearchError> {
        check(&self.dimensions, &[("threads", self.threads)])?;
        let minimisation = Minimisation {
            dimensions: &self.dimensions,
            objective,
            of: self.iterations,
            threads: self.threads,
        };
        minimisation.run(&mut self.search()?, progress)
    }
}

/// A running search of [`CmaEs`].
///
/// The strategy knows no bounds: a coordinate beyond a range stands for its mirror image, so that
/// the cost is continued by reflection, periodic and continuous. Other than by penalties, which
/// have to be added to costs, only the order of the costs counts; other than by redrawn samples,
/// their distribution stays normal.
pub struct CmaSearch {
    numbers: Stream,
    distribution: Distribution,
    population: usize,
    iterations: usize,
    /// Restarts that are left.
    restarts: usize,
    tolerance: f64,
    /// Generations that have been told costs.
    done: usize,
    /// Samples that await their costs.
    samples: Vec<Vec<f64>>,
    /// Least cost of each generation since the last restart.
    bests: Vec<f64>,
    has_ended: bool,
}

impl Search for CmaSearch {
    fn ask(&mut self) -> Result<Option<Vec<Vec<f64>>>, SearchError> {
        if self.has_ended || self.done > self.iterations {
            return Ok(None);
        }
        if self.samples.is_empty() {
            self.samples = (0..self.population).map(|_| self.sample()).collect();
        }
        let shares = |sample: &Vec<f64>| sample.iter().map(|&place| share(place)).collect();
        Ok(Some(self.samples.iter().map(shares).collect()))
    }

    fn tell(&mut self, costs: &[f64]) -> Result<(), SearchError> {
        let costs = checked_costs(costs, self.samples.len())?;
        let samples = std::mem::take(&mut self.samples);
        let mut order: Vec<usize> = (0..costs.len()).collect();
        // Stable, so that equal costs stay in the order of their points.
        order.sort_by(|&one, &other| {
            costs[one]
                .partial_cmp(&costs[other])
                .unwrap_or(Ordering::Equal)
        });
        let ranked: Vec<&[f64]> = order
            .iter()
            .map(|&index| samples[index].as_slice())
            .collect();
        self.distribution.update(&ranked);
        self.done += 1;
        let best = costs[order[0]];
        self.bests.push(best);
        if best == costs[order[costs.len() * 7 / 10]] {
            self.distribution.widen();
        }
        if self.has_converged() {
            self.restart();
        }
        Ok(())
    }
}

impl CmaSearch {
    fn sample(&mut self) -> Vec<f64> {
        let count = self.distribution.mean.len();
        let normal: Vec<f64> = (0..count).map(|_| self.numbers.normal()).collect();
        self.distribution.sample(&normal)
    }

    /// Returns whether further generations are of no use: the distribution is narrower than the
    /// tolerance or degenerate, or the least cost has been the same for long.
    fn has_converged(&self) -> bool {
        let distribution = &self.distribution;
        let mut widths = distribution.deviations().chain(
            distribution
                .path
                .iter()
                .map(|p| distribution.step * p.abs()),
        );
        let is_narrow = widths.all(|width| width < self.tolerance);
        let recent = 10 + 30 * distribution.mean.len() / self.population;
        let is_constant = self.bests.len() > recent
            && self
                .bests
                .iter()
                .rev()
                .take(recent)
                .all(|best| Some(best) == self.bests.last());
        is_narrow || is_constant || !distribution.is_regular()
    }

    fn restart(&mut self) {
        let population = self.population.saturating_mul(2);
        if self.restarts == 0 || population > POINTS_MOST {
            self.has_ended = true;
            return;
        }
        self.restarts -= 1;
        self.population = population;
        self.bests.clear();
        let count = self.distribution.mean.len();
        let mean = (0..count).map(|_| self.numbers.unit()).collect();
        self.distribution = Distribution::new(mean, STEP, self.population);
    }
}
