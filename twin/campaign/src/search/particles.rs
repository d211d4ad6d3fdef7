//! The particle swarm of `argmin`, asked for points and told costs.

use std::borrow::Borrow;
use std::cell::RefCell;

use argmin::core::{CostFunction, Error, PopulationState, Problem, Solver, State};
use argmin::solver::particleswarm::{Particle, ParticleSwarm};
use twinrig_kernel::{Stream, stream};

use super::{Search, SearchError, checked_costs};
use crate::places::{Places, share};

/// Weights of SPSO 2011: momentum 1/(2 ln 2), and 1/2 + ln 2 for both attractions.
const MOMENTUM: f64 = 0.5 / std::f64::consts::LN_2;
const ATTRACTION: f64 = 0.5 + std::f64::consts::LN_2;

/// A running particle swarm. The weights are those of SPSO 2011, there is one neighbourhood, and
/// particles that leave the bounds are reflected.
///
/// `argmin` asks for costs in the midst of an iteration. Therefore each iteration is done twice:
/// by a copy, which is stopped when it has asked for the costs, and, once these are known, by the
/// swarm itself.
pub struct SwarmSearch {
    solver: ParticleSwarm<Places, f64, Numbers>,
    state: Population,
    /// Generations that have been told costs.
    done: usize,
    iterations: usize,
    /// Number of points that await their costs.
    asked: usize,
}

/// Particles with their costs.
type Population = PopulationState<Particle<Places, f64>, f64>;

impl SwarmSearch {
    /// Creates a swarm that searches `dimensions` parameters in `iterations` after the initial
    /// points. Random numbers are of the stream `campaign/search` under `seed`.
    ///
    /// # Errors
    /// [`SearchError`] without parameters or particles.
    pub fn new(
        dimensions: usize,
        particles: usize,
        iterations: usize,
        seed: u64,
    ) -> Result<Self, SearchError> {
        if dimensions == 0 {
            return Err(SearchError::NoDimensions);
        }
        if particles == 0 {
            return Err(SearchError::Zero { what: "particles" });
        }
        // Places of the ranges, so that bounds of any size have no influence on the arithmetic.
        let bounds = [0.0, 1.0].map(|end| Places(vec![end; dimensions]));
        let solver = ParticleSwarm::new(bounds.into(), particles)
            .with_rng_generator(Numbers(stream(seed, "campaign/search")))
            .with_inertia_factor(MOMENTUM)
            .and_then(|solver| solver.with_cognitive_factor(ATTRACTION))
            .and_then(|solver| solver.with_social_factor(ATTRACTION))
            .map_err(|error| failed(&error))?;
        Ok(Self {
            solver,
            state: PopulationState::new(),
            done: 0,
            iterations,
            asked: 0,
        })
    }
}

impl Search for SwarmSearch {
    fn ask(&mut self) -> Result<Option<Vec<Vec<f64>>>, SearchError> {
        if self.done > self.iterations {
            return Ok(None);
        }
        let mut problem = Problem::new(AskedPlaces::default());
        let (mut solver, state) = (self.solver.clone(), self.state.clone());
        // Stopped by its costs.
        let stopped = iterate(&mut solver, &mut problem, state, self.done);
        let places = problem.problem.map(|asked| asked.0.into_inner());
        match (stopped, places) {
            (Err(_), Some(places)) if !places.is_empty() => {
                self.asked = places.len();
                let shares = |Places(places): Places| places.into_iter().map(share).collect();
                Ok(Some(places.into_iter().map(shares).collect()))
            }
            (Err(error), _) => Err(failed(&error)),
            (Ok(_), _) => Err(SearchError::Optimiser("it asked for no cost".to_owned())),
        }
    }

    fn tell(&mut self, costs: &[f64]) -> Result<(), SearchError> {
        let costs = checked_costs(costs, self.asked)?;
        self.asked = 0;
        let mut problem = Problem::new(KnownCosts(costs));
        let state = std::mem::replace(&mut self.state, PopulationState::new());
        let state = iterate(&mut self.solver, &mut problem, state, self.done);
        self.state = state.map_err(|error| failed(&error))?;
        self.done += 1;
        Ok(())
    }
}

/// Does iteration `done`; 0 are the initial points.
fn iterate<O: CostFunction<Param = Places, Output = f64>>(
    solver: &mut ParticleSwarm<Places, f64, Numbers>,
    problem: &mut Problem<O>,
    state: Population,
    done: usize,
) -> Result<Population, Error> {
    let result = if done == 0 {
        solver.init(problem, state)
    } else {
        solver.next_iter(problem, state)
    };
    result.map(|(state, _)| state)
}

fn failed(error: &Error) -> SearchError {
    SearchError::Optimiser(error.to_string())
}

/// Objective that keeps the places of an iteration and stops it.
#[derive(Default)]
struct AskedPlaces(RefCell<Vec<Places>>);

impl CostFunction for AskedPlaces {
    type Param = Places;
    type Output = f64;

    fn cost(&self, places: &Places) -> Result<f64, Error> {
        self.bulk_cost(&[places]).map(|_| 0.0)
    }

    fn bulk_cost<P: Borrow<Places>>(&self, places: &[P]) -> Result<Vec<f64>, Error> {
        let places = places.iter().map(|places| places.borrow().clone());
        self.0.borrow_mut().extend(places);
        Err(Error::msg("the costs are not known yet"))
    }
}

/// Objective whose values are known.
struct KnownCosts(Vec<f64>);

impl CostFunction for KnownCosts {
    type Param = Places;
    type Output = f64;

    fn cost(&self, _: &Places) -> Result<f64, Error> {
        Err(Error::msg("a single cost was asked for"))
    }

    fn bulk_cost<P: Borrow<Places>>(&self, places: &[P]) -> Result<Vec<f64>, Error> {
        if places.len() == self.0.len() {
            Ok(self.0.clone())
        } else {
            Err(Error::msg("other points were asked for"))
        }
    }
}

/// A stream of the kernel as generator of `argmin`.
#[derive(Clone)]
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
