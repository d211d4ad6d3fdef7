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
    /// Whether the limit depends on stiffness; none if too few limits were found.
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
        depends: fit
            .zip(none_below)
            .map(|(fit, bound)| fit.slope.abs() > bound),
    }
}
