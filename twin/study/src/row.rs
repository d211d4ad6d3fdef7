//! A row of a study: one plant, one method, one setting.

use serde::Serialize;

use crate::factory::{MethodSetting, Scales, SetBy, Variant};

/// What a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RowKind {
    /// The error of a method, against the reference of the same plant.
    Integration,
    /// The difference between the references of two plants: what one model leaves out, not an error of a method.
    Model,
    /// The same as the masses of the segments vanish.
    Limit,
    /// The largest stable step.
    Stability,
}

/// What became of it. Scripts rely on the words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// It came to the end of the scene.
    Ok,
    /// Its energy grew, or it did not stay a number.
    Unstable,
    /// It could not be built, gave up, or took too long.
    Failed,
}

impl Status {
    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Unstable => "unstable",
            Self::Failed => "failed",
        }
    }
}

/// The word for what became of a run that may have been cut for the budget.
pub(crate) fn ended_word(status: Status, cut: bool) -> &'static str {
    if cut { "cut" } else { status.word() }
}

/// A row. Scripts rely on the names of its keys; what does not apply is null, but of `step_s` and `tolerance` only the one
/// that does is there.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "each is a column of its own")]
pub struct Row {
    /// Name of the plant.
    pub plant: String,
    /// Name of its method.
    pub method: String,
    /// Its step \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Its tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// What is changed of the robot and the scene; `stiffness` comes first.
    #[serde(flatten)]
    pub scales: Scales,
    /// What became of it.
    pub status: Status,
    /// Root of the mean square distance of the feet from where they should be \[m\].
    pub error_rms_m: Option<f64>,
    /// The greatest such distance \[m\].
    pub error_max_m: Option<f64>,
    /// The largest stable step \[s\].
    pub largest_stable_step_s: Option<f64>,
    /// Run time over steps \[s\].
    pub cost_per_step_s: Option<f64>,
    /// Run time over simulated time.
    pub run_s_per_simulated_s: Option<f64>,
    /// Evaluations of the right-hand side.
    pub evaluations: Option<u64>,
    /// What the row is about.
    pub kind: RowKind,
    /// Why it is not `ok`, or what is to be known of it.
    pub why: Option<String>,
    /// It would have taken longer than its share of the budget.
    pub cut: bool,
    /// It is stable, and not where it should be.
    pub wrong: bool,
    /// Its error is no greater than what is known of the reference.
    pub at_floor: bool,
    /// It contradicts the settings next to it.
    pub contradicts: bool,
    /// Root of the mean square distance of the trunk from where it should be \[m\].
    pub trunk_error_rms_m: Option<f64>,
    /// The greatest such distance \[m\].
    pub trunk_error_max_m: Option<f64>,
    /// The greatest error of the time of an event \[s\].
    pub event_time_error_s: Option<f64>,
    /// Events of the run.
    pub events: Option<u64>,
    /// Events of the reference.
    pub events_expected: Option<u64>,
    /// What the energy books lacked at the end \[J\].
    pub energy_residual_j: Option<f64>,
    /// The greatest drift of the constraints \[m\].
    pub drift_m: Option<f64>,
    /// Steps.
    pub steps: Option<u64>,
    /// Mean length of a step \[s\].
    pub mean_step_s: Option<f64>,
    /// Factorisations of a matrix.
    pub factorisations: Option<u64>,
    /// Iterations of the contact solver.
    pub solver_iterations: Option<u64>,
    /// Times another method, or a shorter step, took over.
    pub fallbacks: Option<u64>,
    /// The longest step that is stable and right, where that is known \[s\].
    pub largest_right_step_s: Option<f64>,
    /// The shortest step that was found unstable \[s\].
    pub least_unstable_step_s: Option<f64>,
    /// Runs that a search took.
    pub probes: Option<u64>,
    /// Simulated time over run time.
    pub real_time_factor: Option<f64>,
    /// Runs whose median the run time is.
    pub timed_runs: Option<u64>,
}

/// What the rows of one line have in common: a method may be set by its step in one and by a tolerance in another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// Name of the plant.
    pub plant: &'a str,
    /// Name of its method.
    pub method: &'a str,
    /// What that is set by.
    pub set_by: SetBy,
}

impl Line<'_> {
    /// Its method, as it is used.
    pub fn way(&self) -> String {
        match self.set_by {
            SetBy::Step => self.method.to_owned(),
            SetBy::Tolerance => format!("{}, adaptive", self.method),
        }
    }

    /// Plant and method.
    pub fn name(&self) -> String {
        format!("{} {}", self.plant, self.way())
    }

    /// Whether its method chooses its steps itself.
    pub fn is_adaptive(&self) -> bool {
        self.set_by == SetBy::Tolerance
    }
}

/// Keys of a row that come from a clock: everything else is the same in every study of the same build.
pub const CLOCKED: [&str; 4] = [
    "cost_per_step_s",
    "run_s_per_simulated_s",
    "real_time_factor",
    "timed_runs",
];

impl Row {
    /// A row on which nothing is known yet.
    pub(crate) fn new(kind: RowKind, variant: &Variant) -> Self {
        Self {
            plant: variant.plant.clone(),
            method: variant.method.clone(),
            step_s: variant.setting.step_s(),
            tolerance: variant.setting.tolerance(),
            scales: variant.scales,
            status: Status::Ok,
            error_rms_m: None,
            error_max_m: None,
            largest_stable_step_s: None,
            cost_per_step_s: None,
            run_s_per_simulated_s: None,
            evaluations: None,
            kind,
            why: None,
            cut: false,
            wrong: false,
            at_floor: false,
            contradicts: false,
            trunk_error_rms_m: None,
            trunk_error_max_m: None,
            event_time_error_s: None,
            events: None,
            events_expected: None,
            energy_residual_j: None,
            drift_m: None,
            steps: None,
            mean_step_s: None,
            factorisations: None,
            solver_iterations: None,
            fallbacks: None,
            largest_right_step_s: None,
            least_unstable_step_s: None,
            probes: None,
            real_time_factor: None,
            timed_runs: None,
        }
    }

    /// The same, with what became of it.
    pub(crate) fn ended(mut self, status: Status, why: impl Into<String>) -> Self {
        self.status = status;
        self.why = Some(why.into());
        self
    }

    /// The same, cut for the budget.
    pub(crate) fn cut_off(self, why: impl Into<String>) -> Self {
        Self {
            cut: true,
            ..self.ended(Status::Failed, why)
        }
    }

    /// Notes the work of a run that came to `reached_s`.
    pub(crate) fn note_work(&mut self, work: &twinrig_runtime::WorkCounts, reached_s: f64) {
        self.evaluations = Some(work.evaluations);
        self.steps = Some(work.steps);
        self.factorisations = Some(work.factorisations);
        self.solver_iterations = Some(work.solver_iterations);
        self.fallbacks = Some(work.fallbacks);
        self.mean_step_s = (work.steps > 0).then(|| reached_s / work.steps as f64);
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

    /// The word for what became of it: what was cut for the budget did nothing wrong.
    pub fn word(&self) -> &'static str {
        ended_word(self.status, self.cut)
    }

    /// How its method is set.
    pub fn setting(&self) -> Option<MethodSetting> {
        let step = self
            .step_s
            .and_then(twinrig_kernel::SimDuration::try_from_secs_f64)
            .map(MethodSetting::Step);
        step.or(self.tolerance.map(MethodSetting::Tolerance))
    }

    /// The line it is on.
    pub fn line(&self) -> Line<'_> {
        Line {
            plant: &self.plant,
            method: &self.method,
            set_by: match self.tolerance {
                Some(_) => SetBy::Tolerance,
                None => SetBy::Step,
            },
        }
    }
}
