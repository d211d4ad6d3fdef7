//! Whether a plant is faster and closer than others that solve its model.

use serde::Serialize;

use crate::row::{Row, RowKind, Status};
use crate::study::{Study, StudyKind};

/// What a plant does against those that solve its model by other means, all of one run of a study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dominance {
    /// The plant.
    pub of: String,
    /// The others.
    pub over: Vec<String>,
    /// Every setting of theirs that came to the end.
    pub settings: Vec<Comparison>,
}

/// A setting of another plant, and what does better.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The other plant.
    pub plant: String,
    /// Its method.
    pub method: String,
    /// Its step \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Its tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Its error, RMS; what is below the floor of the reference counts as that \[m\].
    pub error_rms_m: f64,
    /// Its run time over simulated time.
    pub run_s_per_simulated_s: f64,
    /// The fastest setting whose error is no greater; none if there is none.
    pub no_greater_error: Option<Competitor>,
    /// The setting with the smallest error that takes no more time; none if there is none.
    pub no_more_time: Option<Competitor>,
}

/// A setting that is compared with that of another plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Competitor {
    /// Its method.
    pub method: String,
    /// Its step \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Its tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Its error, RMS \[m\].
    pub error_rms_m: f64,
    /// Its run time over simulated time.
    pub run_s_per_simulated_s: f64,
    /// So many times less run time.
    pub times_less_time: f64,
    /// So many times less error.
    pub times_less_error: f64,
}

/// A row whose error and run time are known.
#[derive(Clone, Copy)]
struct Known<'a> {
    row: &'a Row,
    error: f64,
    cost: f64,
}

impl Dominance {
    /// The settings at which it is not ahead: nothing of it is as fast at no greater error.
    pub fn behind(&self) -> impl Iterator<Item = &Comparison> {
        self.settings
            .iter()
            .filter(|comparison| !comparison.is_won())
    }

    /// The least and the greatest factor of run time at no greater error over the settings of `plant` by `method`, all its
    /// methods if that is none.
    pub fn range(&self, plant: &str, method: Option<&str>) -> Option<(f64, f64)> {
        let ours = self.settings.iter().filter(|comparison| {
            comparison.plant == plant && method.is_none_or(|method| comparison.method == method)
        });
        let ratios = ours
            .filter_map(|comparison| Some(comparison.no_greater_error.as_ref()?.times_less_time));
        let ratios: Vec<f64> = ratios.collect();
        let least = ratios.iter().copied().min_by(f64::total_cmp)?;
        Some((least, ratios.iter().copied().fold(least, f64::max)))
    }
}

impl Comparison {
    /// Something is no slower and no further from the reference.
    pub fn is_won(&self) -> bool {
        let rival = self.no_greater_error.as_ref();
        rival.is_some_and(|rival| rival.times_less_time >= 1.0)
    }

    fn of(other: Known<'_>, ours: &[Known<'_>]) -> Self {
        let ours = || ours.iter();
        let closer = ours().filter(|own| own.error <= other.error);
        let faster = ours().filter(|own| own.cost <= other.cost);
        let rival = |own: &Known<'_>| Competitor {
            method: own.row.method.clone(),
            step_s: own.row.step_s,
            tolerance: own.row.tolerance,
            error_rms_m: own.error,
            run_s_per_simulated_s: own.cost,
            times_less_time: other.cost / own.cost,
            times_less_error: other.error / own.error,
        };
        Self {
            plant: other.row.plant.clone(),
            method: other.row.method.clone(),
            step_s: other.row.step_s,
            tolerance: other.row.tolerance,
            error_rms_m: other.error,
            run_s_per_simulated_s: other.cost,
            no_greater_error: closer.min_by(|a, b| a.cost.total_cmp(&b.cost)).map(rival),
            no_more_time: faster.min_by(|a, b| a.error.total_cmp(&b.error)).map(rival),
        }
    }
}

impl Study {
    /// Each plant of the study whose model others of it solve, against those.
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
        let ours = self.known(model);
        let others = self.solves.iter().filter(|(_, solved)| solved == model);
        let others = others.map(|(plant, _)| plant.clone());
        // What is measured against itself has no error that compares.
        let compared = others.filter(|plant| self.is_measured_against(plant, model));
        let over: Vec<String> = compared.collect();
        let theirs = over.iter().flat_map(|plant| self.known(plant));
        let settings: Vec<Comparison> = theirs.map(|other| Comparison::of(other, &ours)).collect();
        (!ours.is_empty() && !settings.is_empty()).then(|| Dominance {
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

    fn known(&self, plant: &str) -> Vec<Known<'_>> {
        let floor = self.floor_of(plant);
        let rows = self.rows.iter().filter(|row| {
            row.plant == plant && row.kind == RowKind::Integration && row.status == Status::Ok
        });
        let known = rows.filter_map(|row| {
            let cost = row.run_s_per_simulated_s.filter(|&cost| cost > 0.0)?;
            // No run is known to be closer than its reference is, and of one without a check something may be.
            let error = row.error_rms_m?.max(floor).max(f64::MIN_POSITIVE);
            Some(Known { row, error, cost })
        });
        known.collect()
    }
}
