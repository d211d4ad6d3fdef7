//! Intervals by the profile likelihood.

use twinrig_runtime::interrupt;

use super::{Failure, Information, LeastSquares, Minimum, Residuals};

/// 95 % quantile of χ² with one degree of freedom.
const CHI_SQUARE_95: f64 = 3.841_459;
/// Relative accuracy of a bound, in the root of the excess of the cost.
const ACCURACY: f64 = 0.02;
/// Points of a profile to either side before it is tried at the end of the range; then as many to
/// find the bound.
const POINTS: usize = 8;
/// First distance where the covariance does not tell one, as a share of the range.
const DISTANCE: f64 = 0.05;

/// Interval of a parameter by the profile likelihood.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileInterval {
    /// Lower and upper bound, as shares of the range; none where the range ends before.
    pub bounds: [Option<f64>; 2],
    /// Least cost on the profile. One below that of the minimum shows that this is a local one.
    pub least_cost: f64,
    /// Its point.
    pub least: Vec<f64>,
}

impl LeastSquares {
    /// Returns the interval of a parameter in which the least cost over all other parameters
    /// exceeds the minimum by no more than a confidence of 95 % allows.
    ///
    /// # Errors
    /// [`Failure`] where the model has no result, and after an interrupt.
    pub fn profile(
        &self,
        model: &dyn Residuals,
        minimum: &Minimum,
        information: &Information,
        parameter: usize,
    ) -> Result<ProfileInterval, Failure> {
        let deviation = information.deviation(parameter);
        let mut profile = Profile {
            settings: self,
            model,
            minimum,
            parameter,
            allowed: (0.5 * CHI_SQUARE_95 * information.spread()).sqrt(),
            least_cost: minimum.cost,
            least: minimum.point.clone(),
        };
        let first = if deviation.is_finite() && deviation > 0.0 {
            CHI_SQUARE_95.sqrt() * deviation
        } else {
            DISTANCE
        };
        let bounds = [profile.bound(-1.0, first)?, profile.bound(1.0, first)?];
        Ok(ProfileInterval {
            bounds,
            least_cost: profile.least_cost,
            least: profile.least,
        })
    }
}

/// Profile of the cost over a parameter.
struct Profile<'m> {
    settings: &'m LeastSquares,
    model: &'m dyn Residuals,
    minimum: &'m Minimum,
    parameter: usize,
    /// Allowed root of the excess of the cost.
    allowed: f64,
    least_cost: f64,
    least: Vec<f64>,
}

impl Profile<'_> {
    /// Returns where the root of the excess, which is linear for a linear model, has the allowed
    /// value, by the secant method with a bracket.
    fn bound(&mut self, side: f64, first: f64) -> Result<Option<f64>, Failure> {
        let (centre, allowed) = (self.minimum.point[self.parameter], self.allowed);
        let reach = if side > 0.0 { 1.0 - centre } else { centre };
        let (mut below, mut above) = ([0.0, 0.0], None::<[f64; 2]>);
        let mut distance = first.min(reach);
        let mut others = self.others(&self.minimum.point);
        for point in 0..2 * POINTS {
            let (excess, least) = self.excess(centre + side * distance, &others)?;
            if (excess - allowed).abs() < ACCURACY * allowed {
                break;
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
            } else if point + 1 >= POINTS {
                reach
            } else {
                let factor = (allowed / excess.max(0.25 * allowed)).clamp(1.5, 4.0);
                (distance * factor).min(reach)
            };
        }
        Ok(Some(centre + side * distance))
    }

    /// Returns the root of the excess of the least cost where the parameter has a value, and the
    /// other parameters there.
    fn excess(&mut self, share: f64, others: &[f64]) -> Result<(f64, Vec<f64>), Failure> {
        let (parameter, model) = (self.parameter, self.model);
        let whole = |others: &[f64]| {
            let mut point = others.to_vec();
            point.insert(parameter, share.clamp(0.0, 1.0));
            point
        };
        let (cost, others) = if others.is_empty() {
            let residuals = model.at(&whole(&[]));
            if interrupt::is_requested() {
                return Err(Failure::Interrupted(0));
            }
            let cost = self.settings.cost(&residuals.ok_or(Failure::Start)?);
            (cost, Vec::new())
        } else {
            let model = |others: &[f64]| model.at(&whole(others));
            let steps = self.others(&self.minimum.jacobian.steps);
            let settings = self.settings;
            let least = settings.minimise_by(&model, others, Some(&steps), &mut |_| true)?;
            (least.cost, least.point)
        };
        if cost < self.least_cost {
            (self.least_cost, self.least) = (cost, whole(&others));
        }
        Ok(((cost - self.minimum.cost).max(0.0).sqrt(), others))
    }

    fn others(&self, values: &[f64]) -> Vec<f64> {
        let mut others = values.to_vec();
        others.remove(self.parameter);
        others
    }
}
