//! What became of a scenario: what `--json` prints, what the table and the `JUnit` file are made from.

pub(crate) mod grid;
pub(crate) mod junit;
pub(crate) mod paint;
pub(crate) mod table;

use serde::{Serialize, Serializer};
use twinrig_document::{Place, Warning};
use twinrig_record::ExpectationMessage;
use twinrig_runtime::real_time::{Histogram, RealTimeReport, TaskReport};
use twinrig_runtime::{EnergyBalance, WorkCounts};
use twinrig_scenario::{LeftOut, Outcome, Verdict};

/// What became of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// All expectations hold.
    Pass,
    /// One does not.
    Fail,
    /// It did not run to its end.
    Error,
}

impl Status {
    /// The exit code that says so.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Pass => 0,
            Self::Fail => 1,
            Self::Error => 2,
        }
    }

    /// The word for a program, as in `--json`.
    pub fn key(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Error => "error",
        }
    }

    /// The word for a person.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "PASS",
            Self::Fail => "FAIL",
            Self::Error => "ERROR",
        }
    }
}

/// The report of one scenario. Scripts rely on the names of its keys.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What the scenario calls itself; its path if it could not be read.
    pub scenario: String,
    /// What became of it.
    pub verdict: Status,
    /// Its seed.
    pub seed: Option<u64>,
    /// Its plant.
    pub plant: Option<String>,
    /// The fingerprint of the run, of as much as there is of it.
    pub fingerprint: Option<String>,
    /// Simulated time reached \[s\].
    pub simulated_s: Option<f64>,
    /// Time that took \[s\].
    pub wall_s: Option<f64>,
    /// Simulated over wall time.
    pub real_time_factor: Option<f64>,
    /// What became of the expectations.
    pub expectations: Vec<Line>,
    /// What is not in the scene.
    pub left_out: Vec<LeftOut>,
    /// Path of the recording.
    pub recording: Option<String>,
    /// Path of the scenario, as it was given.
    pub file: String,
    /// Why it did not run to its end.
    pub error: Option<String>,
    /// Where the energy went.
    pub energy: Option<Energy>,
    /// What the plant did.
    pub work: Option<WorkCounts>,
    /// How punctual it was, at hardware.
    pub real_time: Option<RealTime>,
    /// What is accepted in the scenario and most likely a mistake.
    pub warnings: Vec<Warned>,
    /// When the robot fell, if that was observed \[s\].
    pub fell_at_s: Option<f64>,
}

/// A warning, as it is written down.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Warned {
    /// A stable name of its kind.
    pub code: &'static str,
    /// What is most likely a mistake.
    pub message: String,
    /// The file, or the option of the command line.
    pub file: String,
    /// The line in it, counted from 1.
    pub line: Option<usize>,
}

impl Warned {
    /// Of warnings, in their order.
    pub(crate) fn all(warnings: &[Warning]) -> Vec<Self> {
        let warned = |Warning { code, problem }: &Warning| Self {
            code,
            message: problem.message.clone(),
            file: problem.file.clone(),
            line: problem.place.as_ref().map(Place::line),
        };
        warnings.iter().map(warned).collect()
    }
}

/// How a run at hardware went, as far as time is concerned.
#[derive(Clone, Debug)]
pub struct RealTime {
    /// How punctual it was.
    pub times: RealTimeReport,
    /// What kept it from being more so, with the remedies.
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

/// A histogram in four numbers \[s\].
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

/// The outcome of an expectation, as it is written down.
#[derive(Clone, Debug)]
pub struct Line(pub Outcome);

/// Where the energy of a run went \[J\].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Energy {
    /// What the books lack.
    pub residual_j: f64,
    /// Sum of the magnitudes of all transfers.
    pub exchanged_j: f64,
    /// What the actuators put in.
    pub actuator_j: f64,
    /// What friction took out.
    pub dissipated_j: f64,
    /// What impacts took out.
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

/// Seconds, the nearest number to those of `nanos`, which prints as briefly as it can: 0.498 and not 0.49800000000000005.
pub(crate) fn seconds(nanos: u64) -> f64 {
    nanos as f64 / 1e9
}

impl Line {
    /// The same for a recording.
    pub(crate) fn message(&self) -> ExpectationMessage {
        let outcome = &self.0;
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
}

impl Serialize for Line {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let outcome = &self.0;
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
        }
        .serialize(serializer)
    }
}

impl Report {
    /// The report of a scenario that did not come as far as to run.
    pub fn of_error(file: &str, error: String) -> Self {
        Self {
            scenario: file.to_owned(),
            verdict: Status::Error,
            seed: None,
            plant: None,
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
        }
    }

    /// How many expectations hold.
    pub fn held(&self) -> usize {
        let lines = self.expectations.iter();
        lines.filter(|line| line.0.holds()).count()
    }
}
