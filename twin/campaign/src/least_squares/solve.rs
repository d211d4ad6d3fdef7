//! Levenberg's and Marquardt's method.

use rayon::ThreadPool;
use twinrig_runtime::interrupt;

use super::matrix::solve;
use super::{Failure, Jacobian, LeastSquares, Residuals};

/// Damping at the start, its factors, and the damping beyond which no step decreases the cost.
const DAMPING: f64 = 1e-2;
const LESS: f64 = 0.2;
const MORE: f64 = 4.0;
const DAMPING_MAX: f64 = 1e9;
/// Relative decrease of the cost below which a step is of no use, and the number of such steps in
/// succession that end the fit.
const DECREASE: f64 = 1e-8;
const STALLED: usize = 3;

/// A step of a minimisation, for reports of progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<'a> {
    /// Steps done.
    pub iteration: usize,
    /// Cost.
    pub cost: f64,
    /// Point.
    pub point: &'a [f64],
}

/// End of a minimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Descent {
    /// Shares of the ranges.
    pub point: Vec<f64>,
    /// Sum of the costs.
    pub cost: f64,
    /// Steps taken.
    pub iterations: usize,
    /// Whether a step was small enough; otherwise the steps were used up.
    pub converged: bool,
}

/// Minimum of a sum of costs of residuals, with what is needed for its [`Information`].
///
/// [`Information`]: super::Information
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// Shares of the ranges.
    pub point: Vec<f64>,
    /// Sum of the costs.
    pub cost: f64,
    /// Residuals, in standard deviations.
    pub residuals: Vec<f64>,
    /// Their derivatives there, with steps chosen there.
    pub jacobian: Jacobian,
}

impl LeastSquares {
    /// Minimises the sum of the costs of residuals from `start`. `progress` is called after each
    /// step, and returns whether to continue.
    ///
    /// # Errors
    /// [`Failure`] where the model has no result, and after an interrupt.
    pub fn minimise(
        &self,
        model: &dyn Residuals,
        start: &[f64],
        progress: &mut dyn FnMut(Step<'_>) -> bool,
    ) -> Result<Descent, Failure> {
        self.minimise_by(model, start, None, progress)
    }

    /// Returns residuals and derivatives at a point.
    ///
    /// # Errors
    /// As [`Self::minimise`].
    pub fn evaluate(&self, model: &dyn Residuals, point: &[f64]) -> Result<Minimum, Failure> {
        let found = self.evaluated(model, point);
        if interrupt::is_requested() {
            return Err(Failure::Interrupted(0));
        }
        found
    }

    fn evaluated(&self, model: &dyn Residuals, point: &[f64]) -> Result<Minimum, Failure> {
        let residuals = model.at(point).ok_or(Failure::Start)?;
        Ok(Minimum {
            point: point.to_vec(),
            cost: self.cost(&residuals),
            jacobian: Jacobian::chosen(model, point, self.difference, &self.pool()?)?,
            residuals,
        })
    }

    fn pool(&self) -> Result<ThreadPool, Failure> {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(self.threads);
        threads
            .build()
            .map_err(|error| Failure::Threads(error.to_string()))
    }

    /// Minimises the same by differences of given steps, or of steps chosen at the start.
    ///
    /// # Errors
    /// As [`Self::minimise`].
    pub(super) fn minimise_by(
        &self,
        model: &dyn Residuals,
        start: &[f64],
        differences: Option<&[f64]>,
        progress: &mut dyn FnMut(Step<'_>) -> bool,
    ) -> Result<Descent, Failure> {
        let mut iteration = 0;
        let found = self.steps(model, start, differences, progress, &mut iteration);
        // An interrupted model has no result.
        if interrupt::is_requested() {
            return Err(Failure::Interrupted(iteration));
        }
        found
    }

    fn steps(
        &self,
        model: &dyn Residuals,
        start: &[f64],
        differences: Option<&[f64]>,
        progress: &mut dyn FnMut(Step<'_>) -> bool,
        iteration: &mut usize,
    ) -> Result<Descent, Failure> {
        let threads = &self.pool()?;
        let mut point: Vec<f64> = start.iter().map(|share| share.clamp(0.0, 1.0)).collect();
        let mut residuals = model.at(&point).ok_or(Failure::Start)?;
        let mut cost = self.cost(&residuals);
        if self.iterations == 0 {
            return Ok(Descent {
                point,
                cost,
                iterations: 0,
                converged: false,
            });
        }
        let mut jacobian = match differences {
            Some(steps) => Jacobian::with_steps(model, &point, steps, threads),
            None => Jacobian::chosen(model, &point, self.difference, threads),
        }?;
        let (mut damping, mut stalled, mut converged) = (DAMPING, 0, false);
        while *iteration < self.iterations && !converged {
            *iteration += 1;
            let (matrix, gradient) = self.normal(&jacobian, &residuals);
            loop {
                let step = damped_step(&matrix, &gradient, &point, damping);
                let trial: Vec<f64> = point
                    .iter()
                    .zip(&step)
                    .map(|(share, step)| (share + step).clamp(0.0, 1.0))
                    .collect();
                let moved = trial
                    .iter()
                    .zip(&point)
                    .map(|(one, other)| (one - other).abs());
                let length = moved.fold(0.0, f64::max);
                let there = model
                    .at(&trial)
                    .map(|residuals| (self.cost(&residuals), residuals));
                let better = there.filter(|(trial_cost, _)| *trial_cost < cost);
                converged = length < self.tolerance;
                if let Some((trial_cost, trial_residuals)) = better {
                    let decrease = (cost - trial_cost) / cost;
                    stalled = if decrease < DECREASE { stalled + 1 } else { 0 };
                    (point, cost, residuals) = (trial, trial_cost, trial_residuals);
                    damping = (damping * LESS).max(1e-12);
                    break;
                }
                damping *= MORE;
                if converged || damping > DAMPING_MAX {
                    converged = true;
                    break;
                }
            }
            converged |= stalled >= STALLED;
            let step = Step {
                iteration: *iteration,
                cost,
                point: &point,
            };
            if !progress(step) {
                return Err(Failure::Interrupted(*iteration));
            }
            if !converged && *iteration < self.iterations {
                jacobian.move_to(model, &point, threads)?;
            }
        }
        Ok(Descent {
            point,
            cost,
            iterations: *iteration,
            converged,
        })
    }

    /// Returns the sum of the costs.
    pub fn cost(&self, residuals: &[f64]) -> f64 {
        residuals
            .iter()
            .map(|residual| self.loss.cost(*residual))
            .sum()
    }

    /// Returns Jᵀ W J and −Jᵀ W r.
    pub(super) fn normal(
        &self,
        jacobian: &Jacobian,
        residuals: &[f64],
    ) -> (Vec<Vec<f64>>, Vec<f64>) {
        let weights: Vec<f64> = residuals
            .iter()
            .map(|residual| self.loss.weight(*residual))
            .collect();
        let columns = &jacobian.columns;
        let weighted = |one: &[f64], other: &[f64]| -> f64 {
            let products = one.iter().zip(other).zip(&weights);
            products
                .map(|((one, other), weight)| one * other * weight)
                .sum()
        };
        let matrix = columns
            .iter()
            .map(|one| columns.iter().map(|other| weighted(one, other)).collect())
            .collect();
        let gradient = columns
            .iter()
            .map(|column| -weighted(column, residuals))
            .collect();
        (matrix, gradient)
    }
}

/// Solves (A + λ diag A) δ = g for the parameters that are not held at a bound, towards which the
/// gradient points.
fn damped_step(matrix: &[Vec<f64>], gradient: &[f64], point: &[f64], damping: f64) -> Vec<f64> {
    let largest = (0..point.len()).map(|i| matrix[i][i]).fold(0.0, f64::max);
    let is_free = |parameter: &usize| {
        let held = (point[*parameter] <= 0.0 && gradient[*parameter] < 0.0)
            || (point[*parameter] >= 1.0 && gradient[*parameter] > 0.0);
        !held && matrix[*parameter][*parameter] > 1e-14 * largest
    };
    let free: Vec<usize> = (0..point.len()).filter(is_free).collect();
    let part: Vec<Vec<f64>> = free
        .iter()
        .map(|&row| {
            let columns = free.iter();
            columns
                .map(|&column| {
                    let scale = if row == column { 1.0 + damping } else { 1.0 };
                    matrix[row][column] * scale
                })
                .collect()
        })
        .collect();
    let right: Vec<f64> = free.iter().map(|&row| gradient[row]).collect();
    let mut step = vec![0.0; point.len()];
    if let Some(solution) = solve(&part, &right) {
        for (&parameter, value) in free.iter().zip(solution) {
            step[parameter] = value;
        }
    }
    step
}
