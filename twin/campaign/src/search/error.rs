//! Errors of searches.

use thiserror::Error;

/// Reason why a search has no result.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SearchError {
    /// No parameter is searched.
    #[error("there is no parameter to search")]
    NoDimensions,
    /// A number of particles or threads is zero.
    #[error("the number of {what} is zero")]
    Zero {
        /// `particles` or `threads`.
        what: &'static str,
    },
    /// A population from which no parents can be selected.
    #[error("a population of {population} is too small; it has to be at least {least}")]
    Population {
        /// Size of the population.
        population: usize,
        /// Least size.
        least: usize,
    },
    /// Bounds that are no range.
    #[error("parameter {index}: the bounds are {low} and {high}; they have to be {required}")]
    Bounds {
        /// Index of the parameter, from 0.
        index: usize,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
        /// Requirement that they do not meet.
        required: &'static str,
    },
    /// Costs that do not belong to the points of the last generation.
    #[error("{given} costs were given for {points} points; a cost is required for each")]
    Costs {
        /// Number of costs.
        given: usize,
        /// Number of points that await one.
        points: usize,
    },
    /// The cost was infinite or NaN at all points.
    #[error("no cost is finite: {evaluations} evaluations, {not_a_number} of them NaN")]
    NoFiniteCost {
        /// Evaluations of the objective.
        evaluations: u64,
        /// Evaluations that returned NaN.
        not_a_number: u64,
    },
    /// The caller or an interrupt ended the search.
    #[error("interrupted after {done} of {of} iterations")]
    Interrupted {
        /// Iterations done.
        done: usize,
        /// Iterations in total.
        of: usize,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {why}")]
    Threads {
        /// Requested number.
        threads: usize,
        /// Message of the operating system.
        why: String,
    },
    /// The optimiser failed.
    #[error("the optimiser failed: {0}")]
    Optimiser(String),
}
