//! Minimisation within bounds by a particle swarm.

use std::sync::atomic::{AtomicU64, Ordering};

use argmin::core::{CostFunction, Error, PopulationState, Problem, Solver, State};
use argmin::solver::particleswarm::ParticleSwarm;
use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{Stream, stream};
use twinrig_runtime::interrupt::{self, Token};

use crate::places::{Places, share};

/// Range of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dimension {
    /// Lower bound, in the parameter's unit.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// Whether the logarithm of the parameter is searched: for ranges of several decades.
    pub logarithmic: bool,
}

impl Dimension {
    /// Returns a range in which all differences of the same size count the same.
    pub const fn linear(low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            logarithmic: false,
        }
    }

    /// Returns a range in which all ratios of the same size count the same; both bounds are
    /// positive.
    pub const fn logarithmic(low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            logarithmic: true,
        }
    }

    /// Parameter at a share of the range, 0 to 1; the bounds are met exactly.
    fn at(&self, share: f64) -> f64 {
        let between = |low: f64, high: f64| low * (1.0 - share) + high * share;
        let value = if self.logarithmic {
            libm::exp(between(libm::log(self.low), libm::log(self.high)))
        } else {
            between(self.low, self.high)
        };
        if share <= 0.0 {
            self.low
        } else if share >= 1.0 {
            self.high
        } else {
            value.clamp(self.low, self.high)
        }
    }

    fn check(&self, index: usize) -> Result<(), SearchError> {
        let finite = self.low.is_finite() && self.high.is_finite();
        let positive = !self.logarithmic || self.low > 0.0;
        if finite && positive && self.low < self.high {
            return Ok(());
        }
        Err(SearchError::Bounds {
            index,
            low: self.low,
            high: self.high,
            required: if self.logarithmic {
                "finite, positive and in ascending order"
            } else {
                "finite and in ascending order"
            },
        })
    }
}

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
    /// Bounds that are no range.
    #[error("parameter {index}: the bounds are {low} and {high}; they have to be {required}")]
    Bounds {
        /// Index of the parameter, from 0.
        index: usize,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
        /// What is required of them.
        required: &'static str,
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

/// Weights of SPSO 2011: momentum 1/(2 ln 2), and 1/2 + ln 2 for both attractions.
const MOMENTUM: f64 = 0.5 / std::f64::consts::LN_2;
const ATTRACTION: f64 = 0.5 + std::f64::consts::LN_2;

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
        self.check()?;
        let threads = rayon::ThreadPoolBuilder::new().num_threads(self.threads);
        let pool = threads.build().map_err(|why| SearchError::Threads {
            threads: self.threads,
            why: why.to_string(),
        })?;
        let costs = Costs {
            dimensions: &self.dimensions,
            objective,
            evaluations: AtomicU64::new(0),
            not_a_number: AtomicU64::new(0),
            token: interrupt::current(),
        };
        let mut search = Search {
            swarm: self,
            solver: self.solver()?,
            problem: Problem::new(&costs),
            history: Vec::with_capacity(self.iterations + 1),
        };
        let mut state = PopulationState::new();
        for done in 0..=self.iterations {
            // Costs are evaluated in the pool, progress is reported on this thread.
            let iterate = || search.iterate(done, state);
            state = pool.install(|| interrupt::in_scope(costs.token.as_ref(), iterate))?;
            let (best, cost) = search.best(&state);
            search.history.push(cost);
            let report = Progress {
                iteration: done,
                of: self.iterations,
                cost,
                best: &best,
            };
            if !progress(report) {
                return Err(self.interrupted(done));
            }
        }
        let (best, cost) = search.best(&state);
        let history = search.history;
        let evaluations = costs.evaluations.into_inner();
        let not_a_number = costs.not_a_number.into_inner();
        if cost.is_infinite() && cost > 0.0 {
            return Err(SearchError::NoFiniteCost {
                evaluations,
                not_a_number,
            });
        }
        Ok(Found {
            best,
            cost,
            history,
            evaluations,
            not_a_number,
        })
    }

    fn check(&self) -> Result<(), SearchError> {
        if self.dimensions.is_empty() {
            return Err(SearchError::NoDimensions);
        }
        for (what, count) in [("particles", self.particles), ("threads", self.threads)] {
            if count == 0 {
                return Err(SearchError::Zero { what });
            }
        }
        let mut dimensions = self.dimensions.iter().enumerate();
        dimensions.try_for_each(|(index, dimension)| dimension.check(index))
    }

    fn solver(&self) -> Result<ParticleSwarm<Places, f64, Numbers>, SearchError> {
        let count = self.dimensions.len();
        let numbers = Numbers(stream(self.seed, "campaign/search"));
        // Places of the ranges, so that bounds of any size have no influence on the arithmetic.
        ParticleSwarm::new(
            (Places(vec![0.0; count]), Places(vec![1.0; count])),
            self.particles,
        )
        .with_rng_generator(numbers)
        .with_inertia_factor(MOMENTUM)
        .and_then(|solver| solver.with_cognitive_factor(ATTRACTION))
        .and_then(|solver| solver.with_social_factor(ATTRACTION))
        .map_err(|error| SearchError::Optimiser(error.to_string()))
    }

    fn interrupted(&self, done: usize) -> SearchError {
        SearchError::Interrupted {
            done,
            of: self.iterations,
        }
    }
}

/// Particles with their costs.
type Population = PopulationState<argmin::solver::particleswarm::Particle<Places, f64>, f64>;

/// A running search.
struct Search<'a> {
    swarm: &'a Swarm,
    solver: ParticleSwarm<Places, f64, Numbers>,
    problem: Problem<&'a Costs<'a>>,
    history: Vec<f64>,
}

impl Search<'_> {
    /// Evaluates the initial points, or an iteration.
    fn iterate(&mut self, done: usize, state: Population) -> Result<Population, SearchError> {
        let result = if done == 0 {
            self.solver.init(&mut self.problem, state)
        } else {
            self.solver.next_iter(&mut self.problem, state)
        };
        match result {
            Ok((state, _)) => Ok(state),
            Err(_) if interrupt::is_requested() => {
                Err(self.swarm.interrupted(done.saturating_sub(1)))
            }
            Err(error) => Err(SearchError::Optimiser(error.to_string())),
        }
    }

    /// Best point of all, with its cost.
    fn best(&self, state: &Population) -> (Vec<f64>, f64) {
        let best = state.get_param().map(|particle| &particle.position);
        let best = best.map(|places| parameters(&self.swarm.dimensions, places));
        (best.unwrap_or_default(), state.get_cost())
    }
}

fn parameters(dimensions: &[Dimension], places: &Places) -> Vec<f64> {
    let pairs = dimensions.iter().zip(&places.0);
    let parameter = |(dimension, &place): (&Dimension, &f64)| dimension.at(share(place));
    pairs.map(parameter).collect()
}

/// The objective over shares of the ranges.
struct Costs<'a> {
    dimensions: &'a [Dimension],
    objective: &'a (dyn Fn(&[f64]) -> f64 + Sync),
    evaluations: AtomicU64,
    not_a_number: AtomicU64,
    /// Interrupt token of the caller, for the threads of the pool.
    token: Option<Token>,
}

impl CostFunction for &Costs<'_> {
    type Param = Places;
    type Output = f64;

    fn cost(&self, places: &Places) -> Result<f64, Error> {
        let parameters = parameters(self.dimensions, places);
        let cost = interrupt::in_scope(self.token.as_ref(), || {
            (!interrupt::is_requested()).then(|| (self.objective)(&parameters))
        });
        let cost = cost.ok_or_else(|| Error::msg("interrupted"))?;
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        if cost.is_nan() {
            self.not_a_number.fetch_add(1, Ordering::Relaxed);
            return Ok(f64::INFINITY);
        }
        Ok(cost)
    }
}

/// A stream of the kernel as generator of `argmin`.
struct Numbers(Stream);

impl rand_core::RngCore for Numbers {
    fn next_u32(&mut self) -> u32 {
        (self.0.bits() >> 32) as u32
    }

    fn next_u64(&mut self) -> u64 {
        self.0.bits()
    }

    fn fill_bytes(&mut self, bytes: &mut [u8]) {
        for chunk in bytes.chunks_mut(8) {
            chunk.copy_from_slice(&self.0.bits().to_le_bytes()[..chunk.len()]);
        }
    }
}
