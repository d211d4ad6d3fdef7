//! Whether the limit of a method is that of the springs.

use serde::Serialize;

use crate::fit::Fit;
use crate::row::{Row, RowKind, Status};
use crate::study::{Study, StudyKind};
use crate::sweep::Factor;

/// How the largest stable step of a method goes with the stiffness of the springs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StiffnessTrend {
    /// Its plant.
    pub plant: String,
    /// Its name.
    pub method: String,
    /// Stiffnesses at which a limit was found.
    pub limits: usize,
    /// Stiffnesses at which the longest step that was tried is stable.
    pub unlimited: usize,
    /// Stiffnesses at which nothing stable was found, or the search came to no end.
    pub unknown: usize,
    /// The least limit \[s\].
    pub least_step_s: Option<f64>,
    /// The greatest \[s\].
    pub greatest_step_s: Option<f64>,
    /// The exponent: the limit goes as stiffness to this power, by least squares over their logarithms.
    pub exponent: Option<f64>,
    /// An exponent no further than this from zero is none.
    pub none_below: Option<f64>,
    /// Whether the limits are on the line of that exponent: where they are not, there is no one power.
    pub is_power: Option<bool>,
    /// The widest range of stiffness over which the limit is the same to within the width of its search, if it spans ten times.
    pub same_over: Option<[f64; 2]>,
    /// Whether the limit depends on stiffness: the exponent is beyond its bound, or limits are further apart than any exponent
    /// within it makes them. None if too few limits were found.
    pub depends: Option<bool>,
}

/// Springs that limit a step do so by their frequency, to the power −½, or by their damping, to the power −1. A tenth of the lesser
/// is no dependence: over a hundredfold stiffness such a limit moves by a quarter.
const NO_EXPONENT: f64 = 0.05;

impl Study {
    /// How the limits of the methods that step go with the stiffness of the springs, if that was varied.
    pub fn stiffnesses(&self) -> Vec<StiffnessTrend> {
        if self.kind != StudyKind::Stability {
            return Vec::new();
        }
        let lines = self.lines().into_iter().filter(|line| !line.is_adaptive());
        lines
            .filter_map(|line| {
                let rows = self.rows.iter().filter(|row| row.line() == line);
                let rows = rows.filter(|row| row.kind == RowKind::Stability);
                let rows = rows.filter_map(|row| Some((Factor::Stiffness.of(&row.scales)?, row)));
                let rows: Vec<(f64, &Row)> = rows.collect();
                (rows.len() > 1).then(|| trend(line.plant, line.method, &rows))
            })
            .collect()
    }
}

fn trend(plant: &str, method: &str, rows: &[(f64, &Row)]) -> StiffnessTrend {
    let stable = |row: &Row| {
        row.largest_stable_step_s
            .filter(|_| row.status == Status::Ok)
    };
    // A limit lies between the longest step that is stable and the shortest that is not.
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
    // What goes up and down again has no exponent, and depends all the same.
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
        plant: plant.to_owned(),
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

/// The widest range of stiffness over which limits are no further apart than `unsure`, in logarithms.
fn same_over(limits: &[(f64, f64, f64)], unsure: f64) -> Option<[f64; 2]> {
    /// A narrower range is too narrow to tell.
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
    use crate::factory::{MethodSetting, Variant};

    /// The trend of limits \[ms\] at stiffnesses.
    fn of(limits: &[(f64, f64)]) -> StiffnessTrend {
        let rows: Vec<Row> = limits
            .iter()
            .map(|&(stiffness, limit)| {
                let variant = Variant {
                    plant: String::new(),
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
        trend("", "", &stiffnesses.zip(&rows).collect::<Vec<_>>())
    }

    #[test]
    fn a_limit_that_goes_down_and_up_again_depends_on_stiffness_though_its_exponent_is_none() {
        let trend = of(&[(0.01, 24.0), (1.0, 6.0), (100.0, 24.0)]);
        assert!(trend.exponent.unwrap().abs() < 1e-9, "{trend:?}");
        assert_eq!((trend.depends, trend.is_power), (Some(true), Some(false)));
    }

    #[test]
    fn one_that_stays_within_the_width_of_its_search_does_not() {
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
    fn a_cap_is_told_from_the_springs_that_take_over_where_they_are_stiffer() {
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
