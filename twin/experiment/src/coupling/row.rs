//! Rows of a study of coupling: one plant, one coupling, one step.

use serde::{Deserialize, Serialize};
use twinrig_runtime::WorkCounts;

use super::factory::CouplingMethod;
use crate::measured::Measured;
use crate::plants::row::{Status, outcome_word};
use crate::plants::trace::Errors;

/// Kind of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CouplingKind {
    /// The plant steps with the grid: error against total run time.
    Together,
    /// The plant steps as in the reference: error of the coupling alone.
    Alone,
}

/// Row of a study of coupling. The keys are part of the output format; values that do not apply are
/// null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CouplingRow {
    /// Name of the plant.
    pub plant: String,
    /// Coupling method.
    pub method: CouplingMethod,
    /// Step of the grid; for exact coupling, that of the plant \[s\].
    pub step_s: f64,
    /// Factor of all springs: 1, the scenario unchanged.
    pub stiffness: f64,
    /// Outcome.
    pub status: Status,
    /// RMS distance of the feet from the reference \[m\].
    pub error_rms_m: Option<f64>,
    /// Greatest such distance \[m\].
    pub error_max_m: Option<f64>,
    /// Not applicable: null.
    pub largest_stable_step_s: Option<f64>,
    /// Run time of the whole rig per step of its plant \[s\].
    pub cost_per_step_s: Option<f64>,
    /// Run time of the whole rig per simulated time.
    pub run_s_per_simulated_s: Option<f64>,
    /// Evaluations of the right-hand side.
    pub evaluations: Option<u64>,
    /// Kind of the row.
    pub kind: CouplingKind,
    /// Step of the plant \[s\].
    pub plant_step_s: f64,
    /// Reason of a status other than `ok`, or a remark.
    pub why: Option<String>,
    /// Truncated by the budget.
    pub cut: bool,
    /// The error is no greater than the disagreement of the reference and its check.
    pub at_floor: bool,
    /// The result contradicts those of the neighbouring settings.
    pub contradicts: bool,
    /// RMS distance of the trunk from the reference \[m\].
    pub trunk_error_rms_m: Option<f64>,
    /// Greatest such distance \[m\].
    pub trunk_error_max_m: Option<f64>,
    /// Steps of the plant.
    pub steps: Option<u64>,
    /// Steps of the plant per simulated second, from its release on.
    pub steps_per_simulated_s: Option<f64>,
    /// Matrix factorisations.
    pub factorisations: Option<u64>,
    /// Number of discontinuities.
    pub events: Option<u64>,
    /// Iterations of the contact solver.
    pub solver_iterations: Option<u64>,
    /// Steps for which another method or a shorter step was substituted.
    pub fallbacks: Option<u64>,
    /// Counters of drivers and boards whose final value differs from the reference: name, reference
    /// value, value of this run.
    pub counters_changed: Option<Vec<(String, f64, f64)>>,
    /// Simulated time per run time.
    pub real_time_factor: Option<f64>,
    /// Number of runs whose median is the run time.
    pub timed_runs: Option<u64>,
    /// Start of the program that measured the row; null where nothing is kept.
    pub start: Option<usize>,
}

impl Measured for CouplingRow {
    fn is_cut(&self) -> bool {
        self.cut
    }

    fn note_start(&mut self, start: usize) {
        self.start = Some(start);
    }
}

impl CouplingRow {
    /// A row without results.
    pub(crate) fn new(
        kind: CouplingKind,
        plant: &str,
        method: CouplingMethod,
        step_s: f64,
        plant_step_s: f64,
    ) -> Self {
        Self {
            plant: plant.to_owned(),
            method,
            step_s,
            stiffness: 1.0,
            status: Status::Ok,
            error_rms_m: None,
            error_max_m: None,
            largest_stable_step_s: None,
            cost_per_step_s: None,
            run_s_per_simulated_s: None,
            evaluations: None,
            kind,
            plant_step_s,
            why: None,
            cut: false,
            at_floor: false,
            contradicts: false,
            trunk_error_rms_m: None,
            trunk_error_max_m: None,
            steps: None,
            steps_per_simulated_s: None,
            factorisations: None,
            events: None,
            solver_iterations: None,
            fallbacks: None,
            counters_changed: None,
            real_time_factor: None,
            timed_runs: None,
            start: None,
        }
    }

    /// Returns the word for the outcome; a truncated run is not a failure of the method.
    pub fn word(&self) -> &'static str {
        outcome_word(self.status, self.cut)
    }

    /// Returns the row with its outcome.
    pub(crate) fn ended(mut self, status: Status, why: impl Into<String>) -> Self {
        self.status = status;
        self.why = Some(why.into());
        self
    }

    /// Records the errors of a run.
    pub(crate) fn note_errors(&mut self, errors: &Errors) {
        self.error_rms_m = Some(errors.foot_rms);
        self.error_max_m = Some(errors.foot_max);
        self.trunk_error_rms_m = errors.trunk.map(|(rms, _)| rms);
        self.trunk_error_max_m = errors.trunk.map(|(_, max)| max);
    }

    /// Records the work of a run whose plant moved for `moved_s`.
    pub(crate) fn note_work(&mut self, work: &WorkCounts, moved_s: f64) {
        self.evaluations = Some(work.evaluations);
        self.steps = Some(work.steps);
        self.steps_per_simulated_s = (moved_s > 0.0).then(|| work.steps as f64 / moved_s);
        self.factorisations = Some(work.factorisations);
        self.events = Some(work.events);
        self.solver_iterations = Some(work.solver_iterations);
        self.fallbacks = Some(work.fallbacks);
    }

    /// Records the run time `run_s` of `simulated_s`, the median of `runs`.
    pub(crate) fn note_time(&mut self, run_s: f64, simulated_s: f64, runs: u64) {
        if simulated_s <= 0.0 {
            return;
        }
        self.run_s_per_simulated_s = Some(run_s / simulated_s);
        self.real_time_factor = (run_s > 0.0).then(|| simulated_s / run_s);
        self.timed_runs = Some(runs);
        let steps = self.steps.filter(|&steps| steps > 0);
        self.cost_per_step_s = steps.map(|steps| run_s / steps as f64);
    }
}
