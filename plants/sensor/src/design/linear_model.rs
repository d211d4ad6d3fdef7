//! Linear models of a response.

use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

use super::effect::{Effect, column};
use crate::SensorError;

/// Row of an analysis of variance: an effect of one degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anova {
    /// Effect.
    pub effect: Effect,
    /// Coefficient \[unit of the response\].
    pub coefficient: f64,
    /// Sum of squares that the effect explains; also its mean square \[unit squared\].
    pub sum_of_squares: f64,
    /// Ratio of mean square and residual variance.
    pub f: f64,
    /// Probability of a ratio as large or larger without the effect.
    pub p: f64,
}

/// Linear model of a response, fitted to the sixteen cells by least squares.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearModel {
    /// Constant: the mean of the response \[unit of the response\].
    pub constant: f64,
    /// Effects, in the order given.
    pub effects: Vec<Anova>,
    /// Sum of squared residuals \[unit squared\].
    pub residual: f64,
    /// Degrees of freedom of the residuals.
    pub freedom: u32,
    /// Ratio of mean square of the whole model and residual variance; NaN without effects.
    pub f: f64,
    /// Probability of a ratio as large or larger without any of the effects; NaN without effects.
    pub p: f64,
    /// Coefficient of determination.
    pub r_squared: f64,
}

/// Value with the interval that contains a new observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictionInterval {
    /// Expected value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Number of cells.
const CELLS: f64 = 16.0;

impl LinearModel {
    /// Fits the values of the sixteen cells, in the order of [`CELLS`](super::CELLS).
    ///
    /// The columns of effects that are not aliased are orthogonal, so that the normal equations are
    /// diagonal: a coefficient is the mean of the values with the signs of its column, whatever the
    /// other effects. That holds for the coded factors of the complete design only.
    ///
    /// # Errors
    /// Two effects that the design cannot distinguish; more than fourteen effects, which leave no
    /// degree of freedom.
    pub fn fit(values: &[f64; 16], effects: &[Effect]) -> Result<Self, SensorError> {
        let mut known = vec![Effect::CONSTANT];
        for &effect in effects {
            if let Some(&first) = known.iter().find(|first| first.is_aliased_with(effect)) {
                return Err(SensorError::Aliased {
                    first,
                    second: effect,
                });
            }
            known.push(effect);
        }
        let count = u32::try_from(effects.len()).unwrap_or(u32::MAX);
        let freedom = 15_u32.checked_sub(count).filter(|freedom| *freedom > 0);
        let freedom = freedom.ok_or(SensorError::NoResidual { effects: count })?;
        let constant = values.iter().sum::<f64>() / CELLS;
        let mut residuals = values.map(|value| value - constant);
        let total: f64 = residuals.iter().map(|residual| residual * residual).sum();
        let mut rows = Vec::with_capacity(effects.len());
        for &effect in effects {
            let column = column(effect);
            let products = column.iter().zip(values).map(|(sign, value)| sign * value);
            let coefficient = products.sum::<f64>() / CELLS;
            for (residual, sign) in residuals.iter_mut().zip(column) {
                *residual -= coefficient * sign;
            }
            rows.push((effect, coefficient));
        }
        let residual: f64 = residuals.iter().map(|residual| residual * residual).sum();
        let variance = residual / f64::from(freedom);
        let row = |(effect, coefficient): (Effect, f64)| {
            let sum_of_squares = CELLS * coefficient * coefficient;
            let f = sum_of_squares / variance;
            Anova {
                effect,
                coefficient,
                sum_of_squares,
                f,
                p: exceedance(f, 1, freedom),
            }
        };
        let effects: Vec<Anova> = rows.into_iter().map(row).collect();
        let explained: f64 = effects.iter().map(|row| row.sum_of_squares).sum();
        let f = explained / f64::from(count) / variance;
        Ok(Self {
            constant,
            effects,
            residual,
            freedom,
            f,
            p: exceedance(f, count, freedom),
            r_squared: 1.0 - residual / total,
        })
    }

    /// Variance of the residuals \[unit squared\].
    pub fn variance(&self) -> f64 {
        self.residual / f64::from(self.freedom)
    }

    /// Expected value at coded factors, each effect replaced by `reading` of it.
    pub(super) fn value(&self, coded: &[f64; 5], reading: impl Fn(Effect) -> (Effect, f64)) -> f64 {
        self.effects.iter().fold(self.constant, |sum, row| {
            let (effect, sign) = reading(row.effect);
            sum + row.coefficient * sign * effect.value(coded)
        })
    }

    /// Predicts a new observation at coded factors, with the interval that contains it with the
    /// probability `coverage`: ± t s √(1 + x′(X′X)⁻¹x) with the quantile t of Student's
    /// distribution, the residuals' standard deviation s and the effects' values x. X′X is 16 times
    /// the identity.
    pub fn predict(&self, coded: &[f64; 5], coverage: f64) -> PredictionInterval {
        let squares = self.effects.iter().map(|row| {
            let value = row.effect.value(coded);
            value * value
        });
        let leverage = (1.0 + squares.sum::<f64>()) / CELLS;
        let deviation = (self.variance() * (1.0 + leverage)).sqrt();
        let student = StudentsT::new(0.0, 1.0, f64::from(self.freedom));
        let quantile = student.map_or(f64::NAN, |student| {
            student.inverse_cdf(0.5 + 0.5 * coverage)
        });
        let value = self.value(coded, |effect| (effect, 1.0));
        PredictionInterval {
            value,
            low: value - quantile * deviation,
            high: value + quantile * deviation,
        }
    }
}

/// Probability that a ratio with Fisher's distribution exceeds `f`; NaN without degrees of freedom.
fn exceedance(f: f64, upper: u32, lower: u32) -> f64 {
    let fisher = FisherSnedecor::new(f64::from(upper), f64::from(lower));
    fisher.map_or(f64::NAN, |fisher| fisher.sf(f))
}
