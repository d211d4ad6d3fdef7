//! Execution of runs in virtual time, with recording and report.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use twinrig_kernel::{SimDuration, SimTime, Snapshot};
use twinrig_record::{
    Cadence, RecordedGroup, Recorder, RunInfo, Skeleton, SkeletonLeg, VerdictMessage,
};
use twinrig_runtime::{EnergyBalance, Group, Rig, WorkCounts, catch_panic};
use twinrig_scenario::Setting;

use crate::assembly::Assembly;
use crate::assembly::sources::{ROBOT_FILE, SCENARIO_FILE};
use crate::error::TwinError;
use crate::report::{Line, Report, Status, seconds};
use crate::run::executor::Executor;
use crate::run::hardware;
use crate::run::interrupt;
use crate::run::judging::{judge, judged_report, reference};
use crate::run::observers::RunObservers;
use crate::run::progress::Progress;
use crate::run::recording_size::LARGE_RECORDING;

/// Maximum simulated time between checks for interrupts, failed recordings and progress updates.
const SLICE: SimDuration = SimDuration::from_millis(100);
/// Maximum number of the shortest periods between these checks.
const SLICE_PERIODS: u64 = 4096;
/// Simulated time between flushes of the recording; flushed data survive a crash.
const FLUSH: SimDuration = SimDuration::from_secs(1);

/// Metadata key of a recording: settings of the run.
pub(crate) const SETTINGS_NOTE: &str = "settings";
/// Metadata key of the rules for values that the scenario leaves open, and their present version.
pub(crate) const DEFAULTS_NOTE: &str = "defaults";
const DEFAULTS: &str = "2";

/// Metadata key of a recording made on hardware.
pub(crate) const HARDWARE_NOTE: &str = "at_hardware";

/// Metadata key of a recording with an exchanged plant: time of the exchange \[s\].
pub(crate) const EXCHANGED_NOTE: &str = "exchanged_at_s";

/// Settings of the execution of a scenario.
#[derive(Clone, Debug, Default)]
pub struct Execution {
    /// Path of the recording; none: no recording.
    pub recording: Option<PathBuf>,
    /// Whether to show the progress, if standard error is a terminal.
    pub progress: bool,
    /// Devices of the buses by bus name, for a run on hardware; empty: boards and plant are
    /// simulated.
    pub ports: Vec<(String, PathBuf)>,
}

/// Runs `assembly`, and the reference run if an expectation requires one.
///
/// # Errors
/// [`TwinError`] if the run cannot start. A run that starts and fails is reported in the
/// [`Report`].
pub fn execute(assembly: &Assembly<'_>, execution: &Execution) -> Result<Report, TwinError> {
    if execution.ports.is_empty() {
        execute_until(assembly, execution, assembly.end())
    } else {
        hardware::execute(assembly, execution)
    }
}

/// Executes a run in virtual time, up to `end` at most.
pub(crate) fn execute_until(
    assembly: &Assembly<'_>,
    execution: &Execution,
    end: SimTime,
) -> Result<Report, TwinError> {
    execute_saving(assembly, execution, end, None).map(|(report, _)| report)
}

/// Executes a run in virtual time, up to `end` at most; also returns the snapshot of the rig at
/// `save_at` if the run reached it.
pub(crate) fn execute_saving(
    assembly: &Assembly<'_>,
    execution: &Execution,
    end: SimTime,
    save_at: Option<SimTime>,
) -> Result<(Report, Option<Snapshot>), TwinError> {
    let end = end.min(assembly.end());
    let reference = reference(assembly, execution, end)?;
    let mut rig = assembly.rig()?;
    let recorder = recorder(assembly, &rig, execution)?;
    let mut judge = judge(assembly, &rig);
    if let Some(reference) = reference {
        judge = judge.with_reference(&reference);
    }
    let mut observers = RunObservers::new(judge, recorder);
    let title = &assembly.scenario().name;
    let mut progress = Progress::new(title, end.as_secs_f64(), execution.progress);
    #[expect(
        clippy::disallowed_methods,
        reason = "the report contains the wall time"
    )]
    let started = Instant::now();
    let mut saved = None;
    let mut ran = Ok(SimTime::ZERO);
    if let Some(at) = save_at {
        ran = run(assembly, &mut rig, &mut observers, &mut progress, at);
        // A fall may have ended the run earlier.
        let is_reached = ran.as_ref().is_ok_and(|reached| *reached >= at);
        saved = is_reached.then(|| rig.save());
    }
    let ran = ran.and_then(|_| run(assembly, &mut rig, &mut observers, &mut progress, end));
    let wall_s = started.elapsed().as_secs_f64();
    drop(progress);
    let course = Course::of(&rig, wall_s, ran);
    let report = report(assembly, execution, observers, course);
    Ok((report, saved))
}

/// Result of a run apart from its observations.
pub(crate) struct Course {
    /// Simulated time at the end of the run.
    pub reached: SimTime,
    /// Wall time of the run \[s\].
    pub wall_s: f64,
    /// Error that ended the run prematurely.
    pub error: Option<String>,
    /// Whether a plant was simulated.
    pub simulated: bool,
    /// Energy balance and work counts of the plant, if it is in a valid state.
    pub plant: Option<(EnergyBalance, WorkCounts)>,
}

impl Course {
    /// Returns the result of a rig in virtual time after its run.
    pub(crate) fn of(rig: &Rig, wall_s: f64, ran: Result<SimTime, Stopped>) -> Self {
        let (reached, stopped) = match ran {
            Ok(reached) => (reached, None),
            Err(stopped) => (rig.now(), Some(stopped)),
        };
        // After a panic the state of the parts is invalid.
        let is_valid = !matches!(stopped, Some(Stopped::Panic(_)));
        Self {
            reached,
            wall_s,
            error: stopped.map(|stopped| stopped.to_string()),
            simulated: true,
            plant: is_valid.then(|| (rig.plant().energy(), rig.plant().work())),
        }
    }
}

/// Reason for the premature end of a run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Stopped {
    /// Interrupt by the user.
    #[error("interrupted at {0}")]
    Interrupted(SimTime),
    /// Failure of a part.
    #[error(transparent)]
    Failed(TwinError),
    /// Panic of a part.
    #[error(transparent)]
    Panic(TwinError),
    /// End of the scenario before the start of control.
    #[error(
        "at {0} the devices were still being initialised, and control had not started\n  = help: increase `duration`"
    )]
    NotOpen(SimTime),
}

/// Evaluates a completed run, closes its recording and returns the report.
pub(crate) fn report<W: Write>(
    assembly: &Assembly<'_>,
    execution: &Execution,
    mut observers: RunObservers<W>,
    course: Course,
) -> Report {
    let mut report = judged_report(assembly, &mut observers, &course);
    if execution.recording.is_none() {
        let warnings = &mut report.warnings;
        warnings.retain(|warning| warning.code != LARGE_RECORDING);
    }
    let (reached, mut error) = (course.reached, course.error);
    let status = if error.is_some() {
        Status::Error
    } else {
        report.verdict
    };
    // Without wall times, so that equal runs have identical files.
    let verdict = VerdictMessage {
        verdict: status.key().to_owned(),
        interrupted: error.is_some() && interrupt::is_requested(),
        error: error.clone(),
        expectations: report.expectations.iter().map(Line::message).collect(),
    };
    let path = execution.recording.as_deref();
    match (observers.close(reached, &verdict), path) {
        (Ok(_), path) => report.recording = path.map(|path| path.display().to_string()),
        (Err(source), path) => {
            let path = path.map_or_else(PathBuf::new, Path::to_owned);
            error = Some(TwinError::Record { path, source }.to_string());
        }
    }
    if error.is_some() {
        report.verdict = Status::Error;
        report.error = error;
    }
    report
}

/// Returns the first multiple of `period` after `now`; none on overflow.
fn next_multiple(now: SimTime, period: SimDuration) -> Option<SimTime> {
    let count = now.as_nanos() / period.as_nanos().max(1);
    let next = period.checked_mul(count.checked_add(1)?)?;
    SimTime::ZERO.checked_add(next)
}

/// Runs to `end`, to a fall that ends the run, or to a failure of the recording; returns the time
/// reached.
pub(crate) fn run<W: Write>(
    assembly: &Assembly<'_>,
    rig: &mut Rig,
    observers: &mut RunObservers<W>,
    progress: &mut Progress,
    end: SimTime,
) -> Result<SimTime, Stopped> {
    let ran = catch_panic(|| run_in_slices(assembly, rig, observers, progress, end));
    ran.unwrap_or_else(|source| {
        let file = assembly.scenario().file.clone();
        Err(Stopped::Panic(TwinError::Panic { file, source }))
    })
}

/// Returns the simulated time between checks for interrupts and progress updates.
fn slice(assembly: &Assembly<'_>) -> SimDuration {
    let observe = assembly.scenario().observe.period;
    let shortest = assembly.period().min(observe).as_nanos();
    let nanos = shortest.max(1).saturating_mul(SLICE_PERIODS);
    SLICE.min(SimDuration::from_nanos(nanos))
}

fn run_in_slices<W: Write>(
    assembly: &Assembly<'_>,
    rig: &mut Rig,
    observers: &mut RunObservers<W>,
    progress: &mut Progress,
    end: SimTime,
) -> Result<SimTime, Stopped> {
    let slice = slice(assembly);
    let mut now = rig.now();
    let scenario = assembly.scenario();
    // A fall ends the run at the observation that detects it.
    let observation = scenario
        .ends_with_a_fall()
        .then_some(scenario.observe.period);
    while now < end {
        if observers.ended_at().is_some() {
            return Ok(now);
        }
        let next = now.checked_add(slice).map_or(end, |next| next.min(end));
        let observed = observation.and_then(|period| next_multiple(now, period));
        now = observed.map_or(next, |observed| observed.min(next));
        let ran = rig.run_until(now, observers);
        if interrupt::is_requested() {
            // Takes precedence over other errors.
            return Err(Stopped::Interrupted(rig.now()));
        }
        ran.map_err(|error| Stopped::Failed(assembly.rig_error(error)))?;
        if observers.is_broken() {
            // Closing the recording returns the error.
            return Ok(now);
        }
        progress.at(now.as_secs_f64());
    }
    if !rig.is_open() {
        return Err(Stopped::NotOpen(end));
    }
    Ok(end)
}

/// Creates the recording of a run, if requested.
pub(crate) fn recorder(
    assembly: &Assembly<'_>,
    executor: &dyn Executor,
    execution: &Execution,
) -> Result<Option<Recorder<BufWriter<File>>>, TwinError> {
    let path = execution.recording.as_deref();
    path.map(|path| create(assembly, executor, path))
        .transpose()
}

fn create(
    assembly: &Assembly<'_>,
    executor: &dyn Executor,
    path: &Path,
) -> Result<Recorder<BufWriter<File>>, TwinError> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|source| TwinError::Write {
            path: folder.to_owned(),
            source,
        })?;
    }
    let scene = assembly.scene();
    let keep = |name: &str| scene.recorded.iter().any(|other| other == name);
    let group = |group| RecordedGroup {
        group,
        layout: executor.layout(group),
        keep: &keep,
    };
    let groups = [
        group(Group::Plant),
        group(Group::ProcessInputs),
        group(Group::ProcessOutputs),
    ];
    let diagnostics = group(Group::Diagnostics);
    let groups = groups.into_iter();
    let groups: Vec<_> = groups
        .chain((!diagnostics.layout.is_empty()).then_some(diagnostics))
        .collect();
    let cadence = Cadence {
        frames: scene
            .scenario
            .record
            .frames
            .and_then(|rate| SimDuration::try_from_secs_f64(1.0 / rate)),
        flush: FLUSH,
    };
    Recorder::create(
        path,
        &info(assembly, executor),
        &groups,
        &skeleton(assembly),
        cadence,
    )
    .map_err(|source| TwinError::Record {
        path: path.to_owned(),
        source,
    })
}

fn info(assembly: &Assembly<'_>, executor: &dyn Executor) -> RunInfo {
    let scenario = assembly.scenario();
    let robot = assembly.robot_file();
    let settings: Vec<[&str; 2]> = scenario.settings.iter().map(pair).collect();
    let notes = [
        ("scenario", scenario.name.clone()),
        ("scenario_file", scenario.file.clone()),
        (
            "robot_file",
            robot.map_or_else(String::new, |(file, _)| file.to_owned()),
        ),
        ("plant", scenario.plant.model.clone()),
        (DEFAULTS_NOTE, DEFAULTS.to_owned()),
        // Pairs of strings can always be serialised.
        (
            SETTINGS_NOTE,
            serde_json::to_string(&settings).unwrap_or_default(),
        ),
    ];
    let on_hardware = executor
        .on_hardware()
        .then(|| (HARDWARE_NOTE, "true".to_owned()));
    let mut files = vec![(SCENARIO_FILE.to_owned(), scenario.text.clone().into_bytes())];
    files.extend(robot.map(|(_, text)| (ROBOT_FILE.to_owned(), text.as_bytes().to_vec())));
    files.extend(assembly.body().files());
    let exchanged = executor.exchanged();
    let exchanged = exchanged.map(|at| (EXCHANGED_NOTE, seconds(at.as_nanos()).to_string()));
    RunInfo {
        files,
        seed: scenario.seed,
        build: concat!("twinrig ", env!("CARGO_PKG_VERSION")).to_owned(),
        notes: notes
            .into_iter()
            .chain(on_hardware)
            .chain(exchanged)
            .map(|(key, value)| (key.to_owned(), value))
            .collect(),
        tasks: executor.tasks(),
        variables: executor.variables(),
        traces: if scenario.record.bytes {
            executor.traces().to_vec()
        } else {
            Vec::new()
        },
    }
}

fn pair(setting: &Setting) -> [&str; 2] {
    [&setting.key, &setting.value]
}

fn skeleton(assembly: &Assembly<'_>) -> Skeleton {
    let mounts = assembly.robot().map_or(&[][..], |robot| &robot.legs);
    let legs = mounts.iter().map(|mount| SkeletonLeg {
        name: mount.name.clone(),
        hip: mount.hip,
        segments: [mount.leg.l1, mount.leg.l2, mount.leg.l3 - mount.leg.l_delta],
    });
    Skeleton {
        legs: legs.collect(),
    }
}
