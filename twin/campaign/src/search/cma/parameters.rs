//! Weights and learning rates of CMA-ES (Hansen, *The CMA Evolution Strategy: A Tutorial*,
//! arXiv:1604.00772, table 1).

/// Constants of a strategy for `n` parameters and a population of λ.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parameters {
    /// Recombination weights of all λ points, the best first. Those of the parents are positive and
    /// sum to 1; those of the others are negative, and act on the covariances only.
    pub weights: Vec<f64>,
    /// Variance-effective number of parents, `µ_eff`.
    pub parents: f64,
    /// Cumulation of the path of the covariances, `c_c`.
    pub path: f64,
    /// Learning rate of the rank-one update, `c_1`.
    pub rank_one: f64,
    /// Learning rate of the rank-µ update, `c_µ`.
    pub rank_mu: f64,
    /// Cumulation of the path of the step size, `c_σ`.
    pub step_path: f64,
    /// Damping of the step size, `d_σ`.
    pub damping: f64,
    /// Mean length of a standard normal vector, E‖N(0, I)‖.
    pub normal_length: f64,
}

/// Returns the usual population, 4 + ⌊3 ln n⌋.
pub(super) fn usual_population(dimensions: usize) -> usize {
    let extra = 3.0 * libm::log(dimensions as f64);
    let counts = 1..=3 * dimensions;
    4 + counts.take_while(|&count| count as f64 <= extra).count()
}

impl Parameters {
    pub fn new(dimensions: usize, population: usize) -> Self {
        let n = dimensions as f64;
        let raw: Vec<f64> = (1..=population)
            .map(|rank| libm::log(0.5 * (population as f64 + 1.0)) - libm::log(rank as f64))
            .collect();
        let (better, worse) = raw.split_at(population / 2);
        let parents = effective(better);
        let path = (4.0 + parents / n) / (n + 4.0 + 2.0 * parents / n);
        let rank_one = 2.0 / ((n + 1.3) * (n + 1.3) + parents);
        let rank_mu = 2.0 * (parents - 2.0 + 1.0 / parents) / ((n + 2.0) * (n + 2.0) + parents);
        let rank_mu = rank_mu.min(1.0 - rank_one);
        let step_path = (parents + 2.0) / (n + parents + 5.0);
        let excess = ((parents - 1.0) / (n + 1.0)).sqrt() - 1.0;
        // Negative weights: their sum is bounded so that the decay of the covariances is
        // compensated, and the covariances stay positive.
        let negative = (1.0 + rank_one / rank_mu)
            .min(1.0 + 2.0 * effective(worse) / (parents + 2.0))
            .min((1.0 - rank_one - rank_mu) / (n * rank_mu));
        let (sum, sum_worse) = (better.iter().sum::<f64>(), worse.iter().sum::<f64>());
        let weight = |&raw: &f64| raw / sum;
        let negative_weight = |&raw: &f64| negative * raw / sum_worse.abs();
        let positive = better.iter().map(weight);
        Self {
            weights: positive.chain(worse.iter().map(negative_weight)).collect(),
            parents,
            path,
            rank_one,
            rank_mu,
            step_path,
            damping: 1.0 + 2.0 * excess.max(0.0) + step_path,
            normal_length: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        }
    }
}

/// Variance-effective number of weights.
fn effective(weights: &[f64]) -> f64 {
    let sum: f64 = weights.iter().sum();
    sum * sum / weights.iter().map(|weight| weight * weight).sum::<f64>()
}
