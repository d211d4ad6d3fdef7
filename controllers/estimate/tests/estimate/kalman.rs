//! Laws of the filter's core.

use nalgebra::{SMatrix, SVector, matrix, vector};
use proptest::prelude::*;
use twinrig_estimate::{EstimateError, Kalman};
use twinrig_kernel::{Stream, stream};

fn vector5(random: &mut Stream) -> SVector<f64, 5> {
    SVector::from_fn(|_, _| random.normal())
}

/// Least eigenvalue of the covariance scaled to a unit diagonal.
fn least_eigenvalue(covariance: &SMatrix<f64, 5, 5>) -> f64 {
    let scale = covariance.diagonal().map(f64::sqrt);
    let scaled = SMatrix::<f64, 5, 5>::from_fn(|i, j| covariance[(i, j)] / (scale[i] * scale[j]));
    scaled.symmetric_eigenvalues().min()
}

/// Gradients of all kinds: random, of one state, nearly parallel to the last one, zero, huge, tiny.
fn gradient(random: &mut Stream, last: &SVector<f64, 5>) -> SVector<f64, 5> {
    match random.between(0, 6) {
        0 => vector5(random),
        1 => {
            let index = random.between(0, 4);
            SVector::from_fn(|row, _| f64::from(u8::from(row as u64 == index)))
        }
        2 => last + vector5(random) * 1e-9,
        3 => SVector::zeros(),
        4 => vector5(random) * 1e8,
        5 => vector5(random) * 1e-12,
        _ => *last,
    }
}

#[test]
fn covariance_stays_positive_over_100_000_degenerate_steps() {
    let mut random = stream(1, "tests/degenerate");
    let chain = {
        let mut chain = SMatrix::<f64, 5, 5>::identity();
        for i in 0..4 {
            chain[(i, i + 1)] = 1e-3;
        }
        chain
    };
    let mut kalman = Kalman::new(vector5(&mut random), SMatrix::identity()).unwrap();
    let (mut last, mut least) = (vector5(&mut random), f64::INFINITY);
    for step in 0..100_000_u32 {
        let noise = SVector::<f64, 5>::from_fn(|_, _| random.unit() * 1e-6);
        kalman.predict(&chain, &SMatrix::from_diagonal(&noise));
        last = gradient(&mut random, &last);
        let noise = libm::pow(10.0, -12.0 + 12.0 * random.unit());
        let expected = last.dot(kalman.state());
        let measured = expected + noise.sqrt() * random.normal();
        kalman.update(measured, expected, &last, noise).unwrap();
        let covariance = kalman.covariance();
        assert_eq!(*covariance, covariance.transpose(), "step {step}");
        assert!(
            kalman.state().iter().all(|it| it.is_finite()),
            "step {step}"
        );
        assert!(covariance.diagonal().min() > 0.0, "step {step}");
        if step % 10 == 0 {
            least = least.min(least_eigenvalue(covariance));
        }
    }
    // Rounding of the greatest eigenvalue, at most 5: where gradients of 10⁸ meet noise of 10⁻¹²
    // the true least one is far below it.
    assert!(least > -5.0 * f64::EPSILON * 10.0, "{least:e}");
}

proptest! {
    /// The textbook's update with the inverse of P: P' = (P⁻¹ + h hᵀ/r)⁻¹, x' = P' (P⁻¹ x + h z/r).
    #[test]
    fn update_is_that_of_information(
        entries in prop::array::uniform9(-1.0..1.0_f64),
        h in prop::array::uniform3(-2.0..2.0_f64),
        z in -5.0..5.0_f64,
        r in 0.1..10.0_f64,
    ) {
        let root = SMatrix::<f64, 3, 3>::from_row_slice(&entries);
        let covariance = root * root.transpose() + SMatrix::identity();
        let (x, h) = (vector![1.0, -2.0, 0.5], SVector::from(h));
        let mut kalman = Kalman::new(x, covariance).unwrap();
        let innovation = kalman.update(z, h.dot(&x), &h, r).unwrap();
        let prior = covariance.try_inverse().unwrap();
        let posterior = (prior + h * h.transpose() / r).try_inverse().unwrap();
        let state = posterior * (prior * x + h * (z / r));
        // Condition numbers below 100 and values below 100: 1e-16·1e4 with a margin.
        prop_assert!((kalman.covariance() - posterior).abs().max() < 1e-11);
        prop_assert!((kalman.state() - state).abs().max() < 1e-11);
        prop_assert!((innovation.variance - (h.dot(&(covariance * h)) + r)).abs() < 1e-12);
        // NEES by an inverse, for all states and for a part of them.
        let truth = [0.3, 0.1, -0.7];
        let error = SVector::from(truth) - kalman.state();
        let expected = error.dot(&(posterior.try_inverse().unwrap() * error));
        prop_assert!((kalman.nees(&truth).unwrap() / expected - 1.0).abs() < 1e-9);
        let first = error[0] * error[0] / posterior[(0, 0)];
        prop_assert!((kalman.nees(&truth[..1]).unwrap() / first - 1.0).abs() < 1e-9);
    }
}

#[test]
fn update_without_gradient_changes_nothing() {
    let before = Kalman::new(vector![1.0, 2.0], matrix![2.0, 0.3; 0.3, 1.0]).unwrap();
    let mut after = before;
    let innovation = after.update(1e6, 0.0, &vector![0.0, 0.0], 0.5).unwrap();
    assert_eq!(before, after);
    assert_eq!(innovation.variance, 0.5);
}

#[test]
fn invalid_noise_is_rejected_and_changes_nothing() {
    let before = Kalman::new(vector![1.0, 2.0], SMatrix::identity()).unwrap();
    let mut after = before;
    for noise in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = after.update(1.0, 0.0, &vector![1.0, 0.0], noise);
        assert!(
            matches!(error, Err(EstimateError::Variance { .. })),
            "{error:?}"
        );
    }
    let error = after.update(f64::NAN, 0.0, &vector![1.0, 0.0], 1.0);
    assert!(
        matches!(error, Err(EstimateError::Value { .. })),
        "{error:?}"
    );
    assert_eq!(before, after);
    let singular = Kalman::new(vector![0.0, 0.0], SMatrix::zeros()).unwrap();
    assert_eq!(
        singular.nees(&[1.0]),
        Err(EstimateError::SingularCovariance { count: 1 })
    );
    assert!(singular.nees(&[]).is_err() && singular.nees(&[0.0; 3]).is_err());
    assert!(Kalman::new(vector![0.0], matrix![-1.0]).is_err());
    assert!(Kalman::new(vector![f64::NAN], matrix![1.0]).is_err());
}
