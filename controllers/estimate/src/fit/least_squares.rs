//! Nonlinear least squares by Levenberg's and Marquardt's method.

use nalgebra::{SMatrix, SVector};

use crate::error::EstimateError;

/// Model y(i; p) with `P` parameters.
pub(crate) trait Curve<const P: usize> {
    /// Name in messages.
    const NAME: &'static str;

    /// Number of samples.
    fn len(&self) -> usize;

    /// Calls `sample` with measured value, computed value and gradient for each sample in order.
    fn each(&self, parameters: &SVector<f64, P>, sample: impl FnMut(f64, f64, SVector<f64, P>));

    /// Whether the parameters are in the model's domain.
    fn allows(&self, _: &SVector<f64, P>) -> bool {
        true
    }
}

/// Parameters at the minimum.
pub(crate) struct Minimum<const P: usize> {
    pub(crate) parameters: SVector<f64, P>,
    pub(crate) r_squared: f64,
    pub(crate) residual: f64,
    pub(crate) iterations: usize,
}

/// Iterations before the fit counts as not converging.
const ITERATIONS: usize = 500;
/// Relative step, in the scale of each parameter, at which it has converged.
const STEP: f64 = 1e-12;
/// Relative decrease of the sum of squares below which accepted steps are at rounding level, and
/// the number of such steps in succession that ends the fit.
const DECREASE: f64 = 1e-14;
const STALLED: u32 = 3;
/// Damping at the start and beyond which no step can decrease the sum, and its factors.
const DAMPING: f64 = 1e-3;
const GREATEST_DAMPING: f64 = 1e12;
const LESS: f64 = 0.2;
const MORE: f64 = 4.0;

/// Normal equations at a point.
struct Normal<const P: usize> {
    square: f64,
    curvature: SMatrix<f64, P, P>,
    descent: SVector<f64, P>,
}

/// Minimises the sum of squared residuals from `start`.
///
/// The normal equations are scaled to a unit diagonal (Marquardt), so the units of the parameters
/// have no influence; they lose half the digits of a QR factorisation, which slows the end of the
/// search and does not move its minimum, where the gradient vanishes.
pub(crate) fn minimise<const P: usize, C: Curve<P>>(
    curve: &C,
    start: SVector<f64, P>,
) -> Result<Minimum<P>, EstimateError> {
    if curve.len() < P {
        return Err(EstimateError::Length {
            entry: C::NAME,
            found: curve.len(),
            required: format!("{P} parameters require at least as many"),
        });
    }
    let mut parameters = start;
    let mut normal = normal_equations(curve, &parameters);
    if !normal.square.is_finite() {
        return Err(EstimateError::Undetermined { what: C::NAME });
    }
    let (mut damping, mut stalled) = (DAMPING, 0);
    for iteration in 1..=ITERATIONS {
        let Some(step) = damped_step(&normal, damping) else {
            if damping > GREATEST_DAMPING {
                return Err(EstimateError::Undetermined { what: C::NAME });
            }
            damping *= MORE;
            continue;
        };
        let trial = parameters + step;
        let scale = parameters.component_mul(&parameters).add_scalar(1e-300);
        let length = step.component_mul(&step).component_div(&scale).max().sqrt();
        let there = curve
            .allows(&trial)
            .then(|| normal_equations(curve, &trial));
        let better = there.filter(|there| there.square <= normal.square);
        let small = length < STEP;
        if let Some(there) = better {
            let decrease = normal.square - there.square;
            stalled = if decrease <= DECREASE * normal.square {
                stalled + 1
            } else {
                0
            };
            (parameters, normal) = (trial, there);
            damping = (damping * LESS).max(1e-12);
        } else {
            damping *= MORE;
        }
        if small || stalled == STALLED || damping > GREATEST_DAMPING || normal.square == 0.0 {
            return Ok(minimum(curve, parameters, normal.square, iteration));
        }
    }
    let end = minimum(curve, parameters, normal.square, ITERATIONS);
    Err(EstimateError::NoConvergence {
        what: C::NAME,
        iterations: ITERATIONS,
        r_squared: end.r_squared,
    })
}

fn normal_equations<const P: usize, C: Curve<P>>(
    curve: &C,
    parameters: &SVector<f64, P>,
) -> Normal<P> {
    let mut normal = Normal {
        square: 0.0,
        curvature: SMatrix::zeros(),
        descent: SVector::zeros(),
    };
    curve.each(parameters, |measured, computed, gradient| {
        let residual = measured - computed;
        normal.square += residual * residual;
        normal.curvature += gradient * gradient.transpose();
        normal.descent += gradient * residual;
    });
    normal
}

/// Solves (J + λ diag J) δ = g in scaled parameters; `None` if it is not positive definite.
fn damped_step<const P: usize>(normal: &Normal<P>, damping: f64) -> Option<SVector<f64, P>> {
    let scale = SVector::<f64, P>::from_fn(|i, _| normal.curvature[(i, i)].sqrt());
    if scale
        .iter()
        .any(|scale| !(scale.is_finite() && *scale > 0.0))
    {
        return None;
    }
    let mut matrix = normal.curvature;
    for row in 0..P {
        for column in 0..P {
            matrix[(row, column)] /= scale[row] * scale[column];
        }
        matrix[(row, row)] += damping;
    }
    let step = matrix
        .cholesky()?
        .solve(&normal.descent.component_div(&scale));
    Some(step.component_div(&scale))
}

fn minimum<const P: usize, C: Curve<P>>(
    curve: &C,
    parameters: SVector<f64, P>,
    square: f64,
    iterations: usize,
) -> Minimum<P> {
    let count = curve.len() as f64;
    let (mut sum, mut spread) = (0.0, 0.0);
    curve.each(&parameters, |measured, _, _| sum += measured);
    let mean = sum / count;
    curve.each(&parameters, |measured, _, _| {
        spread += (measured - mean) * (measured - mean);
    });
    Minimum {
        parameters,
        r_squared: 1.0 - square / spread,
        residual: (square / count).sqrt(),
        iterations,
    }
}
