//! Identification of the coefficients of rate and acceleration by frequency.

use nalgebra::{SMatrix, SVector};

use super::Fitted;
use super::least_squares::{Curve, minimise};
use crate::error::{EstimateError, finite};
use crate::model::Decay;

/// Sample of a run with the piezoelectric cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateSample {
    /// Rate \[N/s\].
    pub rate: f64,
    /// Acceleration \[N/s²\].
    pub acceleration: f64,
    /// Measured voltage \[V\].
    pub voltage: f64,
}

/// Samples at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run<'a> {
    /// Frequency \[Hz\].
    pub hz: f64,
    /// Samples of whole periods.
    pub samples: &'a [RateSample],
}

/// Coefficients of V = a(f)·Ḟ + b(f)·F̈ + D.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientFit {
    /// a \[V·s/N\], b \[V·s²/N\] and D \[V\] of each run, with the R² of its plane.
    pub runs: Vec<Fitted<[f64; 3]>>,
    /// a(f), with the R² of the exponential.
    pub rate: Fitted<Decay>,
    /// b(f), with the R² of the exponential.
    pub acceleration: Fitted<Decay>,
}

/// Fits a plane to each run, and exponentials of the frequency to its coefficients.
///
/// # Errors
/// [`EstimateError::Undetermined`] if rates and accelerations of a run do not determine a plane, or
/// a coefficient has values of both signs; [`EstimateError::Length`] for fewer than two runs;
/// [`EstimateError::NoConvergence`].
pub fn coefficients(runs: &[Run<'_>]) -> Result<CoefficientFit, EstimateError> {
    let planes: Vec<_> = runs.iter().map(plane).collect::<Result<_, _>>()?;
    let decay = |index: usize| {
        let at = |(run, plane): (&Run<'_>, &Fitted<[f64; 3]>)| (run.hz, plane.model[index]);
        let points: Vec<_> = runs.iter().zip(&planes).map(at).collect();
        exponential(&points)
    };
    let (rate, acceleration) = (decay(0)?, decay(1)?);
    Ok(CoefficientFit {
        runs: planes,
        rate,
        acceleration,
    })
}

/// Linear least squares. Columns are scaled to unit length, so Cholesky's factorisation of the
/// normal equations loses few digits: rate and acceleration of a period are orthogonal.
fn plane(run: &Run<'_>) -> Result<Fitted<[f64; 3]>, EstimateError> {
    finite("frequency of a run", run.hz)?;
    let row = |it: &RateSample| SVector::from([it.rate, it.acceleration, 1.0]);
    let count = run.samples.len() as f64;
    let mean = run.samples.iter().map(|it| it.voltage).sum::<f64>() / count;
    let (mut matrix, mut right) = (SMatrix::<f64, 3, 3>::zeros(), SVector::<f64, 3>::zeros());
    let mut spread = 0.0;
    for it in run.samples {
        matrix += row(it) * row(it).transpose();
        right += row(it) * it.voltage;
        spread += (it.voltage - mean) * (it.voltage - mean);
    }
    let scale = matrix.diagonal().map(f64::sqrt);
    for i in 0..3 {
        for j in 0..3 {
            matrix[(i, j)] /= scale[i] * scale[j];
        }
    }
    let undetermined = EstimateError::Undetermined {
        what: "the coefficients of rate and acceleration",
    };
    let valid = matrix.iter().chain(right.iter()).all(|it| it.is_finite());
    let factor = matrix.cholesky().filter(|_| valid).ok_or(undetermined)?;
    let solution = factor.solve(&right.component_div(&scale));
    let model = solution.component_div(&scale);
    let error = |it: &RateSample| it.voltage - row(it).dot(&model);
    let square: f64 = run.samples.iter().map(|it| error(it) * error(it)).sum();
    Ok(Fitted {
        model: [model[0], model[1], model[2]],
        r_squared: 1.0 - square / spread,
        residual: (square / count).sqrt(),
        iterations: 1,
    })
}

struct Points<'a>(&'a [(f64, f64)]);

impl Curve<2> for Points<'_> {
    const NAME: &'static str = "the exponential of the frequency";

    fn len(&self) -> usize {
        self.0.len()
    }

    /// Parameters: value and 1/scale.
    fn each(&self, p: &SVector<f64, 2>, mut sample: impl FnMut(f64, f64, SVector<f64, 2>)) {
        for &(hz, coefficient) in self.0 {
            let fall = libm::exp(-hz * p[1]);
            let gradient = SVector::from([fall, -p[0] * fall * hz]);
            sample(coefficient, p[0] * fall, gradient);
        }
    }
}

/// Fits value·exp(−f/scale) to points (f, coefficient), from the line through their logarithms.
fn exponential(points: &[(f64, f64)]) -> Result<Fitted<Decay>, EstimateError> {
    let undetermined = EstimateError::Undetermined { what: Points::NAME };
    let sign = points.first().map_or(1.0, |point| point.1.signum());
    if points.iter().any(|&(_, value)| value * sign <= 0.0) {
        return Err(undetermined);
    }
    let count = points.len() as f64;
    let logarithm = |value: f64| libm::log(value * sign);
    let mean_hz = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mean_log = points.iter().map(|point| logarithm(point.1)).sum::<f64>() / count;
    let (mut both, mut square) = (0.0, 0.0);
    for &(hz, value) in points {
        both += (hz - mean_hz) * (logarithm(value) - mean_log);
        square += (hz - mean_hz) * (hz - mean_hz);
    }
    let fall = -both / square;
    let start = SVector::from([sign * libm::exp(mean_log + fall * mean_hz), fall]);
    let minimum = minimise(&Points(points), start)?;
    let falls = minimum.parameters[1] > 0.0;
    if !falls {
        return Err(undetermined);
    }
    Ok(Fitted {
        model: Decay {
            value: minimum.parameters[0],
            scale_hz: 1.0 / minimum.parameters[1],
        },
        r_squared: minimum.r_squared,
        residual: minimum.residual,
        iterations: minimum.iterations,
    })
}
