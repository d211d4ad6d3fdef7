//! A row of a study of coupling: one plant, one way to couple it, one step.

use serde::Serialize;
use twinrig_runtime::WorkCounts;

use super::factory::CouplingMethod;
use crate::row::{Status, ended_word};
use crate::trace::Errors;

/// What a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CouplingKind {
    /// The plant steps as far as the grid does: what one has for the time one pays.
    Together,
    /// The plant steps as the reference does: what is left is the error of the coupling alone.
    Alone,
}

/// A row. Scripts rely on the names of its keys; what does not apply is null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CouplingRow {
    /// Name of the plant.
    pub plant: String,
    /// How it is coupled.
    pub method: CouplingMethod,
    /// The step of the grid; of exact coupling, the plant's \[s\].
    pub step_s: f64,
    /// Of all springs, a factor: the scene as it is.
    pub stiffness: f64,
    /// What became of it.
    pub status: Status,
    /// Root of the mean square distance of the feet from where they should be \[m\].
    pub error_rms_m: Option<f64>,
    /// The greatest such distance \[m\].
    pub error_max_m: Option<f64>,
    /// Of no meaning here: null.
    pub largest_stable_step_s: Option<f64>,
    /// Run time of the whole rig over steps of its plant \[s\].
    pub cost_per_step_s: Option<f64>,
    /// Run time of the whole rig over simulated time.
    pub run_s_per_simulated_s: Option<f64>,
    /// Evaluations of the right-hand side.
    pub evaluations: Option<u64>,
    /// What the row is about.
    pub kind: CouplingKind,
    /// The plant's own step \[s\].
    pub plant_step_s: f64,
    /// Why it is not `ok`, or what is to be known of it.
    pub why: Option<String>,
    /// It would have taken longer than its share of the budget.
    pub cut: bool,
    /// Its error is no greater than what is known of the reference.
    pub at_floor: bool,
    /// It contradicts the settings next to it.
    pub contradicts: bool,
    /// Root of the mean square distance of the trunk from where it should be \[m\].
    pub trunk_error_rms_m: Option<f64>,
    /// The greatest such distance \[m\].
    pub trunk_error_max_m: Option<f64>,
    /// Steps of the plant.
    pub steps: Option<u64>,
    /// The same in a second, from when the plant was let go.
    pub steps_per_simulated_s: Option<f64>,
    /// Factorisations of a matrix.
    pub factorisations: Option<u64>,
    /// Discontinuities met.
    pub events: Option<u64>,
    /// Iterations of the contact solver.
    pub solver_iterations: Option<u64>,
    /// Times another method, or a shorter step, took over.
    pub fallbacks: Option<u64>,
    /// Counters of drivers and boards that ended elsewhere than the reference's: name, there, here.
    pub counters_changed: Option<Vec<(String, f64, f64)>>,
    /// Simulated time over run time.
    pub real_time_factor: Option<f64>,
    /// Runs whose median the run time is.
    pub timed_runs: Option<u64>,
}

impl CouplingRow {
    /// A row on which nothing is known yet.
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
        }
    }

    /// The word for what became of it: what was cut for the budget did nothing wrong.
    pub fn word(&self) -> &'static str {
        ended_word(self.status, self.cut)
    }

    /// The same, with what became of it.
    pub(crate) fn ended(mut self, status: Status, why: impl Into<String>) -> Self {
        self.status = status;
        self.why = Some(why.into());
        self
    }

    /// Notes how far a run is from where it should be.
    pub(crate) fn note_errors(&mut self, errors: &Errors) {
        self.error_rms_m = Some(errors.foot_rms);
        self.error_max_m = Some(errors.foot_max);
        self.trunk_error_rms_m = errors.trunk.map(|(rms, _)| rms);
        self.trunk_error_max_m = errors.trunk.map(|(_, max)| max);
    }

    /// Notes the work of a run that moved its plant for so long.
    pub(crate) fn note_work(&mut self, work: &WorkCounts, moved_s: f64) {
        self.evaluations = Some(work.evaluations);
        self.steps = Some(work.steps);
        self.steps_per_simulated_s = (moved_s > 0.0).then(|| work.steps as f64 / moved_s);
        self.factorisations = Some(work.factorisations);
        self.events = Some(work.events);
        self.solver_iterations = Some(work.solver_iterations);
        self.fallbacks = Some(work.fallbacks);
    }

    /// Notes that simulating `simulated_s` took `run_s`, the median of `runs`.
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
