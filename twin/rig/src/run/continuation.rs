//! Continuation of a saved run with another plant.

use twinrig_kernel::{SimTime, Snapshot};

use crate::assembly::Assembly;
use crate::error::Error;
use crate::report::Report;
use crate::run::course::{Course, run};
use crate::run::execution::Execution;
use crate::run::judging;
use crate::run::observers::{RunObserver, RunObservers, RunProgress};
use crate::run::recording::recorder;
use crate::run::stopwatch::Stopwatch;

/// Result of a continuation.
pub struct Continuation {
    /// Report whose energy balance, work counts, recording and fingerprint start at the exchange of
    /// the plant. No expectation is evaluated: expectations apply to complete runs of one plant.
    pub report: Report,
    /// Parts of the state that the plant could not resume, one line each.
    pub lost: Vec<String>,
}

/// Restores the rig of `first`, replaces its plant by the plant of `other`, and runs to the end.
/// Controller, tasks, boards and pending changes are those of the saved rig.
///
/// # Errors
/// [`Error`] if the plant cannot resume from the saved state, or the recording cannot be
/// created. A run that starts and fails is reported in the [`Report`].
pub fn resume_with_plant(
    first: &Assembly<'_>,
    other: &Assembly<'_>,
    saved: &Snapshot,
    execution: &Execution,
    caller: &mut dyn RunObserver,
) -> Result<Continuation, Error> {
    let mut rig = first.rig()?;
    rig.restore(saved).map_err(|error| first.rig_error(error))?;
    let lost = rig.replace_plant(other.parts()?.plant);
    let lost = lost.map_err(|error| other.rig_error(error))?;
    let unjudged = other.without_changes();
    let end: SimTime = other.end();
    let recorder = recorder(other, &rig, execution)?;
    let observers = RunObservers::new(judging::judge(&unjudged, &rig), recorder);
    let mut observers = observers.with_caller(Some(caller), &rig);
    let scenario = other.scenario();
    let progress = RunProgress {
        title: &format!("{}, continued with {}", scenario.name, scenario.plant.model),
        now: rig.now(),
        end,
    };
    let stopwatch = Stopwatch::start();
    let ran = run(other, &mut rig, &mut observers, &progress, end);
    let wall_s = stopwatch.elapsed_s();
    let course = Course::of(&rig, wall_s, ran);
    let report = judging::report(&unjudged, execution, observers, course);
    Ok(Continuation { report, lost })
}
