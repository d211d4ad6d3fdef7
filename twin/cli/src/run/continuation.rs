//! A run that goes on, with another plant, from where a rig was saved.

use std::time::Instant;

use twinrig_kernel::{SimTime, Snapshot};

use crate::assembly::Assembly;
use crate::error::TwinError;
use crate::report::Report;
use crate::run::execute::{self, Course, Execution};
use crate::run::judging;
use crate::run::observers::RunObservers;
use crate::run::progress::Progress;

/// What became of it.
pub(crate) struct Continuation {
    /// Books, work, recording and fingerprint are those from the exchange on. Nothing is judged: expectations are of whole
    /// runs, and half of this one is another plant's.
    pub report: Report,
    /// What the plant could not take over, a line each.
    pub lost: Vec<String>,
}

/// Restores the rig of `first`, puts the plant of `other` in the place of its own, and goes on to the end. Controller, tasks,
/// boards and the changes that are due are those of the rig that was saved.
///
/// # Errors
/// [`TwinError`] if the plant cannot take that place, or the recording cannot be begun. A run that goes on and does not end is
/// a report, too.
pub(crate) fn go_on(
    first: &Assembly<'_>,
    other: &Assembly<'_>,
    saved: &Snapshot,
    execution: &Execution,
) -> Result<Continuation, TwinError> {
    let mut rig = first.rig()?;
    rig.restore(saved).map_err(|error| first.rig_error(error))?;
    let lost = rig.exchange_plant(other.parts()?.plant);
    let lost = lost.map_err(|error| other.rig_error(error))?;
    let unjudged = other.without_changes();
    let end: SimTime = other.end();
    let recorder = execute::recorder(other, &rig, execution)?;
    let mut observers = RunObservers::new(judging::judge(&unjudged, &rig), recorder);
    let scenario = other.scenario();
    let title = format!("{}, {} from here on", scenario.name, scenario.plant.model);
    let mut progress = Progress::new(&title, end.as_secs_f64(), execution.progress);
    #[expect(
        clippy::disallowed_methods,
        reason = "the report says how long it took"
    )]
    let started = Instant::now();
    let ran = execute::run(other, &mut rig, &mut observers, &mut progress, end);
    let wall_s = started.elapsed().as_secs_f64();
    drop(progress);
    let course = Course::of(&rig, wall_s, ran);
    let report = execute::report(&unjudged, execution, observers, course);
    Ok(Continuation { report, lost })
}
