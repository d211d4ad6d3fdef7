//! Execution of runs in virtual time, with recording and report.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use twinrig_kernel::{SimDuration, SimTime, Snapshot, drawn_streams};
use twinrig_record::VerdictMessage;
use twinrig_runtime::{
    BusSummary, EnergyBalance, LimitViolation, Rig, RigError, WorkCounts, catch_panic,
};

use crate::assembly::Assembly;
use crate::assembly::recording_size::LARGE_RECORDING;
use crate::error::Error;
use crate::report::{Line, Report, Status};
use crate::run::hardware;
use crate::run::interrupt;
use crate::run::judging::{judge, judged_report, reference, tracking};
use crate::run::observers::{PolledOnly, RunObserver, RunObservers, RunProgress};
use crate::run::recording::recorder;

/// Maximum simulated time between checks for interrupts, failed recordings and progress updates.
const SLICE: SimDuration = SimDuration::from_millis(100);
/// Maximum number of the shortest periods between these checks.
const SLICE_PERIODS: u64 = 4096;

/// Settings of the execution of a scenario.
#[derive(Clone, Debug, Default)]
pub struct Execution {
    /// Path of the recording; none: no recording.
    pub recording: Option<PathBuf>,
    /// Devices of the buses by bus name, for a run on hardware; empty: boards and plant are
    /// simulated.
    pub ports: Vec<(String, PathBuf)>,
    /// Whether a run with warnings fails, such as that of a bus with errors.
    pub strict: bool,
}

/// Runs `assembly`, and the reference run if an expectation requires one, with an observer of the
/// caller, and without the ensemble of the scenario.
///
/// # Errors
/// [`Error`] if the run cannot start. A run that starts and fails is reported in the
/// [`Report`].
pub fn execute_observed(
    assembly: &Assembly<'_>,
    execution: &Execution,
    caller: &mut dyn RunObserver,
) -> Result<Report, Error> {
    let end = assembly.end();
    if execution.ports.is_empty() {
        let ran = execute_saving(assembly, execution, end, None, Some(caller));
        return ran.map(|(report, _)| report);
    }
    if assembly.scenario().ensemble.is_some() {
        return Err(Error::InvalidOptions {
            why: "an `ensemble` has no runs on hardware".to_owned(),
            help: "remove `ensemble` from the scenario, or run without --port".to_owned(),
        });
    }
    hardware::execute(assembly, execution, caller)
}

/// Executes a run in virtual time, up to `end` at most.
///
/// # Errors
/// As [`execute_observed`].
pub fn execute_until(
    assembly: &Assembly<'_>,
    execution: &Execution,
    end: SimTime,
) -> Result<Report, Error> {
    execute_saving(assembly, execution, end, None, None).map(|(report, _)| report)
}

/// Executes a run in virtual time with an observer of the caller, up to `end` at most; also returns
/// the snapshot of the rig at `save_at` if the run reached it.
///
/// # Errors
/// As [`execute_observed`].
pub fn execute_saving(
    assembly: &Assembly<'_>,
    execution: &Execution,
    end: SimTime,
    save_at: Option<SimTime>,
    caller: Option<&mut dyn RunObserver>,
) -> Result<(Report, Option<Snapshot>), Error> {
    let (result, drawn) =
        drawn_streams(|| execute_drawing(assembly, execution, end, save_at, caller));
    result.map(|(report, saved)| {
        let random = Some(drawn);
        (Report { random, ..report }, saved)
    })
}

fn execute_drawing(
    assembly: &Assembly<'_>,
    execution: &Execution,
    end: SimTime,
    save_at: Option<SimTime>,
    mut caller: Option<&mut dyn RunObserver>,
) -> Result<(Report, Option<Snapshot>), Error> {
    let end = end.min(assembly.end());
    let polled = caller.as_mut().map(|caller| PolledOnly(&mut **caller));
    let reference = reference(assembly, end, polled)?;
    let mut rig = assembly.rig()?;
    let recorder = recorder(assembly, &rig, execution)?;
    let mut judge = judge(assembly, &rig);
    if let Some(reference) = reference {
        judge = judge.with_reference(&reference);
    }
    let observers = RunObservers::new(judge, recorder)
        .with_tracking(tracking(assembly, &rig))
        .with_tasks(&rig);
    let mut observers = observers.with_caller(caller, &rig);
    let progress = RunProgress {
        title: &assembly.scenario().name,
        now: SimTime::ZERO,
        end,
    };
    #[expect(
        clippy::disallowed_methods,
        reason = "the report contains the wall time"
    )]
    let started = Instant::now();
    let mut saved = None;
    let mut ran = Ok(SimTime::ZERO);
    if let Some(at) = save_at {
        ran = run(assembly, &mut rig, &mut observers, &progress, at);
        // A fall may have ended the run earlier.
        let is_reached = ran.as_ref().is_ok_and(|reached| *reached >= at);
        saved = is_reached.then(|| rig.save());
    }
    let ran = ran.and_then(|_| run(assembly, &mut rig, &mut observers, &progress, end));
    let wall_s = started.elapsed().as_secs_f64();
    let course = Course::of(&rig, wall_s, ran);
    let report = report(assembly, execution, observers, course);
    Ok((report, saved))
}

/// Result of a run apart from its observations.
pub struct Course {
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
    /// Traffic of the buses whose drivers are in a valid state.
    pub buses: Vec<BusSummary>,
    /// Limits that the plant and the commands have exceeded, if they are in a valid state.
    pub limits: Vec<LimitViolation>,
}

impl Course {
    /// Returns the result of a rig in virtual time after its run.
    pub fn of(rig: &Rig, wall_s: f64, ran: Result<SimTime, Stopped>) -> Self {
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
            buses: if is_valid { rig.buses() } else { Vec::new() },
            limits: if is_valid {
                let mut limits = rig.plant().limit_violations();
                limits.extend(rig.process().limit_violations());
                limits
            } else {
                Vec::new()
            },
        }
    }
}

/// Reason for the premature end of a run.
#[derive(Debug, thiserror::Error)]
pub enum Stopped {
    /// Interrupt by the user.
    #[error("{}", interrupt::message(*.0))]
    Interrupted(SimTime),
    /// Failure of a part.
    #[error(transparent)]
    Failed(Error),
    /// Panic of a part.
    #[error(transparent)]
    Panic(Error),
    /// End of the scenario before the start of control.
    #[error(
        "at {0} the devices were still being initialised, and control had not started\n  = help: increase `duration`"
    )]
    NotOpen(SimTime),
}

/// Evaluates a completed run, closes its recording and returns the report.
pub fn report<W: Write>(
    assembly: &Assembly<'_>,
    execution: &Execution,
    mut observers: RunObservers<'_, W>,
    course: Course,
) -> Report {
    let mut report = judged_report(assembly, &mut observers, &course);
    if execution.recording.is_none() {
        let warnings = &mut report.warnings;
        warnings.retain(|warning| warning.code != LARGE_RECORDING);
    }
    if execution.strict {
        report.make_strict();
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
            error = Some(Error::Record { path, source }.to_string());
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

/// Runs to `end`, to a fall that ends the run, to a regular end by the plant, or to a failure of
/// the recording; returns the time reached. The observers receive the `progress`.
///
/// # Errors
/// The reason of a premature end.
pub fn run<W: Write>(
    assembly: &Assembly<'_>,
    rig: &mut Rig,
    observers: &mut RunObservers<'_, W>,
    progress: &RunProgress<'_>,
    end: SimTime,
) -> Result<SimTime, Stopped> {
    let ran = catch_panic(|| run_in_slices(assembly, rig, observers, progress, end));
    ran.unwrap_or_else(|source| {
        let file = assembly.scenario().file.clone();
        Err(Stopped::Panic(Error::Panic { file, source }))
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
    observers: &mut RunObservers<'_, W>,
    progress: &RunProgress<'_>,
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
        observers.poll(&RunProgress {
            now: rig.now(),
            ..*progress
        });
        let ran = rig.run_until(now, observers);
        if interrupt::is_requested() {
            // Takes precedence over other errors.
            return Err(Stopped::Interrupted(rig.now()));
        }
        if let Err(RigError::Plant(fault)) = &ran
            && rig.plant().has_ended()
        {
            observers.end_at(fault.time);
            return Ok(fault.time);
        }
        ran.map_err(|error| Stopped::Failed(assembly.rig_error(error)))?;
        if observers.is_broken() {
            // Closing the recording returns the error.
            return Ok(now);
        }
    }
    if !rig.is_open() {
        return Err(Stopped::NotOpen(end));
    }
    Ok(end)
}
