//! Evaluation of expectations: from the observations of a run to its report.

use std::io::Write;
use std::path::{Path, PathBuf};

use twinrig_kernel::SimTime;
use twinrig_record::{RecordError, Recorder, VerdictMessage};
use twinrig_runtime::{Group, Rig};
use twinrig_scenario::{
    Expectation, FaultSpec, Judge, Layouts, Outcome, Reference, RunEnd, Scenario, Tracking, Verdict,
};

use crate::assembly::Assembly;
use crate::assembly::buses::idle_faults;
use crate::assembly::recording_size::LARGE_RECORDING;
use crate::error::Error;
use crate::report::buses::skips;
use crate::report::{
    BUS_WARNING, BusReport, FAULT_WARNING, LIMIT_WARNING, Line, Report, Status, WarningEntry,
    seconds,
};
use crate::run::course::{Course, Stopped, run};
use crate::run::execution::Execution;
use crate::run::executor::Executor;
use crate::run::interrupt;
use crate::run::observers::{PolledOnly, RunObserver, RunObservers, RunProgress};

/// Returns the judge of a run of `executor`.
pub fn judge(assembly: &Assembly<'_>, executor: &dyn Executor) -> Judge {
    with_layouts(executor, |layouts| Judge::new(assembly.scene(), *layouts))
}

/// Returns the observers of a run of `rig`: judge, recorder, tracking, tasks and the caller's.
pub(crate) fn observers<'c, W: Write>(
    assembly: &Assembly<'_>,
    rig: &Rig,
    reference: Option<Reference>,
    recorder: Option<Recorder<W>>,
    caller: Option<&'c mut dyn RunObserver>,
) -> RunObservers<'c, W> {
    let mut judge = judge(assembly, rig);
    if let Some(reference) = reference {
        judge = judge.with_reference(&reference);
    }
    let observers = RunObservers::new(judge, recorder)
        .with_tracking(tracking(assembly, rig))
        .with_tasks(rig);
    observers.with_caller(caller, rig)
}

/// Returns the observer of how a run of `executor` follows its commands; none if the controller
/// commands no leg.
pub(crate) fn tracking(assembly: &Assembly<'_>, executor: &dyn Executor) -> Option<Tracking> {
    with_layouts(executor, |layouts| {
        Tracking::new(assembly.scene(), layouts, assembly.gait())
    })
}

fn with_layouts<T>(executor: &dyn Executor, of: impl FnOnce(&Layouts<'_>) -> T) -> T {
    of(&Layouts {
        plant: executor.layout(Group::Plant),
        process_inputs: executor.layout(Group::ProcessInputs),
        process_outputs: executor.layout(Group::ProcessOutputs),
        diagnostics: executor.layout(Group::Diagnostics),
        tasks: &executor.tasks(),
    })
}

/// Executes the reference run without changes; none if no expectation requires it.
///
/// # Errors
/// It cannot start, or a part panics.
pub fn reference(
    assembly: &Assembly<'_>,
    end: SimTime,
    mut polled: Option<PolledOnly<'_>>,
) -> Result<Option<Reference>, Error> {
    if !assembly.scenario().needs_reference() {
        return Ok(None);
    }
    let without = assembly.without_changes();
    let mut rig = without.rig()?;
    // The judge uses the expectations of the run with changes, which select the footsteps.
    let caller = polled.as_mut().map(|polled| polled as &mut dyn RunObserver);
    let observers: RunObservers<'_, Vec<u8>> = RunObservers::new(judge(assembly, &rig), None);
    let mut observers = observers.with_caller(caller, &rig);
    let progress = RunProgress {
        title: &format!("{}, without changes", assembly.scenario().name),
        now: SimTime::ZERO,
        end,
    };
    // Expectations beyond the end of the reference fail as unobserved.
    let ran = run(&without, &mut rig, &mut observers, &progress, end);
    if let Err(Stopped::Panic(error)) = ran {
        return Err(error);
    }
    let _ = observers.judge(&RunEnd {
        at: rig.now(),
        energy: None,
        work: None,
        real_time_factor: None,
        buses: &[],
    });
    Ok(Some(observers.reference()))
}

/// Returns the reports of the buses, and warnings about those that are not clean and about tasks
/// without a bus whose transfers are too long.
fn buses(
    assembly: &Assembly<'_>,
    skipped: &[(String, u64)],
    course: &Course,
) -> (Vec<BusReport>, Vec<WarningEntry>) {
    let scenario = assembly.scenario();
    let warned = |bus: Option<&str>, message| WarningEntry {
        code: BUS_WARNING,
        message,
        file: scenario.file.clone(),
        line: bus.and_then(|bus| Some(scenario.bus(bus)?.name.place.line())),
    };
    let of_bus = |name: &str| course.buses.iter().any(|bus| bus.name == name);
    let reports = course.buses.iter().map(|bus| BusReport {
        bus: bus.clone(),
        skipped: skipped
            .iter()
            .find(|(task, _)| *task == bus.name)
            .map_or(0, |(_, count)| *count),
    });
    let reports: Vec<BusReport> = reports.collect();
    let unclean = reports.iter();
    let unclean = unclean.filter_map(|bus| Some(warned(Some(&bus.bus.name), bus.warning()?)));
    let direct = skipped
        .iter()
        .filter(|(task, count)| *count > 0 && !of_bus(task));
    let direct = direct.map(|(task, count)| warned(None, skips(task, *count)));
    let idle = course.buses.iter().flat_map(|bus| {
        let idle = idle_faults(scenario, &bus.name, &bus.health);
        idle.into_iter().map(|(number, fault)| WarningEntry {
            code: FAULT_WARNING,
            message: without_effect(number, fault),
            file: scenario.file.clone(),
            line: Some(fault.on.place.line()),
        })
    });
    let warnings = unclean.chain(direct).chain(idle).collect();
    (reports, warnings)
}

/// Returns the message about a fault that harmed nothing.
fn without_effect(number: usize, fault: &FaultSpec) -> String {
    let select = &fault.select;
    let phase = select.phase.map(|phase| format!("phase {}", phase.name()));
    let direction = select
        .direction
        .map(|it| format!("direction {}", it.name()));
    let frames = select.frames.as_ref().map(|it| format!("on_frame = {it}"));
    let parts: Vec<String> = [direction, phase, frames].into_iter().flatten().collect();
    let harmed = if select.frames.is_some() {
        "frame"
    } else {
        "byte"
    };
    let (kind, on) = (fault.kind.name(), &fault.on.value);
    let selected = if parts.is_empty() {
        String::new()
    } else {
        format!(", {}", parts.join(", "))
    };
    format!("fault {number} harmed no {harmed}: {kind} on {on}{selected}")
}

/// Returns the lines of a report, with those marked that the end of the run left unobserved.
fn lines(outcomes: Vec<Outcome>, scenario: &Scenario, course: &Course) -> Vec<Line> {
    let lines = outcomes.into_iter().zip(&scenario.expectations);
    let line = |(outcome, expectation): (Outcome, &Expectation)| {
        let reaches_beyond = expectation
            .before
            .is_none_or(|before| before > course.reached);
        let is_unobserved = outcome.verdict == Verdict::Unobserved;
        Line {
            cut_short: course.error.is_some() && is_unobserved && reaches_beyond,
            ..Line::of(outcome)
        }
    };
    lines.map(line).collect()
}

/// Evaluates a completed run and returns its report.
pub(crate) fn judged_report<W: Write>(
    assembly: &Assembly<'_>,
    observers: &mut RunObservers<'_, W>,
    course: &Course,
) -> Report {
    let scenario = assembly.scenario();
    let (energy, work) = course.plant.unzip();
    let simulated_s = seconds(course.reached.as_nanos());
    let wall_s = course.wall_s;
    let real_time_factor = (wall_s > 0.0).then(|| simulated_s / wall_s);
    let outcomes = observers.judge(&RunEnd {
        at: course.reached,
        energy,
        work,
        real_time_factor,
        buses: &course.buses,
    });
    // A fall that ends the run is a failure regardless of the expectations.
    let pass = outcomes.iter().all(Outcome::holds) && observers.ended_at().is_none();
    let (buses, of_buses) = buses(assembly, observers.skipped(), course);
    let mut warnings = WarningEntry::all(&scenario.warnings);
    warnings.extend(of_buses);
    warnings.extend(course.limits.iter().map(|violation| WarningEntry {
        code: LIMIT_WARNING,
        message: violation.to_string(),
        file: scenario.file.clone(),
        line: None,
    }));
    let fell_at = observers.fell_at().or(observers.ended_at());
    Report {
        scenario: scenario.name.clone(),
        verdict: if pass { Status::Pass } else { Status::Fail },
        seed: Some(scenario.seed),
        plant: course.simulated.then(|| scenario.plant.model.clone()),
        constraints: course.simulated.then(|| assembly.constraints()).flatten(),
        fingerprint: Some(observers.digest().to_string()),
        simulated_s: Some(simulated_s),
        wall_s: Some(wall_s),
        real_time_factor,
        expectations: lines(outcomes, scenario, course),
        left_out: assembly.scene().left_out.clone(),
        recording: None,
        file: scenario.file.clone(),
        error: None,
        energy: energy.map(Into::into),
        work,
        real_time: None,
        warnings,
        fell_at_s: fell_at.map(|at| seconds(at.as_nanos())),
        tracking: observers.tracking(),
        buses,
        random: None,
        strict: None,
        against: None,
        page: None,
    }
}

/// Evaluates a completed run, closes its recording and returns the report.
pub fn report<W: Write>(
    assembly: &Assembly<'_>,
    execution: &Execution,
    observers: RunObservers<'_, W>,
    course: Course,
) -> Report {
    let (mut report, written) = closed(assembly, execution, observers, course);
    let path = execution.recording.as_deref();
    match written {
        Ok(_) => report.recording = path.map(|path| path.display().to_string()),
        Err(source) => {
            let path = path.map_or_else(PathBuf::new, Path::to_owned);
            report.verdict = Status::Error;
            report.error = Some(Error::Record { path, source }.to_string());
        }
    }
    report
}

/// Evaluates a completed run and closes its recording; returns the report and what the recording
/// was written to.
pub(crate) fn closed<W: Write>(
    assembly: &Assembly<'_>,
    execution: &Execution,
    mut observers: RunObservers<'_, W>,
    course: Course,
) -> (Report, Result<Option<W>, RecordError>) {
    let mut report = judged_report(assembly, &mut observers, &course);
    if execution.recording.is_none() {
        let warnings = &mut report.warnings;
        warnings.retain(|warning| warning.code != LARGE_RECORDING);
    }
    if execution.strict {
        report.make_strict();
    }
    if course.error.is_some() {
        report.verdict = Status::Error;
        report.error = course.error;
    }
    // Without wall times, so that equal runs have identical files.
    let verdict = VerdictMessage {
        verdict: report.verdict.key().to_owned(),
        interrupted: report.error.is_some() && interrupt::is_requested(),
        error: report.error.clone(),
        expectations: report.expectations.iter().map(Line::message).collect(),
    };
    let written = observers.close(course.reached, &verdict);
    (report, written)
}
