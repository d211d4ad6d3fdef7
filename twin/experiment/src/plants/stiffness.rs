//! Dependence of the largest stable step on the stiffness of the springs.

use serde::Serialize;
use twinrig_rig::PlantId;

use crate::fit::Fit;
use crate::plants::factor::Factor;
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::{Study, StudyKind};

/// Largest stable step of a method as a function of the stiffness of the springs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StiffnessTrend {
    /// Plant.
    #[serde(flatten)]
    pub plant: PlantId,
    /// Method.
    pub method: String,
    /// Number of stiffnesses with a limit.
    pub limits: usize,
    /// Number of stiffnesses at which the longest tried step is stable.
    pub unlimited: usize,
    /// Number of stiffnesses without a stable step or with a search that ended early.
    pub unknown: usize,
    /// Smallest limit \[s\].
    pub least_step_s: Option<f64>,
    /// Greatest limit \[s\].
    pub greatest_step_s: Option<f64>,
    /// Exponent of the power law limit ∝ stiffness^exponent, by least squares over the logarithms.
    pub exponent: Option<f64>,
    /// Greatest magnitude of an exponent that is not significant.
    pub none_below: Option<f64>,
    /// Whether the limits follow a power law.
    pub is_power: Option<bool>,
    /// Widest range of stiffness over which the limits agree to within the resolution of the
    /// search, if it spans a factor of ten.
    pub same_over: Option<[f64; 2]>,
    /// Whether the limit depends on stiffness: the exponent is significant, or the spread of the
    /// limits exceeds that of any insignificant exponent. `None` with too few limits.
    pub depends: Option<bool>,
}

/// Least significant exponent. Springs limit a step by their frequency, with exponent −½, or by
/// their damping, with exponent −1; a tenth of the smaller magnitude counts as no dependence: over
/// a hundredfold stiffness such a limit changes by a quarter.
const NO_EXPONENT: f64 = 0.05;

impl Study {
    /// Returns the stiffness trends of the fixed-step methods, if stiffness was varied.
    pub fn stiffnesses(&self) -> Vec<StiffnessTrend> {
        if self.kind != StudyKind::Stability {
            return Vec::new();
        }
        let series = self.series().into_iter().filter(|key| !key.is_adaptive());
        series
            .filter_map(|key| {
                let rows = self.rows.iter().filter(|row| row.series() == key);
                let rows = rows.filter(|row| row.kind == RowKind::Stability);
                let rows = rows.filter_map(|row| Some((Factor::Stiffness.of(&row.scales)?, row)));
                let rows: Vec<(f64, &Row)> = rows.collect();
                (rows.len() > 1).then(|| trend(key.plant, key.method, &rows))
            })
            .collect()
    }
}

fn trend(plant: &PlantId, method: &str, rows: &[(f64, &Row)]) -> StiffnessTrend {
    let stable = |row: &Row| {
        row.largest_stable_step_s
            .filter(|_| row.status == Status::Ok)
    };
    // The limit lies between the longest stable and the shortest unstable step.
    let limits = rows.iter().filter_map(|&(stiffness, row)| {
        Some((stiffness, stable(row)?, row.least_unstable_step_s?))
    });
    let limits: Vec<(f64, f64, f64)> = limits.collect();
    let found = |(_, row): &&(f64, &Row)| stable(row).is_some();
    let known = rows.iter().filter(found).count();
    let points = limits.iter();
    let points = points.map(|&(stiffness, step, _)| (libm::log(stiffness), libm::log(step)));
    let fit = Fit::through(&points.collect::<Vec<_>>());
    let unsure = limits
        .iter()
        .map(|&(_, step, above)| libm::log(above / step));
    let unsure = unsure.fold(0.0, f64::max);
    let none_below = fit.map(|fit| NO_EXPONENT + fit.unsure(unsure));
    // A non-monotonic limit can have a zero exponent and still depend on stiffness.
    let spread = |of: fn(&(f64, f64, f64)) -> f64| {
        let logarithms = || limits.iter().map(|limit| libm::log(of(limit)));
        logarithms().fold(f64::NEG_INFINITY, f64::max) - logarithms().fold(f64::INFINITY, f64::min)
    };
    let depends = fit.zip(none_below).map(|(fit, bound)| {
        let within = bound * spread(|limit| limit.0) + unsure;
        fit.slope.abs() > bound || spread(|limit| limit.1) > within
    });
    let steps = || limits.iter().map(|&(_, step, _)| step);
    StiffnessTrend {
        plant: plant.clone(),
        method: method.to_owned(),
        limits: limits.len(),
        unlimited: known - limits.len(),
        unknown: rows.len() - known,
        least_step_s: steps().min_by(f64::total_cmp),
        greatest_step_s: steps().max_by(f64::total_cmp),
        exponent: fit.map(|fit| fit.slope),
        none_below,
        is_power: fit.map(|fit| fit.slope_if_straight().is_some()),
        same_over: same_over(&limits, unsure),
        depends,
    }
}

/// Returns the widest range of stiffness over which the logarithms of the limits differ by at most
/// `unsure`.
fn same_over(limits: &[(f64, f64, f64)], unsure: f64) -> Option<[f64; 2]> {
    /// Least width of a significant range.
    const WIDE: f64 = 10.0;
    let mut sorted: Vec<(f64, f64)> = limits.iter().map(|limit| (limit.0, limit.1)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let runs =
        (0..sorted.len()).flat_map(|from| (from + 2..sorted.len()).map(move |to| (from, to)));
    let same = runs.filter(|&(from, to)| {
        let steps = || sorted[from..=to].iter().map(|limit| limit.1);
        let (least, most) = (
            steps().fold(f64::INFINITY, f64::min),
            steps().fold(0.0, f64::max),
        );
        libm::log(most / least) <= unsure
    });
    let ranges = same.map(|(from, to)| [sorted[from].0, sorted[to].0]);
    let widest = ranges.max_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])));
    widest.filter(|[from, to]| to / from >= WIDE * (1.0 - 1e-9))
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::SimDuration;

    use super::*;
    use twinrig_rig::{MethodSetting, Variant};

    /// Returns the trend of limits \[ms\] at stiffnesses.
    fn of(limits: &[(f64, f64)]) -> StiffnessTrend {
        let rows: Vec<Row> = limits
            .iter()
            .map(|&(stiffness, limit)| {
                let variant = Variant {
                    plant: PlantId::new(""),
                    method: String::new(),
                    setting: MethodSetting::Step(SimDuration::from_millis(1)),
                    scales: Factor::Stiffness.scales(stiffness),
                };
                let mut row = Row::new(RowKind::Stability, &variant);
                row.largest_stable_step_s = Some(1e-3 * limit);
                row.least_unstable_step_s = Some(1.04e-3 * limit);
                row
            })
            .collect();
        let stiffnesses = limits.iter().map(|limit| limit.0);
        trend(
            &PlantId::new(""),
            "",
            &stiffnesses.zip(&rows).collect::<Vec<_>>(),
        )
    }

    #[test]
    fn non_monotonic_limit_depends_on_stiffness_despite_zero_exponent() {
        let trend = of(&[(0.01, 24.0), (1.0, 6.0), (100.0, 24.0)]);
        assert!(trend.exponent.unwrap().abs() < 1e-9, "{trend:?}");
        assert_eq!((trend.depends, trend.is_power), (Some(true), Some(false)));
    }

    #[test]
    fn limit_within_search_resolution_is_independent_of_stiffness() {
        let trend = of(&[(0.01, 0.8), (1.0, 0.82), (100.0, 0.79)]);
        assert_eq!(trend.depends, Some(false));
        let falls = of(&[(0.01, 8.0), (1.0, 0.8), (100.0, 0.08)]);
        assert!((falls.exponent.unwrap() + 0.5).abs() < 1e-9);
        assert_eq!((falls.depends, falls.is_power), (Some(true), Some(true)));
        assert_eq!(of(&[(0.01, 8.0), (1.0, 0.8)]).depends, None);
        assert_eq!(
            (trend.same_over, falls.same_over),
            (Some([0.01, 100.0]), None)
        );
    }

    #[test]
    fn constant_range_is_found_below_a_spring_limited_range() {
        let trend = of(&[
            (0.01, 0.8),
            (0.1, 0.8),
            (10.0, 0.81),
            (100.0, 0.6),
            (1000.0, 0.2),
        ]);
        assert_eq!(
            (trend.depends, trend.same_over),
            (Some(true), Some([0.01, 10.0]))
        );
    }
}
