//! Missing runs of a campaign: an engine does them, and their rows go to disk.
//!
//! Sweeps, optimizations, radii and rounds of studies share this loop. Each has a `RowStore` whose
//! rows `R` are on disk and have a value `T` in memory: a summary, costs, an outcome of
//! expectations, or the result itself. `StoredRuns::missing` gives the runs without a row,
//! `Workers::run` has an engine do them, appends the rows, and reads those that other processes
//! have added; what else follows from a row is the reaction of the caller.

use std::collections::BTreeSet;

use serde::Serialize;
use serde::de::DeserializeOwned;
use twinrig_campaign::engine::{
    Engine, EngineEvent, EngineOptions, EngineStatus, Job, LocalEngine,
};
use twinrig_campaign::sweep::{RowKey, RowStore};
use twinrig_document::suggestion;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;

use crate::error::Error;
use crate::options::run::EngineArgs;
use crate::runs::recordings::{RecordingList, RecordingPlace};

/// Engine of the Python package.
const PYTHON_ENGINE: &str = "ray";
/// Remedy where it is missing.
const PYTHON_HELP: &str = "`pip install \"twinrig[ray]\"` has a `twin` with it, whose workers have the standard parts; parts of your own crate run on the engine `local` only";

/// Runs that are the tasks of a job.
pub(crate) trait StoredRuns: Job + Sized {
    /// Row of a run on disk.
    type Row: Serialize + DeserializeOwned;

    /// Returns the key of the row of a run.
    fn key(&self, run: usize) -> RowKey;

    /// Returns the name of a run in messages.
    fn name(&self, run: usize) -> String;

    /// Returns the row in the bytes of a worker, or the one of a panic, and where a recording is.
    /// An error is the reason for which there is no row.
    fn row(
        &self,
        result: Result<Vec<u8>, String>,
    ) -> Result<(Self::Row, Option<RecordingPlace>), String>;

    /// Returns the runs among these whose rows the store lacks, the first of equal ones.
    fn missing<T>(
        &self,
        among: impl Iterator<Item = usize>,
        store: &RowStore<T, Self::Row>,
    ) -> Vec<usize> {
        let mut keys = BTreeSet::new();
        among
            .filter(|&run| store.get(&self.key(run)).is_none() && keys.insert(self.key(run)))
            .collect()
    }
}

/// Event of the runs; a row has a value `T` in memory.
pub(crate) enum TaskEvent<'e, T> {
    /// A run has ended, and its row is on disk.
    Done {
        /// Number of the run.
        run: usize,
        value: &'e T,
    },
    /// From time to time: the workers.
    Status(EngineStatus),
}

/// Runs that have ended without an error of the campaign.
pub(crate) struct EndedRuns {
    /// Their number; fewer than the missing ones after an interrupt.
    pub(crate) done: usize,
    pub(crate) workers: EngineStatus,
}

/// Engine of a campaign.
pub(crate) struct Workers<'e> {
    pub(crate) engine: &'e dyn Engine,
    pub(crate) options: EngineOptions,
    /// List of the recordings; none where nothing is recorded.
    pub(crate) recordings: Option<RecordingList>,
}

impl<'e> Workers<'e> {
    /// Returns the engine that the arguments name.
    pub(crate) fn new(registry: &'e Registry, args: &EngineArgs) -> Result<Self, Error> {
        Ok(Self {
            engine: engine(registry, &args.engine)?,
            options: args.options(),
            recordings: None,
        })
    }

    /// Does the missing runs and keeps their rows, and then reads those that other processes have
    /// added meanwhile. An interrupt, an error, or `observer` by returning false, ends the work;
    /// the rows up to then are on disk.
    ///
    /// # Errors
    /// Errors of engine and store, [`Error::LostRuns`].
    pub(crate) fn run<J: StoredRuns, T>(
        &mut self,
        runs: &J,
        missing: &[usize],
        store: &mut RowStore<T, J::Row>,
        observer: &mut dyn FnMut(TaskEvent<'_, T>) -> bool,
    ) -> Result<EndedRuns, Error> {
        // Runs whose workers did not survive, with the reason.
        let mut lost: Vec<(usize, String)> = Vec::new();
        let mut failed = None;
        let mut done = 0;
        let recordings = &mut self.recordings;
        let mut keep = |event| -> Result<bool, Error> {
            let (run, result) = match event {
                EngineEvent::Status(status) => return Ok(observer(TaskEvent::Status(status))),
                EngineEvent::Lost { task, reason } => (task, Err(reason)),
                EngineEvent::Done { task, result } => (task, runs.row(result)),
            };
            let (row, recording) = match result {
                Ok(found) => found,
                Err(reason) => {
                    lost.push((run, reason));
                    return Ok(true);
                }
            };
            let key = runs.key(run);
            if let Some((list, place)) = recordings.as_mut().zip(recording) {
                list.append(key, &place)?;
            }
            let value = store.append(key, row)?;
            done += 1;
            Ok(observer(TaskEvent::Done { run, value }))
        };
        let ran = self.engine.run(runs, missing, &self.options, &mut |event| {
            let continues = keep(event).unwrap_or_else(|error| {
                failed.get_or_insert(error);
                false
            });
            // Acknowledges an interrupt, upon which the workers end.
            continues && failed.is_none() && !interrupt::is_requested()
        });
        if let Some(error) = failed {
            return Err(error);
        }
        let workers = ran?;
        if let Some((first, reason)) = lost.first() {
            return Err(Error::LostRuns {
                count: lost.len(),
                name: runs.name(*first),
                reason: reason.clone(),
            });
        }
        store.read_others()?;
        Ok(EndedRuns { done, workers })
    }
}

/// Returns the engine of that name.
fn engine<'r>(registry: &'r Registry, name: &str) -> Result<&'r dyn Engine, Error> {
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
