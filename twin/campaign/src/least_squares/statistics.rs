//! What residuals tell about the parameters.

use super::{LeastSquares, Minimum};
use crate::search::{Eigen, Matrix};

/// What the data tell about the parameters at a minimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Information {
    /// Variance of a residual, in squares of its assumed standard deviation.
    pub variance: f64,
    /// Factor by which residuals that depend on their neighbours tell less than independent ones:
    /// the integrated autocorrelation time in samples.
    pub correlation_time: f64,
    /// Covariance of the parameters, in shares of their ranges. The directions that the data cannot
    /// tell are not in it.
    pub covariance: Vec<Vec<f64>>,
    /// Directions in the space of the parameters, the best known one first.
    pub directions: Vec<Direction>,
    /// Independent parameters at no bound.
    pub free: Vec<bool>,
}

/// A direction in the space of the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    /// Unit vector, in shares of the ranges.
    pub vector: Vec<f64>,
    /// Standard deviation along it, as a share of the ranges; infinite where no residual changes.
    pub deviation: f64,
}

/// Standard deviation of a direction, as a share of the ranges, beyond which the data do not tell
/// it: a normal distribution of it is no narrower than the range itself.
const UNKNOWN: f64 = 0.3;

/// Least variance of a residual, in squares of its assumed standard deviation, that intervals rest
/// on: smaller residuals are numerical errors of the model, which tell nothing about parameters.
const VARIANCE_LEAST: f64 = 1e-4;

/// Returns the variance that intervals rest on.
fn spread(variance: f64, correlation_time: f64) -> f64 {
    variance.max(VARIANCE_LEAST) * correlation_time
}

impl Information {
    /// Computes it. `series` are the lengths of the series of samples that the residuals consist
    /// of, in order; autocorrelation is within each.
    pub fn of(settings: &LeastSquares, minimum: &Minimum, series: &[usize]) -> Self {
        let count = minimum.point.len();
        let free: Vec<bool> = minimum
            .point
            .iter()
            .map(|it| *it > 0.0 && *it < 1.0)
            .collect();
        let (matrix, _) = settings.normal(&minimum.jacobian, &minimum.residuals);
        let used = free.iter().filter(|free| **free).count();
        let degrees = minimum.residuals.len().saturating_sub(used).max(1) as f64;
        let variance = 2.0 * minimum.cost / degrees;
        let correlation_time = integrated_time(&minimum.residuals, series);
        let spread = spread(variance, correlation_time);

        let mut information = Matrix::zeros(count);
        for row in 0..count {
            for column in 0..count {
                if free[row] && free[column] {
                    information.set(row, column, matrix[row][column]);
                }
            }
        }
        let Eigen { values, vectors } = information.eigen();
        let mut directions: Vec<Direction> = values
            .iter()
            .enumerate()
            .map(|(k, value)| Direction {
                vector: (0..count).map(|row| vectors.at(row, k)).collect(),
                deviation: if *value > 0.0 {
                    (spread / value).sqrt()
                } else {
                    f64::INFINITY
                },
            })
            .filter(|direction| {
                // Not those of parameters at a bound.
                let held = direction.vector.iter().zip(&free);
                held.filter(|(_, free)| !**free)
                    .all(|(share, _)| share.abs() < 1e-9)
            })
            .collect();
        directions.sort_by(|one, other| one.deviation.total_cmp(&other.deviation));
        let mut covariance = vec![vec![0.0; count]; count];
        for direction in directions.iter().filter(|direction| direction.is_known()) {
            let square = direction.deviation * direction.deviation;
            for (row, one) in covariance.iter_mut().zip(&direction.vector) {
                for (value, other) in row.iter_mut().zip(&direction.vector) {
                    *value += square * one * other;
                }
            }
        }
        Self {
            variance,
            correlation_time,
            covariance,
            directions,
            free,
        }
    }

    /// Returns the variance that intervals rest on: that of residuals, at least 10⁻⁴, times the
    /// correlation time.
    pub(super) fn spread(&self) -> f64 {
        spread(self.variance, self.correlation_time)
    }

    /// Returns the standard deviation of a parameter, as a share of its range; infinite if a
    /// direction that the data cannot tell contains it.
    pub fn deviation(&self, parameter: usize) -> f64 {
        let unknown = self
            .directions
            .iter()
            .filter(|direction| !direction.is_known());
        let in_unknown: f64 = unknown
            .map(|direction| direction.vector[parameter] * direction.vector[parameter])
            .sum();
        if in_unknown > 0.01 {
            return f64::INFINITY;
        }
        self.covariance[parameter][parameter].sqrt()
    }

    /// Returns the correlation of two parameters, −1 to 1.
    pub fn correlation(&self, one: usize, other: usize) -> f64 {
        let scale = self.covariance[one][one] * self.covariance[other][other];
        if scale > 0.0 {
            self.covariance[one][other] / scale.sqrt()
        } else {
            0.0
        }
    }
}

impl Direction {
    /// Whether the data tell the direction.
    pub fn is_known(&self) -> bool {
        self.deviation < UNKNOWN
    }
}

/// Returns the integrated autocorrelation time of residuals \[samples\], at least 1: 1 + 2 Σ ρ(k),
/// summed up to the first negative autocorrelation (Geyer's initial positive sequence).
pub fn integrated_time(residuals: &[f64], series: &[usize]) -> f64 {
    let mut parts = Vec::new();
    let mut rest = residuals;
    for &length in series {
        let (part, behind) = rest.split_at(length.min(rest.len()));
        parts.push(part);
        rest = behind;
    }
    let power: f64 = residuals.iter().map(|it| it * it).sum();
    let longest = series.iter().copied().max().unwrap_or_default();
    let mut time = 1.0;
    for lag in 1..longest {
        let products = parts.iter().flat_map(|part| {
            let later = part.iter().skip(lag);
            part.iter().zip(later).map(|(one, other)| one * other)
        });
        let correlation = products.sum::<f64>() / power;
        if correlation.is_nan() || correlation <= 0.0 {
            break;
        }
        time += 2.0 * correlation;
    }
    time
}
