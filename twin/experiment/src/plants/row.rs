//! Rows of a study: one plant, one method, one setting.

use serde::{Deserialize, Serialize};
use twinrig_report::number::plain;
use twinrig_rig::PlantId;
use twinrig_rig::{MethodSetting, Scales, SettingKind, Variant};

use crate::measured::Measured;

/// Kind of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RowKind {
    /// Error of a method against the reference of the same plant.
    Integration,
    /// Difference between the references of two models: a modelling error, independent of the
    /// method. The model `against` is named in the row.
    Model,
    /// Modelling error as the masses of the leg segments vanish.
    Limit,
    /// Search for the largest stable step.
    Stability,
}

/// Outcome of a run or search. The serialised words are part of the output format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// The run completed.
    Ok,
    /// Its energy grew, or a value became NaN or infinite.
    Unstable,
    /// It could not be built, reported a fault, or exceeded the budget.
    Failed,
    /// A method with error control reported a fault in place of a result.
    Refused,
}

impl Status {
    /// Returns the serialised word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Unstable => "unstable",
            Self::Failed => "failed",
            Self::Refused => "refused",
        }
    }
}

/// Returns the word for an outcome; `cut` for a run truncated by the budget.
pub(crate) fn outcome_word(status: Status, cut: bool) -> &'static str {
    if cut { "cut" } else { status.word() }
}

/// Returns the label of a plant with scaled compliance: `lcp, compliant, stiffness × 3`.
pub(crate) fn model_label(plant: &PlantId, scales: &Scales) -> String {
    let factor = |name, factor: f64| {
        if (factor - 1.0).abs() < 1e-9 {
            String::new()
        } else {
            format!(", {name} × {}", plain(factor))
        }
    };
    format!(
        "{plant}{}{}",
        factor("stiffness", scales.compliance),
        factor("damping", scales.compliance_damping)
    )
}

/// Row of a study. The keys are part of the output format. Values that do not apply are null; of
/// `step_s` and `tolerance`, only the one that applies is present.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(clippy::struct_excessive_bools, reason = "each is a separate column")]
pub struct Row {
    /// Plant: its name, and the formulation of its constraints.
    #[serde(flatten)]
    pub plant: PlantId,
    /// Name of the method.
    pub method: String,
    /// Step size \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Changes of robot and ground; `stiffness` comes first.
    #[serde(flatten)]
    pub scales: Scales,
    /// Outcome.
    pub status: Status,
    /// RMS distance of the feet from the reference \[m\].
    pub error_rms_m: Option<f64>,
    /// Greatest such distance \[m\].
    pub error_max_m: Option<f64>,
    /// Largest stable step \[s\].
    pub largest_stable_step_s: Option<f64>,
    /// Run time per step \[s\].
    pub cost_per_step_s: Option<f64>,
    /// Run time per simulated time.
    pub run_s_per_simulated_s: Option<f64>,
    /// Evaluations of the right-hand side.
    pub evaluations: Option<u64>,
    /// Kind of the row.
    pub kind: RowKind,
    /// Reason of a status other than `ok`, or a remark.
    pub why: Option<String>,
    /// Truncated by the budget.
    pub cut: bool,
    /// Stable, but with an error above the limit of accuracy.
    pub wrong: bool,
    /// The error is no greater than the disagreement of the reference and its check.
    pub at_floor: bool,
    /// The result contradicts those of the neighbouring settings.
    pub contradicts: bool,
    /// RMS distance of the trunk from the reference \[m\].
    pub trunk_error_rms_m: Option<f64>,
    /// Greatest such distance \[m\].
    pub trunk_error_max_m: Option<f64>,
    /// RMS distance of the worst foot relative to its hip, in the frame of the trunk \[m\].
    pub foot_to_hip_error_rms_m: Option<f64>,
    /// Slope of log error over log tolerance of the series between tolerances of 1e-8 and 1e-5,
    /// with the error of `error_rms_m`.
    pub tolerance_slope: Option<f64>,
    /// Model that a difference of models is measured against, with the factors of its compliance.
    pub against: Option<String>,
    /// Compared duration of a difference of models \[s\].
    pub compared_s: Option<f64>,
    /// Greatest error of an event time \[s\].
    pub event_time_error_s: Option<f64>,
    /// Number of events of the run.
    pub events: Option<u64>,
    /// Number of events of the reference.
    pub events_expected: Option<u64>,
    /// Residual of the energy balance at the end \[J\].
    pub energy_residual_j: Option<f64>,
    /// Maximum constraint violation \[m\].
    pub drift_m: Option<f64>,
    /// Number of steps.
    pub steps: Option<u64>,
    /// Mean step size \[s\].
    pub mean_step_s: Option<f64>,
    /// Least substep of an error control, but for those cut short \[s\].
    pub least_substep_s: Option<f64>,
    /// Matrix factorisations.
    pub factorisations: Option<u64>,
    /// Iterations of the contact solver.
    pub solver_iterations: Option<u64>,
    /// Steps for which another method or a shorter step was substituted.
    pub fallbacks: Option<u64>,
    /// Largest step that is stable and accurate, if known \[s\].
    pub largest_right_step_s: Option<f64>,
    /// Smallest step found unstable \[s\].
    pub least_unstable_step_s: Option<f64>,
    /// Number of runs of the search.
    pub probes: Option<u64>,
    /// Simulated time per run time.
    pub real_time_factor: Option<f64>,
    /// Number of runs whose median is the run time.
    pub timed_runs: Option<u64>,
    /// Start of the program that measured the row; null where nothing is kept.
    pub start: Option<usize>,
}

/// Plant, method and setting of a result, as keys of the output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariantKey {
    /// Plant.
    #[serde(flatten)]
    pub plant: PlantId,
    /// Name of the method.
    pub method: String,
    /// Step size \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
}

impl From<&Variant> for VariantKey {
    fn from(variant: &Variant) -> Self {
        Self {
            plant: variant.plant.clone(),
            method: variant.method.clone(),
            step_s: variant.setting.step_s(),
            tolerance: variant.setting.tolerance(),
        }
    }
}

/// Key of a series of rows. A method can have two series: by its step and by a tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Series<'a> {
    /// Plant.
    pub plant: &'a PlantId,
    /// Name of the method.
    pub method: &'a str,
    /// Quantity that sets the accuracy.
    pub set_by: SettingKind,
}

impl Series<'_> {
    /// Returns the label of the method, marked if it is adaptive.
    pub fn method_label(&self) -> String {
        match self.set_by {
            SettingKind::Step => self.method.to_owned(),
            SettingKind::Tolerance => format!("{}, adaptive", self.method),
        }
    }

    /// Returns plant and method label.
    pub fn name(&self) -> String {
        format!("{} {}", self.plant, self.method_label())
    }

    /// Returns whether the method controls its step size.
    pub fn is_adaptive(&self) -> bool {
        self.set_by == SettingKind::Tolerance
    }
}

/// Keys of a row that depend on the clock or on starts of the program: all others are the same in
/// every study of one build.
pub const CLOCKED: [&str; 5] = [
    "cost_per_step_s",
    "run_s_per_simulated_s",
    "real_time_factor",
    "timed_runs",
    "start",
];

impl Row {
    /// A row without results.
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
            foot_to_hip_error_rms_m: None,
            tolerance_slope: None,
            against: None,
            compared_s: None,
            event_time_error_s: None,
            events: None,
            events_expected: None,
            energy_residual_j: None,
            drift_m: None,
            steps: None,
            mean_step_s: None,
            least_substep_s: None,
            factorisations: None,
            solver_iterations: None,
            fallbacks: None,
            largest_right_step_s: None,
            least_unstable_step_s: None,
            probes: None,
            real_time_factor: None,
            timed_runs: None,
            start: None,
        }
    }

    /// Returns the row with its outcome.
    pub(crate) fn ended(mut self, status: Status, why: impl Into<String>) -> Self {
        self.status = status;
        self.why = Some(why.into());
        self
    }

    /// Returns the row as truncated by the budget.
    pub(crate) fn cut_off(self, why: impl Into<String>) -> Self {
        Self {
            cut: true,
            ..self.ended(Status::Failed, why)
        }
    }

    /// Records the work of a run that reached `reached_s`.
    pub(crate) fn note_work(&mut self, work: &twinrig_runtime::WorkCounts, reached_s: f64) {
        self.evaluations = Some(work.evaluations);
        self.steps = Some(work.steps);
        self.factorisations = Some(work.factorisations);
        self.solver_iterations = Some(work.solver_iterations);
        self.fallbacks = Some(work.fallbacks);
        self.mean_step_s = (work.steps > 0).then(|| reached_s / work.steps as f64);
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

    /// Returns the word for the outcome; a truncated run is not a failure of the method.
    pub fn word(&self) -> &'static str {
        outcome_word(self.status, self.cut)
    }

    /// Returns plant, constraints and factors of compliance: `lcp, compliant, stiffness × 3`.
    pub fn model(&self) -> String {
        model_label(&self.plant, &self.scales)
    }

    /// Returns whether the row varies the compliance of a plant to show its sensitivity to it.
    pub fn varies_compliance(&self) -> bool {
        self.scales.compliance < 1.0 || self.scales.compliance_damping != 1.0
    }

    /// Returns the evaluations per simulated time \[1/s\].
    pub(crate) fn evaluations_per_s(&self) -> Option<f64> {
        let simulated_s = self.mean_step_s? * self.steps? as f64;
        Some(self.evaluations? as f64 / simulated_s)
    }

    /// Returns the setting of the method.
    pub fn setting(&self) -> Option<MethodSetting> {
        let step = self
            .step_s
            .and_then(twinrig_kernel::SimDuration::try_from_secs_f64)
            .map(MethodSetting::Step);
        step.or(self.tolerance.map(MethodSetting::Tolerance))
    }

    /// Returns the series of the row.
    pub fn series(&self) -> Series<'_> {
        Series {
            plant: &self.plant,
            method: &self.method,
            set_by: match self.tolerance {
                Some(_) => SettingKind::Tolerance,
                None => SettingKind::Step,
            },
        }
    }
}

impl Measured for Row {
    fn is_cut(&self) -> bool {
        self.cut
    }

    fn note_start(&mut self, start: usize) {
        self.start = Some(start);
    }
}
