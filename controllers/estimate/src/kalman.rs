//! Extended Kalman filter with scalar updates.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::{EstimateError, finite, variance};

/// Innovation of a scalar update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Innovation {
    /// Measured minus predicted value ν, in units of the channel.
    pub value: f64,
    /// Its variance S = H P Hᵀ + r before the update.
    pub variance: f64,
}

impl Innovation {
    /// Returns the normalised innovation squared ν²/S, whose expectation is 1.
    #[inline]
    pub fn nis(&self) -> f64 {
        self.value * self.value / self.variance
    }
}

/// State of `N` variables with its covariance.
///
/// Measurements are scalars, one after the other, which is exact where their noises are
/// independent. Nothing is allocated.
///
/// ```
/// use nalgebra::{matrix, vector};
/// use twinrig_estimate::Kalman;
///
/// let mut constant = Kalman::new(vector![0.0], matrix![4.0])?;
/// let innovation = constant.update(1.0, 0.0, &vector![1.0], 4.0)?;
/// assert_eq!((constant.state()[0], constant.covariance()[0]), (0.5, 2.0));
/// assert_eq!((innovation.value, innovation.variance), (1.0, 8.0));
/// # Ok::<(), twinrig_estimate::EstimateError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kalman<const N: usize> {
    state: SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
}

impl<const N: usize> Kalman<N> {
    /// Creates a filter; the covariance is made symmetric.
    ///
    /// # Errors
    /// [`EstimateError::Value`] and [`EstimateError::Variance`] for values that are not finite and
    /// negative variances.
    pub fn new(
        state: SVector<f64, N>,
        covariance: SMatrix<f64, N, N>,
    ) -> Result<Self, EstimateError> {
        for &value in state.iter().chain(covariance.iter()) {
            finite("initial state or covariance", value)?;
        }
        for i in 0..N {
            variance("initial state", covariance[(i, i)], false)?;
        }
        let mut kalman = Self { state, covariance };
        kalman.symmetrise();
        Ok(kalman)
    }

    /// Returns the state.
    #[inline]
    pub fn state(&self) -> &SVector<f64, N> {
        &self.state
    }

    /// Returns the covariance, which is symmetric to the last bit.
    #[inline]
    pub fn covariance(&self) -> &SMatrix<f64, N, N> {
        &self.covariance
    }

    /// Predicts: x ← A x, P ← A P Aᵀ + Q (eqs. 4.9, 4.10).
    #[inline]
    pub fn predict(&mut self, transition: &SMatrix<f64, N, N>, noise: &SMatrix<f64, N, N>) {
        self.state = combine(transition, &self.state);
        // Transitions are sparse, which a dense product does not use: it takes three times as long.
        let product = rows_combined(transition, &self.covariance).transpose();
        self.covariance = rows_combined(transition, &product) + noise;
        self.symmetrise();
    }

    /// Updates by a measurement `measured` of a function with value `expected` and gradient
    /// `gradient` at the present state, with noise variance `noise`, in Joseph form:
    /// P ← (I − K H) P (I − K H)ᵀ + K r Kᵀ.
    ///
    /// A gradient of zero changes nothing.
    ///
    /// # Errors
    /// [`EstimateError::Variance`] if `noise` is not positive and finite,
    /// [`EstimateError::Value`] if the innovation is not finite; the state is unchanged.
    #[inline]
    pub fn update(
        &mut self,
        measured: f64,
        expected: f64,
        gradient: &SVector<f64, N>,
        noise: f64,
    ) -> Result<Innovation, EstimateError> {
        variance("measurement", noise, true)?;
        let value = measured - expected;
        finite("innovation", value)?;
        let cross = combine(&self.covariance, gradient);
        let spread = gradient.dot(&cross) + noise;
        finite("variance of the innovation", spread)?;
        let gain = cross / spread;
        self.state += gain * value;
        // (I − K H) P, then the same factor from the right: rank-one changes, never N³.
        let columns = &mut self.covariance.data.0;
        for (column, cross) in columns.iter_mut().zip(cross.iter()) {
            for (entry, gain) in column.iter_mut().zip(gain.iter()) {
                *entry -= gain * cross;
            }
        }
        let right = combine(&self.covariance, gradient) - gain * noise;
        let columns = &mut self.covariance.data.0;
        for (column, gain) in columns.iter_mut().zip(gain.iter()) {
            for (entry, right) in column.iter_mut().zip(right.iter()) {
                *entry -= right * gain;
            }
        }
        self.symmetrise();
        Ok(Innovation {
            value,
            variance: spread,
        })
    }

    /// Returns the normalised estimation error squared of the first states,
    /// (x − x̂)ᵀ P⁻¹ (x − x̂), whose expectation is their number.
    ///
    /// # Errors
    /// [`EstimateError::Length`] for no or more than `N` values,
    /// [`EstimateError::SingularCovariance`] if the covariance has no Cholesky factor.
    pub fn nees(&self, truth: &[f64]) -> Result<f64, EstimateError> {
        let count = truth.len();
        if count == 0 || count > N {
            return Err(EstimateError::Length {
                entry: "true states",
                found: count,
                required: format!("1 to {N} are possible"),
            });
        }
        // Forward substitution L y = x − x̂ beside the factorisation; NEES = |y|².
        let mut factor = SMatrix::<f64, N, N>::zeros();
        let mut scaled = SVector::<f64, N>::zeros();
        let mut nees = 0.0;
        for i in 0..count {
            let mut error = truth[i] - self.state[i];
            for j in 0..i {
                let mut entry = self.covariance[(i, j)];
                for k in 0..j {
                    entry -= factor[(i, k)] * factor[(j, k)];
                }
                factor[(i, j)] = entry / factor[(j, j)];
                error -= factor[(i, j)] * scaled[j];
            }
            let mut square = self.covariance[(i, i)];
            for k in 0..i {
                square -= factor[(i, k)] * factor[(i, k)];
            }
            if !(square.is_finite() && square > 0.0) {
                return Err(EstimateError::SingularCovariance { count });
            }
            factor[(i, i)] = square.sqrt();
            scaled[i] = error / factor[(i, i)];
            nees += scaled[i] * scaled[i];
        }
        Ok(nees)
    }

    #[inline]
    fn symmetrise(&mut self) {
        for row in 0..N {
            for column in 0..row {
                let mean = 0.5 * (self.covariance[(row, column)] + self.covariance[(column, row)]);
                self.covariance[(row, column)] = mean;
                self.covariance[(column, row)] = mean;
            }
        }
    }
}

/// Returns matrix times vector as a sum of columns, without those of factor zero.
#[inline]
fn combine<const N: usize>(
    matrix: &SMatrix<f64, N, N>,
    factors: &SVector<f64, N>,
) -> SVector<f64, N> {
    let mut sum = [0.0; N];
    for (column, &factor) in matrix.data.0.iter().zip(factors.iter()) {
        if factor != 0.0 {
            for (sum, entry) in sum.iter_mut().zip(column) {
                *sum += factor * entry;
            }
        }
    }
    SVector::from(sum)
}

/// Returns B Aᵀ: its column i is the sum of the columns of B with the factors in row i of A.
#[inline]
fn rows_combined<const N: usize>(
    a: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, N>,
) -> SMatrix<f64, N, N> {
    let mut product = SMatrix::<f64, N, N>::zeros();
    for (i, column) in product.data.0.iter_mut().enumerate() {
        for (k, source) in b.data.0.iter().enumerate() {
            let factor = a[(i, k)];
            if factor != 0.0 {
                for (entry, source) in column.iter_mut().zip(source) {
                    *entry += factor * source;
                }
            }
        }
    }
    product
}
