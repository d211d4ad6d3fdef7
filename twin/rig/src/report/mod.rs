//! Reports of scenarios: the `--json` output, and the source of the table and the `JUnit` file.

pub mod bound;
pub mod buses;
pub mod error_bar;
pub mod row;
pub mod seconds;
mod tracking;

pub use buses::BusReport;
pub use error_bar::{ErrorBar, ErrorSource};
pub use seconds::{recording_s, seconds};
use serde::{Serialize, Serializer};
use twinrig_campaign::spread::{EnsembleKind, ExpectationSpread};
use twinrig_document::{Place, Warning};
use twinrig_record::ExpectationMessage;
use twinrig_runtime::real_time::{Histogram, RealTimeReport, TaskReport};
use twinrig_runtime::{EnergyBalance, WorkCounts};
use twinrig_scenario::{LeftOut, Outcome, TrackingReport, Verdict};

/// Verdict of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// All expectations hold.
    Pass,
    /// At least one expectation fails.
    Fail,
    /// The run did not complete.
    Error,
}

impl Status {
    /// Returns the exit code.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Pass => 0,
            Self::Fail => 1,
            Self::Error => 2,
        }
    }

    /// Returns the value used in `--json`.
    pub fn key(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Error => "error",
        }
    }

    /// Returns the word shown in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "PASS",
            Self::Fail => "FAIL",
            Self::Error => "ERROR",
        }
    }
}

/// Report of one scenario. The field names are the JSON keys, a stable interface for scripts.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Name of the scenario, or its path if it could not be read.
    pub scenario: String,
    /// Verdict.
    pub verdict: Status,
    /// Seed of the run.
    pub seed: Option<u64>,
    /// Model of the plant.
    pub plant: Option<String>,
    /// Fingerprint of the run up to its end.
    pub fingerprint: Option<String>,
    /// Simulated time reached \[s\].
    pub simulated_s: Option<f64>,
    /// Wall time of the run \[s\].
    pub wall_s: Option<f64>,
    /// Ratio of simulated time to wall time.
    pub real_time_factor: Option<f64>,
    /// Outcomes of the expectations.
    pub expectations: Vec<Line>,
    /// Parts that are not simulated, recorded or evaluated.
    pub left_out: Vec<LeftOut>,
    /// Path of the recording.
    pub recording: Option<String>,
    /// Path of the scenario, as given on the command line.
    pub file: String,
    /// Formulation of the constraints of the plant, where there is a choice.
    pub constraints: Option<&'static str>,
    /// Error that prevented the run or ended it prematurely.
    pub error: Option<String>,
    /// Energy balance of the plant.
    pub energy: Option<Energy>,
    /// Work counts of the plant.
    pub work: Option<WorkCounts>,
    /// Timing of a run on hardware.
    pub real_time: Option<RealTime>,
    /// Warnings about the scenario and about its run.
    pub warnings: Vec<WarningEntry>,
    /// Time of the robot's fall, if one was observed \[s\].
    pub fell_at_s: Option<f64>,
    /// How the legs follow the commands of a gait; none if the controller commands no leg.
    #[serde(serialize_with = "tracking::serialize")]
    pub tracking: Option<TrackingReport>,
    /// Traffic of the buses.
    pub buses: Vec<BusReport>,
    /// Names of the random streams that the run drew from; none of a run on hardware, or of one
    /// that did not start.
    pub random: Option<Vec<String>>,
    /// Reasons for which a strict run fails, although its expectations may hold; none if the run
    /// was not strict.
    pub strict: Option<Vec<String>>,
    /// Comparison with a baseline, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub against: Option<Against>,
    /// Path of the page of the run, if one was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub page: Option<String>,
}

/// Comparison of a run with its baseline.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Against {
    /// Path of the recording of the baseline.
    pub baseline: String,
    /// Whether all differences are within the tolerances.
    pub same: bool,
    /// Differences in words, the one by which the runs part first.
    pub differences: Vec<String>,
    /// Measured values of the expectations in the baseline, in the order of those of the run.
    pub measured: Vec<Option<f64>>,
}

/// Warning, in its serialised form.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WarningEntry {
    /// Stable identifier of the kind of warning.
    pub code: &'static str,
    /// Description of the likely mistake.
    pub message: String,
    /// File, or option of the command line.
    pub file: String,
    /// Line in the file, counted from 1.
    pub line: Option<usize>,
}

/// Code of warnings about the traffic of a run.
pub(crate) const BUS_WARNING: &str = "bus";

/// Code of warnings about limits of the plant that were exceeded.
pub(crate) const LIMIT_WARNING: &str = "beyond-limit";

/// Code of warnings about faults that harmed nothing in a run.
pub(crate) const FAULT_WARNING: &str = "fault-without-effect";

impl WarningEntry {
    /// Returns whether the warning is about the run, not about the scenario.
    fn is_of_run(&self) -> bool {
        [BUS_WARNING, LIMIT_WARNING, FAULT_WARNING].contains(&self.code)
    }

    /// Converts warnings, in their order.
    pub fn all(warnings: &[Warning]) -> Vec<Self> {
        let warned = |Warning { code, problem }: &Warning| Self {
            code,
            message: problem.message.clone(),
            file: problem.file.clone(),
            line: problem.place.as_ref().map(Place::line),
        };
        warnings.iter().map(warned).collect()
    }
}

/// Timing of a run on hardware.
#[derive(Clone, Debug)]
pub struct RealTime {
    /// Statistics of the timing.
    pub times: RealTimeReport,
    /// Impairments of the timing, with remedies.
    pub notes: Vec<String>,
}

#[derive(Serialize)]
struct WrittenRealTime<'a> {
    opening_s: f64,
    iterations: u64,
    overruns: u64,
    overslept: u64,
    lost: u64,
    lateness: Spread,
    jitter: Spread,
    computing: Spread,
    tasks: Vec<WrittenTask<'a>>,
    notes: &'a [String],
}

#[derive(Serialize)]
struct WrittenTask<'a> {
    name: &'a str,
    skipped: u64,
    took: Spread,
}

impl<'a> From<&'a TaskReport> for WrittenTask<'a> {
    fn from(task: &'a TaskReport) -> Self {
        Self {
            name: &task.name,
            skipped: task.skipped,
            took: (&task.took).into(),
        }
    }
}

/// Summary of a histogram \[s\].
#[derive(Serialize)]
struct Spread {
    count: u64,
    mean_s: f64,
    p99_s: Option<f64>,
    longest_s: f64,
}

impl From<&Histogram> for Spread {
    fn from(histogram: &Histogram) -> Self {
        Self {
            count: histogram.len(),
            mean_s: histogram.mean().as_secs_f64(),
            p99_s: histogram.at_most(0.99).map(|at_most| at_most.as_secs_f64()),
            longest_s: histogram.longest().as_secs_f64(),
        }
    }
}

impl Serialize for RealTime {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let times = &self.times;
        WrittenRealTime {
            opening_s: times.opening.as_secs_f64(),
            iterations: times.iterations,
            overruns: times.overruns,
            overslept: times.overslept,
            lost: times.lost,
            lateness: (&times.lateness).into(),
            jitter: (&times.jitter).into(),
            computing: (&times.computing).into(),
            tasks: times.tasks.iter().map(WrittenTask::from).collect(),
            notes: &self.notes,
        }
        .serialize(serializer)
    }
}

/// Outcome of an expectation, in its serialised form.
#[derive(Clone, Debug)]
pub struct Line {
    /// Outcome in the run.
    pub outcome: Outcome,
    /// The expectation over the runs of the scenario's ensemble; none without one.
    pub ensemble: Option<LineEnsemble>,
    /// Numerical error of the measured value; none if it was not asked for.
    pub error_bar: Option<ErrorBar>,
    /// Whether it is unobserved in a run that an error ended before its time window.
    pub cut_short: bool,
}

/// An expectation over the runs of an ensemble.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LineEnsemble {
    /// Difference between the runs.
    pub differ_by: EnsembleKind,
    /// Share and margins.
    #[serde(flatten)]
    pub spread: ExpectationSpread,
    /// Share that the scenario requires.
    pub required_share: f64,
}

impl LineEnsemble {
    /// Returns whether the expectation holds in the required share of the runs.
    pub fn holds(&self) -> bool {
        self.spread.share >= self.required_share
    }
}

/// Energy balance of a run \[J\].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Energy {
    /// Residual of the energy balance.
    pub residual_j: f64,
    /// Sum of the magnitudes of all transfers.
    pub exchanged_j: f64,
    /// Work of the actuators.
    pub actuator_j: f64,
    /// Energy dissipated by friction and damping.
    pub dissipated_j: f64,
    /// Energy dissipated by impacts.
    pub impact_j: f64,
}

impl From<EnergyBalance> for Energy {
    fn from(balance: EnergyBalance) -> Self {
        Self {
            residual_j: balance.residual,
            exchanged_j: balance.exchanged,
            actuator_j: balance.actuator,
            dissipated_j: balance.dissipated,
            impact_j: balance.impact,
        }
    }
}

impl Line {
    /// Returns the line of a single run.
    pub fn of(outcome: Outcome) -> Self {
        Self {
            outcome,
            ensemble: None,
            error_bar: None,
            cut_short: false,
        }
    }

    /// Returns whether the expectation holds: in the run, and in the required share of an ensemble.
    pub fn holds(&self) -> bool {
        let ensemble = self.ensemble.as_ref();
        self.outcome.holds() && ensemble.is_none_or(LineEnsemble::holds)
    }

    /// Returns whether the numerical error leaves the verdict open.
    pub fn is_undecided(&self) -> bool {
        self.error_bar.is_some_and(|bar| !bar.decided)
    }

    /// Converts the outcome to a message of a recording.
    pub(crate) fn message(&self) -> ExpectationMessage {
        let outcome = &self.outcome;
        let witness = &outcome.witness;
        let [min, max] = bound::limits(outcome);
        let verdict = match outcome.verdict {
            Verdict::Pass => "pass",
            Verdict::Fail => "fail",
            Verdict::Unobserved => "unobserved",
        };
        ExpectationMessage {
            name: outcome.name.clone(),
            verdict: verdict.to_owned(),
            optional: outcome.optional,
            measured: outcome.measured,
            bound: outcome.bound,
            other_bound: outcome.other_bound,
            margin: outcome.margin,
            unit: outcome.unit.symbol().to_owned(),
            first_violation_s: outcome.first_violation.map(|at| seconds(at.as_nanos())),
            detail: outcome.detail.clone(),
            leg: witness.leg.clone(),
            signal: witness.signal.clone(),
            element: witness.element.and_then(|element| element.try_into().ok()),
            instant_s: witness.at.map(|at| seconds(at.as_nanos())),
            recording_s: witness.at.map(recording_s),
            value: witness.value,
            min,
            max,
            line: outcome.place.line().try_into().ok(),
        }
    }
}

#[derive(Serialize)]
struct WrittenLine<'a> {
    name: &'a str,
    verdict: Verdict,
    measured: Option<f64>,
    bound: Option<f64>,
    unit: &'a str,
    margin: Option<f64>,
    first_violation_s: Option<f64>,
    other_bound: Option<f64>,
    optional: bool,
    detail: &'a str,
    leg: Option<&'a str>,
    signal: Option<&'a str>,
    element: Option<usize>,
    instant_s: Option<f64>,
    recording_s: Option<f64>,
    value: Option<f64>,
    min: Option<f64>,
    max: Option<f64>,
    file: &'a str,
    line: usize,
    cut_short: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    ensemble: Option<&'a LineEnsemble>,
    #[serde(flatten)]
    error_bar: Option<ErrorBar>,
}

impl Serialize for Line {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let outcome = &self.outcome;
        let witness = &outcome.witness;
        let [min, max] = bound::limits(outcome);
        WrittenLine {
            name: &outcome.name,
            verdict: outcome.verdict,
            measured: outcome.measured,
            bound: outcome.bound,
            unit: outcome.unit.symbol(),
            margin: outcome.margin,
            first_violation_s: outcome.first_violation.map(|at| seconds(at.as_nanos())),
            other_bound: outcome.other_bound,
            optional: outcome.optional,
            detail: &outcome.detail,
            leg: witness.leg.as_deref(),
            signal: witness.signal.as_deref(),
            element: witness.element,
            instant_s: witness.at.map(|at| seconds(at.as_nanos())),
            recording_s: witness.at.map(recording_s),
            value: witness.value,
            min,
            max,
            file: &outcome.place.source().name,
            line: outcome.place.line(),
            cut_short: self.cut_short,
            ensemble: self.ensemble.as_ref(),
            error_bar: self.error_bar,
        }
        .serialize(serializer)
    }
}

impl Report {
    /// Returns the report of a scenario whose run could not start.
    pub fn of_error(file: &str, error: String) -> Self {
        Self {
            scenario: file.to_owned(),
            verdict: Status::Error,
            seed: None,
            plant: None,
            constraints: None,
            fingerprint: None,
            simulated_s: None,
            wall_s: None,
            real_time_factor: None,
            expectations: Vec::new(),
            left_out: Vec::new(),
            recording: None,
            file: file.to_owned(),
            error: Some(error),
            energy: None,
            work: None,
            real_time: None,
            warnings: Vec::new(),
            fell_at_s: None,
            tracking: None,
            buses: Vec::new(),
            random: None,
            strict: None,
            against: None,
            page: None,
        }
    }

    /// Returns the warnings about the run: gaits that are not followed, buses, and limits of the
    /// plant.
    pub fn run_warnings(&self) -> Vec<String> {
        let of_run = self.warnings.iter().filter(|warned| warned.is_of_run());
        let mut warnings = tracking::warnings(self.tracking.as_ref());
        warnings.extend(of_run.map(|warned| warned.message.clone()));
        warnings
    }

    /// Makes the run strict: it fails where there is a warning. A bus that is not clean is one.
    pub(crate) fn make_strict(&mut self) {
        let of_scenario = self.warnings.iter().filter(|warned| !warned.is_of_run());
        let of_scenario = of_scenario.map(|warned| warned.message.clone());
        let reasons: Vec<String> = of_scenario.chain(self.run_warnings()).collect();
        if self.verdict == Status::Pass && !reasons.is_empty() {
            self.verdict = Status::Fail;
        }
        self.strict = Some(reasons);
    }

    /// Returns the number of expectations whose verdict the numerical error leaves open.
    pub fn undecided(&self) -> usize {
        let lines = self.expectations.iter();
        lines.filter(|line| line.is_undecided()).count()
    }

    /// Returns the exit code: that of the verdict, and at least that of a failure if a verdict is
    /// undecided.
    pub fn exit_code(&self) -> u8 {
        let of_verdict = self.verdict.exit_code();
        if self.undecided() > 0 {
            of_verdict.max(Status::Fail.exit_code())
        } else {
            of_verdict
        }
    }

    /// Returns the number of expectations that hold.
    pub fn held(&self) -> usize {
        let lines = self.expectations.iter();
        lines.filter(|line| line.holds()).count()
    }
}
