//! Intervals by the profile likelihood.

use super::{Failure, Information, LeastSquares, Minimum, Residuals};

/// 95 % quantile of χ² with one degree of freedom.
const CHI_SQUARE_95: f64 = 3.841_459;
/// Relative accuracy of a bound, in the root of the excess of the cost.
const ACCURACY: f64 = 0.02;
/// Points of a profile to either side.
const POINTS: usize = 8;
/// Steps of least squares for each of them.
const STEPS: usize = 10;
/// First distance where the covariance does not tell one, as a share of the range.
const DISTANCE: f64 = 0.05;

impl LeastSquares {
    /// Returns the interval of a parameter in which the least cost over all other parameters
    /// exceeds the minimum by no more than a confidence of 95 % allows, in shares of the ranges. A
    /// bound is none where the profile stays below that up to the end of the range.
    ///
    /// # Errors
    /// [`Failure`] where the model has no result, and after an interrupt.
    pub fn profile(
        &self,
        model: &dyn Residuals,
        minimum: &Minimum,
        information: &Information,
        parameter: usize,
    ) -> Result<[Option<f64>; 2], Failure> {
        let spread = information.variance * information.correlation_time;
        let allowed = (0.5 * CHI_SQUARE_95 * spread).sqrt();
        let deviation = information.deviation(parameter);
        let first = if deviation.is_finite() && deviation > 0.0 {
            CHI_SQUARE_95.sqrt() * deviation
        } else {
            DISTANCE
        };
        let profile = Profile {
            settings: Self {
                iterations: STEPS,
                ..*self
            },
            model,
            minimum,
            parameter,
        };
        let low = profile.bound(-1.0, first, allowed)?;
        let high = profile.bound(1.0, first, allowed)?;
        Ok([low, high])
    }
}

/// Profile of the cost over a parameter.
struct Profile<'m> {
    settings: LeastSquares,
    model: &'m dyn Residuals,
    minimum: &'m Minimum,
    parameter: usize,
}

impl Profile<'_> {
    /// Returns where the root of the excess, which is linear for a linear model, has the allowed
    /// value, by the secant method with a bracket.
    fn bound(&self, side: f64, first: f64, allowed: f64) -> Result<Option<f64>, Failure> {
        let centre = self.minimum.point[self.parameter];
        let reach = if side > 0.0 { 1.0 - centre } else { centre };
        let (mut below, mut above) = ([0.0, 0.0], None::<[f64; 2]>);
        let mut distance = first.min(reach);
        let mut others = self.others(&self.minimum.point);
        for _ in 0..POINTS {
            let (excess, least) = self.excess(centre + side * distance, &others)?;
            if (excess - allowed).abs() < ACCURACY * allowed {
                return Ok(Some(centre + side * distance));
            }
            if excess > allowed {
                above = Some([distance, excess]);
            } else if distance >= reach {
                return Ok(None);
            } else {
                (below, others) = ([distance, excess], least);
            }
            distance = if let Some([far, high]) = above {
                let [near, low] = below;
                // Not nearer to an end than a tenth of the bracket.
                let share = ((allowed - low) / (high - low)).clamp(0.1, 0.9);
                near + share * (far - near)
            } else {
                let factor = (allowed / excess.max(0.25 * allowed)).clamp(1.1, 4.0);
                (distance * factor).min(reach)
            };
        }
        Ok(above.map(|_| centre + side * distance))
    }

    /// Returns the root of the excess of the least cost where the parameter has a value, and the
    /// other parameters there.
    fn excess(&self, share: f64, others: &[f64]) -> Result<(f64, Vec<f64>), Failure> {
        let whole = |others: &[f64]| {
            let mut point = others.to_vec();
            point.insert(self.parameter, share.clamp(0.0, 1.0));
            point
        };
        if others.is_empty() {
            let residuals = self.model.at(&whole(&[])).ok_or(Failure::Start)?;
            return Ok((self.root(self.settings.cost(&residuals)), Vec::new()));
        }
        let model = |others: &[f64]| self.model.at(&whole(others));
        let steps = self.others(&self.minimum.jacobian.steps);
        let settings = &self.settings;
        let least = settings.minimise_by(&model, others, Some(&steps), &mut |_| true)?;
        Ok((self.root(least.cost), least.point))
    }

    fn root(&self, cost: f64) -> f64 {
        (cost - self.minimum.cost).max(0.0).sqrt()
    }

    fn others(&self, values: &[f64]) -> Vec<f64> {
        let mut others = values.to_vec();
        others.remove(self.parameter);
        others
    }
}
