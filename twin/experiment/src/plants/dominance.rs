//! Comparison of a plant with others that solve the same model: run time at equal or smaller error.

use serde::Serialize;
use twinrig_rig::PlantId;

use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::{Study, StudyKind};

/// Comparison of a plant with those that solve its model, or a similar one, with other engines,
/// within one study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dominance {
    /// Plant.
    pub of: String,
    /// Compared plants.
    pub over: Vec<String>,
    /// Whether errors are those against each plant's own reference: of similar models, not of one.
    pub own_references: bool,
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
    /// Whether no other setting of the compared plant, by any of its methods, is as accurate in
    /// less time.
    pub best: bool,
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

    /// Returns the best settings of the compared plants.
    pub fn best(&self) -> impl Iterator<Item = &Comparison> {
        self.settings.iter().filter(|comparison| comparison.best)
    }

    /// Returns least and greatest ratio of run times at an equal or smaller error, over the
    /// settings of `plant` by `method`, or over its best settings by any method if `None`.
    pub fn range(&self, plant: &str, method: Option<&str>) -> Option<(f64, f64)> {
        let own_rows = self.settings.iter().filter(|comparison| {
            comparison.plant == plant
                && method.map_or(comparison.best, |method| comparison.method == method)
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
            best: false,
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
    /// Returns the comparison of each plant of the study whose model other plants of it solve, and
    /// of each that is the peer of others.
    pub fn dominances(&self) -> Vec<Dominance> {
        if self.kind != StudyKind::Precision {
            return Vec::new();
        }
        let shared = distinct(&self.solves).into_iter().filter_map(|model| {
            // The error of a plant measured against its own reference is not comparable.
            let others = paired(&self.solves, model);
            let over = others.filter(|plant| self.is_measured_against(plant, model));
            self.dominance(model, over.collect(), false)
        });
        let own = distinct(&self.peers)
            .into_iter()
            .filter_map(|peer| self.dominance(peer, paired(&self.peers, peer).collect(), true));
        shared.chain(own).collect()
    }

    fn dominance(&self, of: &str, over: Vec<String>, own_references: bool) -> Option<Dominance> {
        let own_rows = self.known(of);
        let theirs = over.iter().flat_map(|plant| self.known(plant));
        let mut settings: Vec<Comparison> = theirs
            .map(|other| Comparison::of(other, &own_rows))
            .collect();
        mark_best(&mut settings);
        (!own_rows.is_empty() && !settings.is_empty()).then(|| Dominance {
            of: of.to_owned(),
            over,
            own_references,
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

/// Returns the plants that pairs name second, each once.
fn distinct(pairs: &[(PlantId, String)]) -> Vec<&str> {
    let mut all: Vec<&str> = Vec::new();
    for (_, second) in pairs {
        if !all.contains(&&**second) {
            all.push(second);
        }
    }
    all
}

/// Returns the plants paired with `second`.
fn paired<'a>(
    pairs: &'a [(PlantId, String)],
    second: &'a str,
) -> impl Iterator<Item = String> + 'a {
    let pairs = pairs.iter().filter(move |(_, other)| other == second);
    pairs.map(|(plant, _)| plant.label())
}

/// Relative difference below which two errors are equal: a method and its engine's step alone
/// differ by rounding.
const EQUAL_ERRORS: f64 = 1e-3;

/// Marks the settings of each plant that no other of its settings surpasses; of equal ones, the
/// first.
fn mark_best(settings: &mut [Comparison]) {
    for n in 0..settings.len() {
        let one = &settings[n];
        let surpasses = |(k, other): (usize, &Comparison)| {
            let [cost, own] = [other, one].map(|setting| setting.run_s_per_simulated_s);
            let [error, own_error] = [other, one].map(|setting| setting.error_rms_m);
            k != n
                && other.plant == one.plant
                && if cost < own {
                    error <= own_error * (1.0 + EQUAL_ERRORS)
                } else {
                    cost == own && (error, k) < (own_error, n)
                }
        };
        let surpassed = settings.iter().enumerate().any(surpasses);
        settings[n].best = !surpassed;
    }
}
