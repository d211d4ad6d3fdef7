//! Outliers: settings whose results contradict those of the neighbouring settings.
//!
//! The error of a method falls, rises or levels off from setting to setting. A value far above or
//! far below both neighbours is not a property of the method but of the particular run.

use crate::coupling::{CouplingKind, CouplingMethod, CouplingStudy};
use crate::row::{Row, RowKind, Series, Status};
use crate::study::Study;
use crate::sweep::Factor;
use twinrig_report::number::{method_setting, si};

/// Factor by which an outlier lies above or below both neighbours.
const CONTRADICTS: f64 = 10.0;

/// Returns the outliers among results in the order of their settings, each with the indices of its
/// nearest known neighbours. If results should fall from setting to setting (`falling`), the last
/// one is compared with the two before it. The worst outlier is found first and excluded from later
/// comparisons.
fn contradicting(results: &[Option<f64>], falling: bool) -> Vec<(usize, [usize; 2])> {
    let known = results.iter().enumerate();
    let mut known: Vec<(usize, f64)> = known
        .filter_map(|(n, result)| Some((n, (*result)?)))
        .collect();
    let mut found = Vec::new();
    while let Some((at, neighbours)) = worst(&known, falling) {
        found.push((known.remove(at).0, neighbours));
    }
    found.sort_by_key(|(place, _)| *place);
    found
}

/// Returns the worst outlier, by its place in `known`, and the indices of its neighbours.
fn worst(known: &[(usize, f64)], falling: bool) -> Option<(usize, [usize; 2])> {
    let mut worst: Option<(f64, usize, [usize; 2])> = None;
    let mut consider = |factor: f64, at: usize, neighbours: [usize; 2]| {
        if factor > CONTRADICTS && worst.is_none_or(|(most, ..)| factor > most) {
            worst = Some((factor, at, neighbours));
        }
    };
    for (n, three) in known.windows(3).enumerate() {
        let [(first, before), (_, result), (last, after)] = [three[0], three[1], three[2]];
        let above = result / before.max(after);
        let below = before.min(after) / result;
        consider(above.max(below), n + 1, [first, last]);
    }
    if let (true, [.., (n, first), (m, second), (_, last)]) = (falling, known) {
        consider(last / first.max(*second), known.len() - 1, [*n, *m]);
    }
    worst.map(|(_, at, neighbours)| (at, neighbours))
}

/// Result of a neighbouring setting.
struct Neighbour {
    /// Result with its unit.
    result: String,
    setting: String,
}

/// Returns the reason text of an outlier.
fn contradiction(neighbours: [Neighbour; 2]) -> String {
    let [before, after] =
        neighbours.map(|Neighbour { result, setting }| format!("{result} at {setting}"));
    format!("contradicts the settings next to it: {before} and {after}")
}

fn append_reason(why: Option<String>, contradiction: String) -> String {
    match why {
        Some(why) => format!("{why}; {contradiction}"),
        None => contradiction,
    }
}

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

impl CouplingStudy {
    /// Marks the rows that contradict their neighbours.
    pub(crate) fn mark_contradictions(&mut self) {
        let plants: Vec<String> = self.plants().into_iter().map(str::to_owned).collect();
        let mut found = Vec::new();
        for plant in &plants {
            let floor = self.floor_of(plant);
            for kind in [CouplingKind::Together, CouplingKind::Alone] {
                for method in CouplingMethod::ALL {
                    let rows = self.rows.iter().enumerate().filter(|(_, row)| {
                        row.plant == *plant && row.kind == kind && row.method == method
                    });
                    let error = rows.map(|(place, row)| {
                        let error = row.error_rms_m.filter(|_| row.status == Status::Ok);
                        (place, error.map(|error| error.max(floor)))
                    });
                    let (places, errors): (Vec<usize>, Vec<Option<f64>>) = error.unzip();
                    for (n, neighbours) in contradicting(&errors, true) {
                        let neighbours = neighbours.map(|n| Neighbour {
                            result: si(errors[n].unwrap_or_default(), "m"),
                            setting: si(self.rows[places[n]].step_s, "s"),
                        });
                        found.push((places[n], neighbours));
                    }
                }
            }
        }
        for (place, neighbours) in found {
            let row = &mut self.rows[place];
            row.contradicts = true;
            row.why = Some(append_reason(row.why.take(), contradiction(neighbours)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(results: &[Option<f64>], falling: bool) -> Vec<usize> {
        let found = contradicting(results, falling).into_iter();
        found.map(|(place, _)| place).collect()
    }

    #[test]
    fn result_far_from_both_neighbours_contradicts_them() {
        let falls: Vec<Option<f64>> = (0..8)
            .map(|n| Some(libm::pow(100.0, -f64::from(n))))
            .collect();
        assert!(
            places(&falls, true).is_empty(),
            "that is the order of a method"
        );
        let mut peak = falls.clone();
        peak[4] = Some(0.18);
        assert_eq!(places(&peak, true), [4]);
        let mut dip = falls.clone();
        dip[2] = Some(1e-15);
        assert_eq!(places(&dip, true), [2]);
        // A failed run is not a neighbour.
        peak[5] = None;
        assert_eq!(places(&peak, true), [4]);
    }

    #[test]
    fn last_result_is_checked_only_if_results_should_fall() {
        let results = [Some(1e-3), Some(1e-4), Some(1e-5), Some(0.18), None];
        assert_eq!(places(&results, true), [3]);
        assert!(places(&results, false).is_empty());
        assert!(places(&[Some(1.0), Some(1e-9)], true).is_empty());
    }
}
