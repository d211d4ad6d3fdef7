//! Outliers among the rows of a study of plants.

use twinrig_report::number::{method_setting, si};

use super::factor::Factor;
use super::row::{Row, RowKind, Series, Status};
use super::study::Study;
use crate::outliers::{Neighbour, append_reason, contradicting, contradiction};

impl Row {
    fn contradict(&mut self, neighbours: [Neighbour; 2]) {
        // The unchanged scenario is part of several sweeps.
        if !std::mem::replace(&mut self.contradicts, true) {
            self.why = Some(append_reason(self.why.take(), contradiction(neighbours)));
        }
    }
}

impl Study {
    /// Marks the rows that contradict their neighbours.
    pub(crate) fn mark_contradictions(&mut self) {
        let errors = |study: &Self, of: &dyn Fn(&Row) -> bool| {
            let rows = study.rows.iter().enumerate().filter(|(_, row)| of(row));
            let known = |row: &Row| {
                let error = row.error_rms_m.filter(|_| row.status == Status::Ok)?;
                Some(error.max(study.floor_of(&row.plant)))
            };
            rows.map(|(place, row)| (place, known(row)))
                .unzip::<usize, Option<f64>, Vec<_>, Vec<_>>()
        };
        let all: Vec<Series<'_>> = self.series();
        let mut found = Vec::new();
        let mut consider = |places: &[usize],
                            results: &[Option<f64>],
                            falling,
                            unit,
                            setting: &dyn Fn(&Row) -> String| {
            for (n, neighbours) in contradicting(results, falling) {
                let neighbours = neighbours.map(|n| Neighbour {
                    result: si(results[n].unwrap_or_default(), unit),
                    setting: setting(&self.rows[places[n]]),
                });
                found.push((places[n], neighbours));
            }
        };
        let step = |row: &Row| method_setting(row.step_s, row.tolerance);
        for &series in &all {
            let of_series = |row: &Row| row.kind == RowKind::Integration && row.series() == series;
            let (places, results) = errors(self, &of_series);
            consider(&places, &results, true, "m", &step);
            for factor in Factor::ALL {
                let (places, limits) = self.limits(series, factor);
                let scaled = |row: &Row| factor.label(factor.of(&row.scales).unwrap_or_default());
                let unit = if series.is_adaptive() { "1/s" } else { "s" };
                consider(&places, &limits, false, unit, &scaled);
            }
        }
        let (places, results) = errors(self, &|row| row.kind == RowKind::Limit);
        let segments = |row: &Row| format!("segments × {:e}", row.scales.mass);
        consider(&places, &results, true, "m", &segments);
        for (place, neighbours) in found {
            self.rows[place].contradict(neighbours);
        }
    }

    /// Returns the largest stable steps of a series over the values of a factor, or the evaluations
    /// per time of a method with error control, with the indices of their rows.
    fn limits(&self, series: Series<'_>, factor: Factor) -> (Vec<usize>, Vec<Option<f64>>) {
        let rows = self.rows.iter().enumerate();
        let rows = rows.filter(|(_, row)| row.kind == RowKind::Stability && row.series() == series);
        let limit = |row: &Row| {
            let limit = if series.is_adaptive() {
                row.evaluations_per_s()
            } else {
                row.largest_stable_step_s
            };
            limit.filter(|_| row.status == Status::Ok)
        };
        let mut values: Vec<(f64, usize, Option<f64>)> = rows
            .filter_map(|(place, row)| Some((factor.of(&row.scales)?, place, limit(row))))
            .collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        values
            .into_iter()
            .map(|(_, place, limit)| (place, limit))
            .unzip()
    }
}
