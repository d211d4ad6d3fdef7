//! Screening by elementary effects (Morris 1991): effects of the runs of a design.
//!
//! Each dimension has `levels` values at equal distances, from 0 to 1 of its interval. A trajectory
//! begins at random values and changes each dimension once, in random order, by
//! Δ = levels / (2 (levels − 1)). The change of a measured value over Δ is an elementary effect.

use serde::Serialize;

use super::result::SweepResult;
use super::row::RowVerdict;
use super::summary::{ExpectationSummary, RowSummary};

/// Name of the measure that counts the expectations of a run that do not hold.
pub const FAILED_EXPECTATIONS: &str = "failed expectations";

/// Elementary effects of a dimension on a measured value. They are changes of the value per whole
/// interval of the dimension: for a linear function, slope times length of the interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ElementaryEffect {
    /// Measured value: name of an expectation, or [`FAILED_EXPECTATIONS`].
    pub measure: String,
    /// Symbol of its unit.
    pub unit: String,
    /// Key of the dimension.
    pub dimension: String,
    /// Their mean.
    pub mu: f64,
    /// Mean of their magnitudes (Campolongo 2007), by which dimensions are ranked.
    pub mu_star: f64,
    /// Standard deviation, of interactions and curvature; none of a single effect.
    pub sigma: Option<f64>,
    /// Their number. Trajectories without the value at one of both points have none.
    pub effects: usize,
}

impl SweepResult {
    /// Returns the elementary effects, by measured value, the greatest `mu_star` first; none of
    /// another design.
    pub fn elementary_effects(&self) -> Vec<ElementaryEffect> {
        let Some(levels) = self.design.levels else {
            return Vec::new();
        };
        let delta = levels as f64 / (2.0 * (levels - 1) as f64);
        let steps = self.steps();
        let of_measure = |name: &str, unit: &str, value: &dyn Fn(&RowSummary) -> Option<f64>| {
            let mut effects = vec![Vec::new(); self.dimensions.len()];
            for (index, rows, sign) in &steps {
                if let [Some(before), Some(after)] = rows.map(value) {
                    effects[*index].push(sign * (after - before) / delta);
                }
            }
            let effects = effects.iter().zip(&self.dimensions);
            let effects = effects.filter(|(effects, _)| !effects.is_empty());
            let mut found: Vec<_> = effects
                .map(|(effects, dimension)| summary(effects, name, unit, &dimension.key))
                .collect();
            found.sort_by(|one, other| other.mu_star.total_cmp(&one.mu_star));
            found
        };
        let mut found = of_measure(FAILED_EXPECTATIONS, "1", &failed);
        for (name, units) in self.expectations() {
            if !self.measures.is_empty() && !self.measures.iter().any(|one| one == name) {
                continue;
            }
            for unit in units {
                found.extend(of_measure(name, unit, &|row| {
                    let one = row.expectation(name).filter(|one| one.unit() == unit);
                    one.and_then(ExpectationSummary::measured)
                }));
            }
        }
        found
    }

    /// Returns pairs of rows that differ in one dimension, with its index and the direction of its
    /// change.
    fn steps(&self) -> Vec<(usize, [&RowSummary; 2], f64)> {
        let pairs = self.rows.windows(2).filter_map(|pair| {
            let [before, after] = pair else {
                return None;
            };
            // Of keys with one value, the first is the dimension's. The first point of a trajectory
            // differs from the one before it in several.
            let differ = |index: &usize| before.point[*index].toml != after.point[*index].toml;
            let index = (0..self.dimensions.len()).find(differ)?;
            let length = self.trajectory_points?;
            let is_step = after.index == before.index + 1 && after.index % length != 0;
            let [one, other] = [before, after].map(|row| row.point[index].number);
            let sign = if other? > one? { 1.0 } else { -1.0 };
            is_step.then_some((index, [&*before.summary, &*after.summary], sign))
        });
        pairs.collect()
    }
}

/// Number of expectations of a run that do not hold; none of a run with an error.
fn failed(row: &RowSummary) -> Option<f64> {
    let failed = row.expectations.iter().filter(|one| !one.holds).count();
    (row.verdict != RowVerdict::Error).then_some(failed as f64)
}

fn summary(effects: &[f64], measure: &str, unit: &str, dimension: &str) -> ElementaryEffect {
    let count = effects.len() as f64;
    let mean = |of: &dyn Fn(f64) -> f64| {
        // From 0, as a sum without terms or of negative zeros is −0.
        effects.iter().fold(0.0, |sum, &one| sum + of(one)) / count
    };
    let mu = mean(&|one| one);
    let variance = mean(&|one| (one - mu) * (one - mu)) * count / (count - 1.0);
    ElementaryEffect {
        measure: measure.to_owned(),
        unit: unit.to_owned(),
        dimension: dimension.to_owned(),
        mu,
        mu_star: mean(&f64::abs),
        sigma: (effects.len() > 1).then(|| variance.sqrt()),
        effects: effects.len(),
    }
}
