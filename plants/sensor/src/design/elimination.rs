//! Backward elimination.

use super::cells::CellResponse;
use super::effect::Effect;
use super::linear_model::LinearModel;
use crate::SensorError;

/// Greatest p-value of an effect that is kept (section 4.2.2.3).
pub const THRESHOLD: f64 = 0.1;

/// Step of an elimination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Removal {
    /// Removed effect.
    pub effect: Effect,
    /// Its p-value in the model that still had it.
    pub p: f64,
}

/// Backward elimination: from a model with all [estimable](Effect::estimable) effects, the one with
/// the greatest p-value is removed, until none is above the threshold.
///
/// It is not hierarchical: an interaction may stay without its main effects, as in the models of
/// the thesis. A hierarchy would have to know which of two aliased interactions acts.
#[derive(Clone, Debug, PartialEq)]
pub struct Elimination {
    /// Removed effects, in order.
    pub removed: Vec<Removal>,
    /// What remains.
    pub model: LinearModel,
}

impl Elimination {
    /// Eliminates effects on a response until no p-value is above `threshold`.
    ///
    /// # Errors
    /// None: the estimable effects are not aliased and leave three degrees of freedom.
    pub fn of(response: CellResponse, threshold: f64) -> Result<Self, SensorError> {
        let values = response.values();
        let mut effects = Effect::estimable();
        let mut removed = Vec::new();
        loop {
            let model = LinearModel::fit(&values, &effects)?;
            let worst = model.effects.iter().max_by(|a, b| a.p.total_cmp(&b.p));
            let Some(worst) = worst.filter(|row| row.p > threshold) else {
                return Ok(Self { removed, model });
            };
            let (effect, p) = (worst.effect, worst.p);
            removed.push(Removal { effect, p });
            effects.retain(|other| *other != effect);
        }
    }
}
