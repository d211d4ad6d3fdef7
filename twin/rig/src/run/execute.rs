//! Execution of runs in virtual time, with recording and report.

use twinrig_kernel::{SimTime, Snapshot, drawn_streams};

use crate::assembly::Assembly;
use crate::error::Error;
use crate::report::Report;
use crate::run::course::{Course, run};
use crate::run::execution::Execution;
use crate::run::hardware::HardwareRun;
use crate::run::judging::{observers, reference, report};
use crate::run::observers::{PolledOnly, RunObserver, RunProgress};
use crate::run::recording::recorder;
use crate::run::stopwatch::Stopwatch;

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
    HardwareRun::new(assembly, execution.clone())?.run(caller)
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
    let mut observers = observers(assembly, &rig, reference, recorder, caller);
    let progress = RunProgress {
        title: &assembly.scenario().name,
        now: SimTime::ZERO,
        end,
    };
    let stopwatch = Stopwatch::start();
    let mut saved = None;
    let mut ran = Ok(SimTime::ZERO);
    if let Some(at) = save_at {
        ran = run(assembly, &mut rig, &mut observers, &progress, at);
        // A fall may have ended the run earlier.
        let is_reached = ran.as_ref().is_ok_and(|reached| *reached >= at);
        saved = is_reached.then(|| rig.save());
    }
    let ran = ran.and_then(|_| run(assembly, &mut rig, &mut observers, &progress, end));
    let wall_s = stopwatch.elapsed_s();
    let course = Course::of(&rig, wall_s, ran);
    let report = report(assembly, execution, observers, course);
    Ok((report, saved))
}
