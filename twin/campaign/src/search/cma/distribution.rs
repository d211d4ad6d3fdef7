//! The normal distribution of CMA-ES and its update by ranked samples.

use super::super::eigen::{Eigen, Matrix};
use super::parameters::Parameters;

/// Normal distribution N(m, σ² C) with its evolution paths.
#[derive(Clone, Debug)]
pub(super) struct Distribution {
    pub parameters: Parameters,
    /// Mean m.
    pub mean: Vec<f64>,
    /// Step size σ.
    pub step: f64,
    /// C.
    pub covariances: Matrix,
    eigen: Eigen,
    /// Path `p_c` of the mean.
    pub path: Vec<f64>,
    /// Path `p_σ`, of isotropic steps.
    pub step_path: Vec<f64>,
    /// Number of updates.
    pub updates: usize,
}

/// Largest step size relative to the unit: samples are then all over the range, and more is of no
/// use. A flat cost increases it without end.
const STEP_MOST: f64 = 1.0;

/// Ratio of eigenvalues at which the least of them is round-off.
const CONDITION_MOST: f64 = 1e14;

impl Distribution {
    /// Creates an isotropic distribution for populations of `population`.
    pub fn new(mean: Vec<f64>, step: f64, population: usize) -> Self {
        let size = mean.len();
        let covariances = Matrix::identity(size);
        Self {
            parameters: Parameters::new(size, population),
            step,
            eigen: covariances.eigen(),
            covariances,
            path: vec![0.0; size],
            step_path: vec![0.0; size],
            updates: 0,
            mean,
        }
    }

    /// Returns the sample m + σ B D `normal` of a standard normal vector, where B and D² are
    /// eigenvectors and eigenvalues of C.
    pub fn sample(&self, normal: &[f64]) -> Vec<f64> {
        let scaled: Vec<f64> = normal
            .iter()
            .zip(&self.eigen.values)
            .map(|(number, value)| number * value.sqrt())
            .collect();
        let offset = self.eigen.vectors.times(&scaled);
        let pairs = self.mean.iter().zip(offset);
        pairs
            .map(|(mean, offset)| mean + self.step * offset)
            .collect()
    }

    /// Returns B D⁻¹ Bᵀ `vector`, that is C^(−1/2) `vector`.
    fn whitened(&self, vector: &[f64]) -> Vec<f64> {
        let mut along = self.eigen.vectors.transposed_times(vector);
        for (value, eigenvalue) in along.iter_mut().zip(&self.eigen.values) {
            *value /= eigenvalue.sqrt();
        }
        self.eigen.vectors.times(&along)
    }

    /// Returns the standard deviations of the coordinates.
    pub fn deviations(&self) -> impl Iterator<Item = f64> {
        self.covariances
            .diagonal()
            .map(|variance| self.step * variance.sqrt())
    }

    /// Returns the ratio of the largest to the least eigenvalue of C.
    pub fn condition(&self) -> f64 {
        let values = self.eigen.values.iter();
        let [least, most] = values.fold([f64::INFINITY, 0.0], |[least, most], &value| {
            [value.min(least), value.max(most)]
        });
        most / least
    }

    /// Returns whether the eigenvalues of C are more than round-off.
    pub fn is_regular(&self) -> bool {
        (1.0..=CONDITION_MOST).contains(&self.condition())
    }

    /// Enlarges the step size where costs are flat.
    pub fn widen(&mut self) {
        let Parameters {
            step_path, damping, ..
        } = self.parameters;
        self.scale_step(0.2 + step_path / damping);
    }

    /// Updates the distribution by samples, of which the best are first.
    pub fn update(&mut self, ranked: &[&[f64]]) {
        let parameters = self.parameters.clone();
        let n = self.mean.len() as f64;
        self.updates += 1;
        // Steps of the samples, y = (x − m)/σ, and their weighted mean.
        let steps: Vec<Vec<f64>> = ranked
            .iter()
            .map(|sample| {
                let pairs = sample.iter().zip(&self.mean);
                pairs.map(|(x, mean)| (x - mean) / self.step).collect()
            })
            .collect();
        let mut mean_step = vec![0.0; self.mean.len()];
        for (step, weight) in steps.iter().zip(&parameters.weights[..ranked.len() / 2]) {
            accumulate(&mut mean_step, step, *weight);
        }
        accumulate(&mut self.mean, &mean_step, self.step);
        // Paths.
        let c_s = parameters.step_path;
        let whitened = self.whitened(&mean_step);
        let length = (c_s * (2.0 - c_s) * parameters.parents).sqrt();
        follow(&mut self.step_path, &whitened, c_s, length);
        let square: f64 = self.step_path.iter().map(|value| value * value).sum();
        // While the step size grows fast, the path of the mean would be too long.
        let begun = 1.0 - libm::pow(1.0 - c_s, 2.0 * self.updates as f64);
        let is_moderate = square / n / begun < 2.0 + 4.0 / (n + 1.0);
        let c_c = parameters.path;
        let length = (c_c * (2.0 - c_c) * parameters.parents).sqrt();
        let length = if is_moderate { length } else { 0.0 };
        follow(&mut self.path, &mean_step, c_c, length);
        self.update_covariances(&steps, is_moderate);
        let ratio = square.sqrt() / parameters.normal_length - 1.0;
        self.scale_step((c_s / parameters.damping * ratio).min(1.0));
    }

    fn update_covariances(&mut self, steps: &[Vec<f64>], is_moderate: bool) {
        let Parameters {
            rank_one,
            rank_mu,
            path,
            ref weights,
            ..
        } = self.parameters;
        let lost = if is_moderate {
            0.0
        } else {
            path * (2.0 - path)
        };
        let sum: f64 = weights.iter().sum();
        let n = self.mean.len() as f64;
        let weights: Vec<f64> = steps
            .iter()
            .zip(weights)
            .map(|(step, &weight)| {
                // Without regard to the length of a bad step the matrix might become indefinite.
                let square = |step| self.whitened(step).iter().map(|y| y * y).sum::<f64>();
                if weight < 0.0 {
                    weight * n / square(step)
                } else {
                    weight
                }
            })
            .collect();
        let kept = 1.0 - rank_one * (1.0 - lost) - rank_mu * sum;
        self.covariances.scale(kept);
        self.covariances.add_outer(&self.path, rank_one);
        for (step, weight) in steps.iter().zip(weights) {
            self.covariances.add_outer(step, rank_mu * weight);
        }
        self.eigen = self.covariances.eigen();
    }

    fn scale_step(&mut self, exponent: f64) {
        self.step *= libm::exp(exponent);
        let widest = self.deviations().fold(0.0, f64::max);
        if widest > STEP_MOST {
            self.step *= STEP_MOST / widest;
        }
    }
}

/// Adds `weight` × `other`.
fn accumulate(sum: &mut [f64], other: &[f64], weight: f64) {
    for (sum, other) in sum.iter_mut().zip(other) {
        *sum += weight * other;
    }
}

/// Moves a path on: (1 − `rate`) path + `length` × `step`.
fn follow(path: &mut [f64], step: &[f64], rate: f64, length: f64) {
    for (path, step) in path.iter_mut().zip(step) {
        *path = (1.0 - rate) * *path + length * step;
    }
}
