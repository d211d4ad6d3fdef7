//! Least-squares fit of a straight line.

/// Fitted line and its goodness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fit {
    pub(crate) slope: f64,
    /// Squared correlation coefficient; 1 if all points are on the line.
    straight: f64,
    /// Mean absolute deviation of x over its variance: sensitivity of the slope to errors of y.
    lever: f64,
}

/// Least squared correlation of a straight line.
const ON_A_LINE: f64 = 0.8;
/// Least number of points; fewer always fit a line.
const LEAST_POINTS: usize = 3;

/// Slopes that are plausible orders. A consistent method has at least order 1, and few exceed 5:
/// below 0.75, between the square root of the step and the step, the error levels off at a part
/// that no step size removes; above 6, it comes out of saturation.
const ORDERS: std::ops::RangeInclusive<f64> = 0.75..=6.0;

/// Reason why a slope is not an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoOrder {
    TooFewPoints,
    NoLine,
    NoMethods,
}

impl NoOrder {
    /// Returns a description for a caption.
    pub(crate) fn about(self) -> &'static str {
        match self {
            Self::TooFewPoints => "too few points",
            Self::NoLine => "its points are not on a line",
            Self::NoMethods => "it levels off or breaks down",
        }
    }
}

/// Returns the order of convergence from points (log step, log error).
///
/// # Errors
/// The reason why the points show no order.
pub(crate) fn order(points: &[(f64, f64)]) -> Result<f64, NoOrder> {
    let fit = Fit::through(points).ok_or(NoOrder::TooFewPoints)?;
    let slope = fit.slope_if_straight().ok_or(NoOrder::NoLine)?;
    if ORDERS.contains(&slope) {
        Ok(slope)
    } else {
        Err(NoOrder::NoMethods)
    }
}

impl Fit {
    /// Fits a line; `None` for fewer than three points or for equal x.
    pub(crate) fn through(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < LEAST_POINTS {
            return None;
        }
        let count = points.len() as f64;
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
        let xx = mean(&|point| (point.0 - x) * (point.0 - x));
        let xy = mean(&|point| (point.0 - x) * (point.1 - y));
        let yy = mean(&|point| (point.1 - y) * (point.1 - y));
        (xx > 0.0).then(|| Self {
            slope: xy / xx,
            straight: if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 },
            lever: mean(&|point| (point.0 - x).abs()) / xx,
        })
    }

    /// Returns the slope if the points lie on a line.
    pub(crate) fn slope_if_straight(&self) -> Option<f64> {
        (self.straight > ON_A_LINE).then_some(self.slope)
    }

    /// Returns the squared correlation coefficient: 1 if all points are on the line.
    pub(crate) fn straightness(&self) -> f64 {
        self.straight
    }

    /// Returns the greatest error of the slope if each y may be too small by up to `unsure`: in the
    /// worst case all points on one side of the mean are and the others are not.
    pub(crate) fn unsure(&self, unsure: f64) -> f64 {
        0.5 * unsure * self.lever
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn collinear_points_are_fitted_and_scattered_ones_rejected() {
        let fit = Fit::through(&[(0.0, 1.0), (1.0, -1.0), (3.0, -5.0)]).unwrap();
        assert!((fit.slope + 2.0).abs() < 1e-12);
        assert!(fit.slope_if_straight().is_some());
        let cloud = Fit::through(&[(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.1)]).unwrap();
        assert_eq!(cloud.slope_if_straight(), None);
        assert_eq!(Fit::through(&[(0.0, 1.0), (1.0, 1.0)]), None);
        assert_eq!(Fit::through(&[(1.0, 0.0), (1.0, 1.0), (1.0, 2.0)]), None);
    }

    #[test]
    fn only_plausible_slopes_are_orders() {
        let on = |slope: f64| [0.0, 1.0, 2.0].map(|x| (x, slope * x - 3.0));
        for slope in [1.0, 2.0, 4.0, 5.0] {
            // Rounding of a sum of few numbers near one.
            assert!((order(&on(slope)).unwrap() - slope).abs() < 1e-12);
        }
        for slope in [-0.2, 0.1, 0.5, 9.0] {
            assert_eq!(order(&on(slope)), Err(NoOrder::NoMethods));
        }
        assert_eq!(order(&on(1.0)[..2]), Err(NoOrder::TooFewPoints));
        let cloud = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.1)];
        assert_eq!(order(&cloud), Err(NoOrder::NoLine));
    }

    proptest! {
        #[test]
        fn slope_error_is_within_its_bound(
            xs in prop::collection::vec(-5.0_f64..5.0, 3..9),
            errors in prop::collection::vec(0.0_f64..1.0, 9),
        ) {
            let exact: Vec<_> = xs.iter().map(|&x| (x, 0.7 * x)).collect();
            prop_assume!(Fit::through(&exact).is_some());
            let off = exact.iter().zip(&errors).map(|(&(x, y), error)| (x, y + error));
            let off: Vec<_> = off.collect();
            let fit = Fit::through(&off).unwrap();
            // Rounding of a sum of few numbers near one.
            prop_assert!((fit.slope - 0.7).abs() <= fit.unsure(1.0) * (1.0 + 1e-9) + 1e-9);
        }
    }
}
