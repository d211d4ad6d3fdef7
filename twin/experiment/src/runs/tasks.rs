//! Tasks of an engine that are runs of a plan.

use std::path::Path;

use twinrig_campaign::engine::{Engine, EngineEvent, EngineOptions, EngineStatus, LocalEngine};
use twinrig_campaign::sweep::SweepRow;
use twinrig_document::suggestion;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;

use crate::error::Error;
use crate::runs::job::{PointResult, SweepJob};
use crate::runs::plan::RunPlan;

/// Engine of the Python package.
const PYTHON_ENGINE: &str = "ray";
/// Remedy where it is missing.
const PYTHON_HELP: &str = "`pip install \"twinrig[ray]\"` has a `twin` with it, whose workers have the standard parts; parts of your own crate run on the engine `local` only";

/// Returns the engine of that name.
pub(crate) fn engine<'r>(registry: &'r Registry, name: &str) -> Result<&'r dyn Engine, Error> {
    if name == LocalEngine::NAME {
        return Ok(&LocalEngine);
    }
    let engine = registry.engine(name);
    engine.ok_or_else(|| {
        let known = registry.engines().chain(std::iter::once(LocalEngine::NAME));
        Error::NoEngine {
            name: name.to_owned(),
            help: match name {
                PYTHON_ENGINE => PYTHON_HELP.to_owned(),
                _ => suggestion(name, "engines", known),
            },
        }
    })
}

/// Event of the tasks.
pub(crate) enum TaskEvent {
    /// The run of a point has ended.
    Done {
        /// Index of the point.
        point: usize,
        /// Its result.
        result: PointResult,
    },
    /// From time to time: the workers.
    Status(EngineStatus),
}

/// Runs of a plan that an engine does.
pub(crate) struct RunTasks<'t> {
    pub(crate) runs: &'t RunPlan<'t>,
    pub(crate) engine: &'t dyn Engine,
    pub(crate) options: &'t EngineOptions,
    /// Folder for a recording of each run, on the machine of the run.
    pub(crate) record: Option<&'t Path>,
}

impl RunTasks<'_> {
    /// Runs the points with these indices. An interrupt or an error of `observer` ends the work;
    /// the results up to then have reached `observer`.
    pub(crate) fn run(
        &self,
        points: &[usize],
        observer: &mut dyn FnMut(TaskEvent) -> Result<(), Error>,
    ) -> Result<EngineStatus, Error> {
        let job = SweepJob {
            runs: self.runs,
            record: self.record,
        };
        // Points whose workers did not survive, with the reason.
        let mut lost: Vec<(usize, String)> = Vec::new();
        let mut failed: Option<Error> = None;
        let ran = self.engine.run(&job, points, self.options, &mut |event| {
            if let Err(error) = event_of(event, &mut lost).map_or(Ok(()), &mut *observer) {
                failed.get_or_insert(error);
            }
            // Acknowledges an interrupt, upon which the workers end.
            !interrupt::is_requested() && failed.is_none()
        });
        if let Some(error) = failed {
            return Err(error);
        }
        let status = ran?;
        match lost.first() {
            None => Ok(status),
            Some((index, reason)) => Err(Error::LostRuns {
                count: lost.len(),
                name: self.runs.name(*index),
                reason: reason.clone(),
            }),
        }
    }
}

/// Returns the event of a task; none if it is lost.
fn event_of(event: EngineEvent, lost: &mut Vec<(usize, String)>) -> Option<TaskEvent> {
    let (point, result) = match event {
        EngineEvent::Status(status) => return Some(TaskEvent::Status(status)),
        EngineEvent::Lost { task, reason } => (task, Err(reason)),
        EngineEvent::Done { task, result } => match result {
            Ok(bytes) => (task, PointResult::read(&bytes)),
            Err(panic) => {
                let result = PointResult {
                    row: SweepRow::of_error(panic),
                    recording: None,
                };
                (task, Ok(result))
            }
        },
    };
    match result {
        Ok(result) => Some(TaskEvent::Done { point, result }),
        Err(reason) => {
            lost.push((point, reason));
            None
        }
    }
}
