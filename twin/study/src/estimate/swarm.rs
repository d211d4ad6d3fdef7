//! Particle swarm.

use twinrig_kernel::stream;

/// Search in the unit cube.
pub(crate) struct Swarm<'a> {
    pub(crate) dimensions: usize,
    pub(crate) particles: usize,
    pub(crate) iterations: usize,
    pub(crate) seed: u64,
    /// Name of the random stream.
    pub(crate) name: &'a str,
}

/// Result of a search.
pub(crate) struct Found {
    pub(crate) position: Vec<f64>,
    pub(crate) cost: f64,
    pub(crate) evaluations: usize,
    pub(crate) truncated: bool,
    pub(crate) history: Vec<f64>,
}

/// Inertia and attraction by the particle's own and the common best position (constriction of Clerc
/// and Kennedy).
const INERTIA: f64 = 0.7298;
const ATTRACTION: f64 = 1.49618;

impl Swarm<'_> {
    pub(crate) fn minimise(
        &self,
        objective: &(dyn Fn(&[f64]) -> f64 + Sync),
        go_on: &mut dyn FnMut(usize) -> bool,
    ) -> Found {
        let mut random = stream(self.seed, &format!("search/{}", self.name));
        let mut place = |_| (0..self.dimensions).map(|_| random.unit()).collect();
        let mut positions: Vec<Vec<f64>> = (0..self.particles).map(&mut place).collect();
        let mut velocities = vec![vec![0.0; self.dimensions]; self.particles];
        let mut own = vec![(Vec::new(), f64::INFINITY); self.particles];
        let mut found = Found {
            position: vec![0.5; self.dimensions],
            cost: f64::INFINITY,
            evaluations: 0,
            truncated: false,
            history: Vec::new(),
        };
        for iteration in 0..self.iterations {
            if !go_on(iteration) {
                found.truncated = true;
                break;
            }
            for (position, own) in positions.iter().zip(&mut own) {
                let cost = objective(position);
                found.evaluations += 1;
                if cost < own.1 || own.0.is_empty() {
                    *own = (position.clone(), cost);
                }
                if cost < found.cost {
                    (found.position, found.cost) = (position.clone(), cost);
                }
            }
            found.history.push(found.cost);
            for ((position, velocity), own) in positions.iter_mut().zip(&mut velocities).zip(&own) {
                for d in 0..self.dimensions {
                    let [r, s] = [random.unit(), random.unit()];
                    velocity[d] = INERTIA * velocity[d]
                        + ATTRACTION * r * (own.0[d] - position[d])
                        + ATTRACTION * s * (found.position[d] - position[d]);
                    position[d] = (position[d] + velocity[d]).clamp(0.0, 1.0);
                }
            }
        }
        found
    }
}
