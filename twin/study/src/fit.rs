//! A straight line through points, by least squares.

/// A line, and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fit {
    pub(crate) slope: f64,
    /// The square of the correlation: 1 where all points are on the line.
    straight: f64,
    /// Mean distance of the points from their middle over its mean square: what an error of theirs does to the slope.
    lever: f64,
}

/// So much of the spread of points has to be that of a line.
const ON_A_LINE: f64 = 0.8;
/// Fewer points are on a line anyway.
const LEAST_POINTS: usize = 3;

/// Slopes that can be orders. A method that is consistent is of first order at least, and few are above fifth: what falls by
/// less than halfway between the square root of the step and the step levels off at something that no step removes, and what
/// falls by more than an order above the highest comes out of saturation.
const ORDERS: std::ops::RangeInclusive<f64> = 0.75..=6.0;

/// Why a slope is no order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoOrder {
    TooFewPoints,
    NoLine,
    NoMethods,
}

impl NoOrder {
    /// In words, for a caption.
    pub(crate) fn about(self) -> &'static str {
        match self {
            Self::TooFewPoints => "too few points",
            Self::NoLine => "its points lie on no line",
            Self::NoMethods => "it levels off or breaks down",
        }
    }
}

/// The order that errors over steps, both as logarithms, show.
///
/// # Errors
/// Why they show none.
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
    /// Through at least three points that are not one above the other.
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

    /// The slope, where the points are on a line.
    pub(crate) fn slope_if_straight(&self) -> Option<f64> {
        (self.straight > ON_A_LINE).then_some(self.slope)
    }

    /// How far the slope can be off if each point may be higher by anything up to `unsure`: all of one side are, and none of the
    /// other.
    pub(crate) fn unsure(&self, unsure: f64) -> f64 {
        0.5 * unsure * self.lever
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_line_is_found_and_a_cloud_is_none() {
        let fit = Fit::through(&[(0.0, 1.0), (1.0, -1.0), (3.0, -5.0)]).unwrap();
        assert!((fit.slope + 2.0).abs() < 1e-12);
        assert!(fit.slope_if_straight().is_some());
        let cloud = Fit::through(&[(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.1)]).unwrap();
        assert_eq!(cloud.slope_if_straight(), None);
        assert_eq!(Fit::through(&[(0.0, 1.0), (1.0, 1.0)]), None);
        assert_eq!(Fit::through(&[(1.0, 0.0), (1.0, 1.0), (1.0, 2.0)]), None);
    }

    #[test]
    fn only_a_slope_that_a_method_can_have_is_an_order() {
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
        fn no_error_of_the_points_moves_the_slope_by_more_than_is_said(
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
