//! Minimisation of a function of this process on several threads.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use twinrig_runtime::interrupt::{self, Token};

use super::dimension::parameters;
use super::{Dimension, Search, SearchError};

/// State of a running search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress<'a> {
    /// Iterations done; 0 after the initial points.
    pub iteration: usize,
    /// Iterations in total.
    pub of: usize,
    /// Least cost so far.
    pub cost: f64,
    /// Its parameters.
    pub best: &'a [f64],
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Parameters of the least cost.
    pub best: Vec<f64>,
    /// Least cost.
    pub cost: f64,
    /// Least cost after the initial points and after each iteration.
    pub history: Vec<f64>,
    /// Evaluations of the objective.
    pub evaluations: u64,
    /// Those among them that returned NaN, which counts as infinity.
    pub not_a_number: u64,
}

/// Function to be minimised, with the size of the work.
pub(super) struct Minimisation<'a> {
    pub dimensions: &'a [Dimension],
    pub objective: &'a (dyn Fn(&[f64]) -> f64 + Sync),
    /// Iterations in total.
    pub of: usize,
    pub threads: usize,
}

impl Minimisation<'_> {
    /// Evaluates the generations of `search` until it ends. `progress` is called on this thread.
    pub fn run(
        &self,
        search: &mut dyn Search,
        progress: &mut dyn FnMut(Progress<'_>) -> bool,
    ) -> Result<Found, SearchError> {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(self.threads);
        let pool = threads.build().map_err(|why| SearchError::Threads {
            threads: self.threads,
            why: why.to_string(),
        })?;
        let token = interrupt::current();
        let mut found = Found {
            best: Vec::new(),
            cost: f64::INFINITY,
            history: Vec::with_capacity(self.of + 1),
            evaluations: 0,
            not_a_number: 0,
        };
        while let Some(shares) = search.ask()? {
            let done = found.history.len();
            let points: Vec<Vec<f64>> = shares
                .iter()
                .map(|shares| parameters(self.dimensions, shares))
                .collect();
            let costs = pool.install(|| self.costs(&points, token.as_ref()));
            let costs = costs.ok_or_else(|| self.interrupted(done.saturating_sub(1)))?;
            search.tell(&costs)?;
            found.add(&points, &costs);
            let report = Progress {
                iteration: done,
                of: self.of,
                cost: found.cost,
                best: &found.best,
            };
            if !progress(report) {
                return Err(self.interrupted(done));
            }
        }
        if found.cost == f64::INFINITY {
            return Err(SearchError::NoFiniteCost {
                evaluations: found.evaluations,
                not_a_number: found.not_a_number,
            });
        }
        Ok(found)
    }

    /// Returns the costs of points, in their order; none after an interrupt.
    fn costs(&self, points: &[Vec<f64>], token: Option<&Token>) -> Option<Vec<f64>> {
        let cost = |point: &Vec<f64>| {
            interrupt::in_scope(token, || {
                (!interrupt::is_requested()).then(|| (self.objective)(point))
            })
        };
        points.par_iter().map(cost).collect()
    }

    fn interrupted(&self, done: usize) -> SearchError {
        SearchError::Interrupted { done, of: self.of }
    }
}

impl Found {
    /// Adds a generation.
    fn add(&mut self, points: &[Vec<f64>], costs: &[f64]) {
        for (point, &cost) in points.iter().zip(costs) {
            self.evaluations += 1;
            self.not_a_number += u64::from(cost.is_nan());
            if cost < self.cost || self.best.is_empty() {
                self.best.clone_from(point);
                self.cost = if cost.is_nan() { f64::INFINITY } else { cost };
            }
        }
        self.history.push(self.cost);
    }
}
