//! Proportionality of error to tolerance.

use serde::Serialize;
use twinrig_rig::PlantId;

use crate::fit::Fit;
use crate::plants::row::{Row, RowKind, Series, Status};
use crate::plants::study::{Study, StudyKind};

/// Tolerances over which slopes are fitted: looser ones saturate, tighter ones reach the floor.
const RANGE: [f64; 2] = [1e-8, 1e-5];

/// Slope of log error over log tolerance of an error-controlled method: 1 where the error is
/// proportional to the tolerance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToleranceSlope {
    /// Plant.
    #[serde(flatten)]
    pub plant: PlantId,
    /// Method.
    pub method: String,
    /// Slope with the RMS error of the feet, by least squares.
    pub feet: f64,
    /// Slope with the RMS error of the trunk.
    pub trunk: Option<f64>,
    /// Slope with the RMS error of the worst foot relative to its hip.
    pub foot_to_hip: Option<f64>,
    /// Number of tolerances used.
    pub points: usize,
    /// Tightest and loosest tolerance used.
    pub range: [f64; 2],
}

impl Study {
    /// Returns the slopes of the error-controlled methods with at least three tolerances between
    /// 1e-8 and 1e-5 whose error is above the floor of the reference.
    pub fn tolerance_slopes(&self) -> Vec<ToleranceSlope> {
        if self.kind != StudyKind::Precision {
            return Vec::new();
        }
        let series = self.series().into_iter().filter(Series::is_adaptive);
        series.filter_map(|key| self.tolerance_slope(key)).collect()
    }

    fn tolerance_slope(&self, key: Series<'_>) -> Option<ToleranceSlope> {
        let rows = self.rows.iter().filter(|row| {
            row.kind == RowKind::Integration && row.status == Status::Ok && row.series() == key
        });
        let known = rows.filter_map(|row| {
            let tolerance = row.tolerance?;
            // The nominal ends of the range are part of it.
            let inside = (RANGE[0] * (1.0 - 1e-9)..=RANGE[1] * (1.0 + 1e-9)).contains(&tolerance);
            (inside && !row.at_floor && row.error_rms_m? > 0.0).then_some((tolerance, row))
        });
        let known: Vec<(f64, &Row)> = known.collect();
        let slope = |error: fn(&Row) -> Option<f64>| {
            let points = known.iter().filter_map(|&(tolerance, row)| {
                let error = error(row).filter(|&error| error > 0.0)?;
                Some((libm::log(tolerance), libm::log(error)))
            });
            Some(Fit::through(&points.collect::<Vec<_>>())?.slope)
        };
        let tolerances = || known.iter().map(|point| point.0);
        Some(ToleranceSlope {
            plant: key.plant.clone(),
            method: key.method.to_owned(),
            feet: slope(|row| row.error_rms_m)?,
            trunk: slope(|row| row.trunk_error_rms_m),
            foot_to_hip: slope(|row| row.foot_to_hip_error_rms_m),
            points: known.len(),
            range: [
                tolerances().fold(f64::INFINITY, f64::min),
                tolerances().fold(0.0, f64::max),
            ],
        })
    }

    /// Records the slopes in the rows of their series.
    pub(crate) fn note_tolerance_slopes(&mut self) {
        for slope in self.tolerance_slopes() {
            let rows = self.rows.iter_mut().filter(|row| {
                row.kind == RowKind::Integration
                    && row.tolerance.is_some()
                    && (&row.plant, &row.method) == (&slope.plant, &slope.method)
            });
            for row in rows {
                row.tolerance_slope = Some(slope.feet);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plants::dominance_tests::{row, study};

    /// Returns the rows of a method whose errors are `of` the tolerance.
    fn rows(of: impl Fn(f64) -> f64) -> Vec<Row> {
        let tolerances = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
        let row = |tolerance| {
            let mut row = row("full", 1000, of(tolerance), 1.0);
            row.step_s = None;
            row.tolerance = Some(tolerance);
            row.trunk_error_rms_m = Some(tolerance);
            row
        };
        tolerances.map(row).into()
    }

    #[test]
    fn slope_is_that_of_the_tolerances_in_range() {
        // Saturated above 1e-5, and level below 1e-8.
        let mut study = study(rows(|tolerance| {
            libm::pow(tolerance.clamp(1e-8, 1e-5), 0.8)
        }));
        let [slope] = &study.tolerance_slopes()[..] else {
            panic!("{:?}", study.tolerance_slopes());
        };
        assert!((slope.feet - 0.8).abs() < 1e-12, "{slope:?}");
        assert!((slope.trunk.unwrap() - 1.0).abs() < 1e-12, "{slope:?}");
        assert_eq!((slope.foot_to_hip, slope.points), (None, 4));
        assert_eq!(slope.range, RANGE);
        let feet = slope.feet;
        study.note_tolerance_slopes();
        assert!(
            study
                .rows
                .iter()
                .all(|row| row.tolerance_slope == Some(feet))
        );
    }

    #[test]
    fn errors_at_the_floor_and_failed_runs_are_not_fitted() {
        let mut rows = rows(|tolerance| tolerance);
        rows[4].at_floor = true;
        rows[4].error_rms_m = Some(1.0);
        let slope = &study(rows.clone()).tolerance_slopes()[0];
        assert!(
            (slope.feet - 1.0).abs() < 1e-12 && slope.points == 3,
            "{slope:?}"
        );
        rows[3].status = Status::Failed;
        assert!(study(rows).tolerance_slopes().is_empty());
    }
}
