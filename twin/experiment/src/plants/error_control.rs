//! Work and outcome of methods with error control over the values of each factor.

use serde::Serialize;

use crate::plants::factor::Factor;
use crate::plants::row::{Row, RowKind, Series, Status};
use crate::plants::study::{Study, StudyKind};

/// Runs of a method with error control over one factor: such a method has no largest stable step,
/// it completes, at a cost, or refuses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorControlTrend {
    /// Plant with its constraints.
    pub plant: String,
    /// Method.
    pub method: String,
    /// Factor.
    pub factor: String,
    /// Whether its values are multiples.
    pub is_multiple: bool,
    /// Least and greatest value with a completed run.
    pub completed: Option<[f64; 2]>,
    /// Number of completed runs, and of all.
    pub runs: [usize; 2],
    /// Least and greatest number of evaluations per simulated time \[1/s\].
    pub evaluations_per_s: Option<[f64; 2]>,
    /// Least substep of the completed runs \[s\].
    pub least_substep_s: Option<f64>,
    /// Greatest RMS distance of the feet from the reference in the completed runs \[m\].
    pub error_rms_m: Option<f64>,
    /// Values without a completed run, each with the reason.
    pub failures: Vec<(f64, String)>,
}

impl Study {
    /// Returns the trends of the plants with compliant constraints, of factors with at least two
    /// runs: other methods with error control depend on events, too.
    pub fn error_control_trends(&self) -> Vec<ErrorControlTrend> {
        if self.kind != StudyKind::Stability {
            return Vec::new();
        }
        let all = self.series().into_iter();
        let adaptive = all.filter(|key| key.is_adaptive() && key.plant.is_compliant());
        let pairs = adaptive.flat_map(|key| Factor::ALL.map(|factor| (key, factor)));
        pairs
            .filter_map(|(key, factor)| {
                let rows = self.varied(key, factor);
                (rows.len() > 1).then(|| ErrorControlTrend {
                    plant: key.plant.label(),
                    method: key.method.to_owned(),
                    factor: factor.name().to_owned(),
                    is_multiple: factor.is_multiple(),
                    ..trend(&rows)
                })
            })
            .collect()
    }

    /// Returns the rows of a series in which a factor is varied, in the order of its values.
    pub(crate) fn varied(&self, key: Series<'_>, factor: Factor) -> Vec<(f64, &Row)> {
        let rows = self.rows.iter().filter(|row| row.series() == key);
        let rows = rows.filter(|row| row.kind == RowKind::Stability);
        let rows = rows.filter_map(|row| Some((factor.of(&row.scales)?, row)));
        let mut rows: Vec<(f64, &Row)> = rows.collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        rows
    }
}

fn range(values: impl Iterator<Item = f64> + Clone) -> Option<[f64; 2]> {
    let least = values.clone().reduce(f64::min)?;
    Some([least, values.reduce(f64::max)?])
}

fn trend(rows: &[(f64, &Row)]) -> ErrorControlTrend {
    let completed = rows.iter().filter(|(_, row)| row.status == Status::Ok);
    let known = |of: fn(&Row) -> Option<f64>| completed.clone().filter_map(move |(_, row)| of(row));
    let failed = rows.iter().filter(|(_, row)| row.status != Status::Ok);
    let why = |row: &Row| {
        let why = row.why.as_deref().unwrap_or_default();
        format!("{}: {why}", row.word())
    };
    ErrorControlTrend {
        plant: String::new(),
        method: String::new(),
        factor: String::new(),
        is_multiple: false,
        completed: range(completed.clone().map(|(value, _)| *value)),
        runs: [completed.clone().count(), rows.len()],
        evaluations_per_s: range(known(Row::evaluations_per_s)),
        least_substep_s: known(|row| row.least_substep_s).reduce(f64::min),
        error_rms_m: known(|row| row.error_rms_m).reduce(f64::max),
        failures: failed.map(|(value, row)| (*value, why(row))).collect(),
    }
}
