//! Derivatives of residuals by central differences.

use rayon::ThreadPool;
use rayon::prelude::*;
use twinrig_runtime::interrupt;

use super::{Failure, Residuals};

/// Derivatives of the residuals: a column for each parameter, in residuals per share of its range.
#[derive(Clone, Debug, PartialEq)]
pub struct Jacobian {
    /// Columns.
    pub columns: Vec<Vec<f64>>,
    /// Relative difference of each column from that with half its step.
    pub errors: Vec<f64>,
    /// Step of each column.
    pub steps: Vec<f64>,
}

/// Factors of the greatest step that are tried.
const FACTORS: [f64; 4] = [1.0, 0.25, 0.0625, 0.015_625];

impl Jacobian {
    /// Returns the derivatives at a point, with steps that are chosen anew for each parameter.
    ///
    /// # Errors
    /// [`Failure`] where the model has no result beside the point.
    pub(super) fn chosen(
        model: &dyn Residuals,
        point: &[f64],
        greatest: f64,
        threads: &ThreadPool,
    ) -> Result<Self, Failure> {
        let token = interrupt::current();
        let column = |parameter: usize| {
            interrupt::in_scope(token.as_ref(), || {
                let column = chosen_column(model, point, parameter, greatest);
                column.ok_or(Failure::Derivative { parameter })
            })
        };
        let parameters = 0..point.len();
        let columns: Result<Vec<_>, Failure> =
            threads.install(|| parameters.into_par_iter().map(column).collect());
        let mut jacobian = Self {
            columns: Vec::new(),
            errors: Vec::new(),
            steps: Vec::new(),
        };
        for (column, error, step) in columns? {
            jacobian.columns.push(column);
            jacobian.errors.push(error);
            jacobian.steps.push(step);
        }
        Ok(jacobian)
    }

    /// Returns the derivatives at a point with given steps.
    ///
    /// # Errors
    /// [`Failure`] where the model has no result beside the point.
    pub(super) fn with_steps(
        model: &dyn Residuals,
        point: &[f64],
        steps: &[f64],
        threads: &ThreadPool,
    ) -> Result<Self, Failure> {
        let mut jacobian = Self {
            columns: Vec::new(),
            errors: vec![0.0; steps.len()],
            steps: steps.to_vec(),
        };
        jacobian.move_to(model, point, threads)?;
        Ok(jacobian)
    }

    /// Computes the derivatives at another point with the same steps.
    ///
    /// # Errors
    /// [`Failure`] where the model has no result beside the point.
    pub(super) fn move_to(
        &mut self,
        model: &dyn Residuals,
        point: &[f64],
        threads: &ThreadPool,
    ) -> Result<(), Failure> {
        let token = interrupt::current();
        let derivative = |(parameter, step): (usize, &f64)| {
            interrupt::in_scope(token.as_ref(), || {
                column(model, point, parameter, *step).ok_or(Failure::Derivative { parameter })
            })
        };
        let steps = self.steps.par_iter().enumerate();
        let columns: Result<_, Failure> = threads.install(|| steps.map(derivative).collect());
        self.columns = columns?;
        Ok(())
    }
}

/// Returns the column whose step agrees best with half of it, its error and its step.
fn chosen_column(
    model: &dyn Residuals,
    point: &[f64],
    parameter: usize,
    greatest: f64,
) -> Option<(Vec<f64>, f64, f64)> {
    let mut best: Option<(Vec<f64>, f64, f64)> = None;
    for factor in FACTORS {
        let step = greatest * factor;
        let whole = column(model, point, parameter, step);
        let half = column(model, point, parameter, 0.5 * step);
        let (Some(whole), Some(half)) = (whole, half) else {
            continue;
        };
        let difference = norm(whole.iter().zip(&half).map(|(one, other)| one - other));
        let error = difference / norm(half.iter().copied()).max(f64::MIN_POSITIVE);
        if best.as_ref().is_none_or(|(_, least, _)| error < *least) {
            best = Some((whole, error, step));
        }
    }
    best
}

/// Returns a column by a central difference, at a bound by one to its inner side.
fn column(model: &dyn Residuals, point: &[f64], parameter: usize, step: f64) -> Option<Vec<f64>> {
    let at = |share: f64| {
        let mut beside = point.to_vec();
        beside[parameter] = share;
        (!interrupt::is_requested()).then(|| model.at(&beside))?
    };
    let (low, high) = (point[parameter] - step, point[parameter] + step);
    let (low, high) = (low.max(0.0), high.min(1.0));
    let (below, above) = (at(low)?, at(high)?);
    let slopes = below.iter().zip(&above);
    Some(
        slopes
            .map(|(low_value, high_value)| (high_value - low_value) / (high - low))
            .collect(),
    )
}

pub(super) fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}
