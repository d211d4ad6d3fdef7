//! Comparison of a plant with others that solve the same model: run time at equal or smaller error.

use serde::Serialize;

use crate::row::{Row, RowKind, Status};
use crate::study::{Study, StudyKind};

/// Comparison of a plant with the plants that solve its model with other engines, within one study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dominance {
    /// Plant.
    pub of: String,
    /// Compared plants.
    pub over: Vec<String>,
    /// All completed settings of the compared plants.
    pub settings: Vec<Comparison>,
}

/// A setting of a compared plant, with the settings of the plant that are better.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Compared plant.
    pub plant: String,
    /// Method.
    pub method: String,
    /// Step size \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// RMS error, at least the floor of the reference \[m\].
    pub error_rms_m: f64,
    /// Run time per simulated time.
    pub run_s_per_simulated_s: f64,
    /// Fastest setting with an equal or smaller error, if any.
    pub no_greater_error: Option<Competitor>,
    /// Most accurate setting with an equal or shorter run time, if any.
    pub no_more_time: Option<Competitor>,
}

/// Setting of the plant, compared with that of another plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Competitor {
    /// Method.
    pub method: String,
    /// Step size \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// RMS error \[m\].
    pub error_rms_m: f64,
    /// Run time per simulated time.
    pub run_s_per_simulated_s: f64,
    /// Ratio of run times: the other plant's over this one's.
    pub times_less_time: f64,
    /// Ratio of errors: the other plant's over this one's.
    pub times_less_error: f64,
}

/// Row with known error and run time.
#[derive(Clone, Copy)]
struct TimedRow<'a> {
    row: &'a Row,
    error: f64,
    cost: f64,
}

impl Dominance {
    /// Returns the settings of the compared plants that are faster than every setting of the plant
    /// with an equal or smaller error.
    pub fn behind(&self) -> impl Iterator<Item = &Comparison> {
        self.settings
            .iter()
            .filter(|comparison| !comparison.is_won())
    }

    /// Returns least and greatest ratio of run times at an equal or smaller error, over the
    /// settings of `plant` by `method`, or by all its methods if `None`.
    pub fn range(&self, plant: &str, method: Option<&str>) -> Option<(f64, f64)> {
        let own_rows = self.settings.iter().filter(|comparison| {
            comparison.plant == plant && method.is_none_or(|method| comparison.method == method)
        });
        let ratios = own_rows
            .filter_map(|comparison| Some(comparison.no_greater_error.as_ref()?.times_less_time));
        let ratios: Vec<f64> = ratios.collect();
        let least = ratios.iter().copied().min_by(f64::total_cmp)?;
        Some((least, ratios.iter().copied().fold(least, f64::max)))
    }
}

impl Comparison {
    /// Returns whether a setting of the plant is no slower and has an equal or smaller error.
    pub fn is_won(&self) -> bool {
        let competitor = self.no_greater_error.as_ref();
        competitor.is_some_and(|competitor| competitor.times_less_time >= 1.0)
    }

    fn of(other: TimedRow<'_>, own_rows: &[TimedRow<'_>]) -> Self {
        let own_rows = || own_rows.iter();
        let closer = own_rows().filter(|own| own.error <= other.error);
        let faster = own_rows().filter(|own| own.cost <= other.cost);
        let competitor = |own: &TimedRow<'_>| Competitor {
            method: own.row.method.clone(),
            step_s: own.row.step_s,
            tolerance: own.row.tolerance,
            error_rms_m: own.error,
            run_s_per_simulated_s: own.cost,
            times_less_time: other.cost / own.cost,
            times_less_error: other.error / own.error,
        };
        Self {
            plant: other.row.plant.label(),
            method: other.row.method.clone(),
            step_s: other.row.step_s,
            tolerance: other.row.tolerance,
            error_rms_m: other.error,
            run_s_per_simulated_s: other.cost,
            no_greater_error: closer
                .min_by(|a, b| a.cost.total_cmp(&b.cost))
                .map(competitor),
            no_more_time: faster
                .min_by(|a, b| a.error.total_cmp(&b.error))
                .map(competitor),
        }
    }
}

impl Study {
    /// Returns the comparison of each plant of the study whose model other plants of it solve.
    pub fn dominances(&self) -> Vec<Dominance> {
        if self.kind != StudyKind::Precision {
            return Vec::new();
        }
        let mut models: Vec<&str> = Vec::new();
        for (_, model) in &self.solves {
            if !models.contains(&&**model) {
                models.push(model);
            }
        }
        let all = models.into_iter().filter_map(|model| self.dominance(model));
        all.collect()
    }

    fn dominance(&self, model: &str) -> Option<Dominance> {
        let own_rows = self.known(model);
        let others = self.solves.iter().filter(|(_, solved)| solved == model);
        let others = others.map(|(plant, _)| plant.label());
        // The error of a plant measured against its own reference is not comparable.
        let compared = others.filter(|plant| self.is_measured_against(plant, model));
        let over: Vec<String> = compared.collect();
        let theirs = over.iter().flat_map(|plant| self.known(plant));
        let settings: Vec<Comparison> = theirs
            .map(|other| Comparison::of(other, &own_rows))
            .collect();
        (!own_rows.is_empty() && !settings.is_empty()).then(|| Dominance {
            of: model.to_owned(),
            over,
            settings,
        })
    }

    fn is_measured_against(&self, plant: &str, model: &str) -> bool {
        let mut notes = self.references.iter();
        let note = notes.find(|note| note.plant == plant);
        note.is_some_and(|note| note.of_plant.as_deref() == Some(model))
    }

    fn known(&self, plant: &str) -> Vec<TimedRow<'_>> {
        let note = self.references.iter().find(|note| note.plant == plant);
        let floor = note.map_or(0.0, |note| self.floor_of(&note.plant));
        let rows = self.rows.iter().filter(|row| {
            row.plant == plant && row.kind == RowKind::Integration && row.status == Status::Ok
        });
        let known = rows.filter_map(|row| {
            let cost = row.run_s_per_simulated_s.filter(|&cost| cost > 0.0)?;
            // Errors below the floor of the reference are not significant. Without a check the
            // floor is zero, and so may be the error.
            let error = row.error_rms_m?.max(floor).max(f64::MIN_POSITIVE);
            Some(TimedRow { row, error, cost })
        });
        known.collect()
    }
}
