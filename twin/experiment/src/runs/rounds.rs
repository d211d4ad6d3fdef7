//! Rounds of runs of a study: an engine does those whose results are not on disk.
//!
//! A study gives scenes and tasks to `StudyEngine::round`, which returns all results in order; a
//! second round may depend on the first. The key of a row hashes program, contents of all files,
//! settings and task. Runs that differ by settings alone are `JudgedRuns`; others implement
//! `StudyRuns`, and have a line in `worker.rs` for machines of a cluster. The analysis is a
//! function of the results, so that its tests have recorded or computed ones.

use std::collections::BTreeSet;
use std::convert::identity;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use twinrig_campaign::engine::Job;
use twinrig_campaign::sweep::{Partition, RowKey, RowStore};
use twinrig_report::summary::Summary;
use twinrig_rig::build_key::BuildKey;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;

use super::job::{SharedJob, shared_bytes};
use super::missing::{StoredRuns, TaskEvent, Workers};
use super::recordings::RecordingPlace;
use super::scene::{RunScene, encoded};
use crate::error::{Error, StudyError};
use crate::options::request::StudyFrame;
use crate::options::run::{EngineArgs, RunOptions};
use crate::parallel::RunResult;
use crate::progress::ProgressObserver;
use crate::stopwatch::Stopwatch;

/// Runs of a study.
pub(crate) trait StudyRuns: Sync {
    /// Everything that a run depends on beside its scene.
    type Task: Serialize + Sync;
    /// Result of a run.
    type Run: Clone + Serialize + DeserializeOwned + 'static;
    /// Name of these runs: that of the folder of their rows, and in the table of `worker.rs`.
    const NAME: &'static str;

    /// Returns the scenes, which tasks name by their indices.
    fn scenes(&self) -> Vec<&RunScene>;

    /// Returns the index of the scene of a task.
    fn scene_of(task: &Self::Task) -> usize;

    /// Does a run in this process.
    fn run(&self, task: &Self::Task) -> RunResult<Self::Run>;
}

/// Processes that do the runs of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RoundShare {
    /// Each does all of them, as the next round depends on them.
    Every,
    /// Each does those of its partition.
    Partition,
}

/// Does the runs of a study, round by round.
pub(crate) struct StudyEngine<'r> {
    build: BuildKey,
    workers: Workers<'r>,
    partition: Partition,
    /// Scenario file, for messages.
    file: String,
    /// Folder of the rows; none: nothing is kept.
    folder: Option<PathBuf>,
    /// Notes about the rows on disk.
    notes: Vec<String>,
    /// Runs of earlier rounds.
    before: usize,
    /// Runs of all rounds, as far as they are known.
    all: usize,
    /// Runs of earlier calls.
    stored: usize,
}

impl<'r> StudyEngine<'r> {
    /// Creates the engine of a study, which keeps the rows in a folder beside its files.
    ///
    /// # Errors
    /// [`Error::NoEngine`].
    pub(crate) fn new(
        registry: &'r Registry,
        options: &RunOptions,
        frame: &StudyFrame<'_>,
    ) -> Result<Self, Error> {
        Ok(Self {
            workers: Workers::new(registry, &options.engine)?,
            partition: options.partition,
            folder: Some(frame.out.join(frame.stem())),
            ..Self::local(registry, &frame.scenarios[0])?
        })
    }

    /// Creates an engine on the threads of this process that keeps nothing.
    ///
    /// # Errors
    /// The program cannot be read.
    pub(crate) fn local(registry: &'r Registry, file: &Path) -> Result<Self, Error> {
        Ok(Self {
            file: file.display().to_string(),
            build: registry.build()?,
            workers: Workers::new(registry, &EngineArgs::default())?,
            partition: Partition::WHOLE,
            folder: None,
            notes: Vec::new(),
            before: 0,
            all: 0,
            stored: 0,
        })
    }

    /// Announces so many further runs, for the progress.
    pub(crate) fn expect(&mut self, runs: usize) {
        self.all += runs;
    }

    /// Adds the notes about rows on disk to a summary.
    pub(crate) fn note(&self, summary: &mut Summary) {
        if self.stored > 0 {
            let runs = format!(
                "{}, and {} of earlier calls",
                self.before - self.stored,
                self.stored
            );
            summary.fact("runs", runs);
        }
        for note in &self.notes {
            summary.fact("note", note);
        }
    }

    /// Does the runs of a round that are not on disk, equal ones once; returns all in their order.
    ///
    /// # Errors
    /// [`StudyError`] if `observer` or an interrupt stopped the study, [`Error::Partial`] if runs of
    /// other partitions are missing; errors of engine and store.
    pub(crate) fn round<R: StudyRuns>(
        &mut self,
        runs: &R,
        tasks: &[R::Task],
        share: RoundShare,
        observer: &mut dyn ProgressObserver,
    ) -> Result<Vec<RunResult<R::Run>>, Error> {
        let job = RoundJob::new(runs, tasks, self.build);
        let mut store = self.open::<R>(&job.keys)?;
        let partition = match share {
            RoundShare::Every => Partition::WHOLE,
            RoundShare::Partition => self.partition,
        };
        let among = (0..tasks.len()).filter(|&run| partition.contains(run));
        let missing = job.missing(among, &store);
        let done = self.run_missing(&job, &missing, &mut store, observer)?;
        self.notes.extend_from_slice(store.warnings());
        let rows: Vec<Option<&RunResult<R::Run>>> =
            job.keys.iter().map(|key| store.get(key)).collect();
        let left = rows.iter().filter(|row| row.is_none()).count();
        if done < missing.len() {
            return Err(self.interrupted(tasks.len() - left));
        }
        self.before += tasks.len();
        let ran: BTreeSet<&RowKey> = missing.iter().map(|&run| &job.keys[run]).collect();
        self.stored += job.keys.iter().filter(|key| !ran.contains(key)).count();
        let results: Option<Vec<RunResult<R::Run>>> = rows
            .into_iter()
            .map(Option::<&RunResult<R::Run>>::cloned)
            .collect();
        results.ok_or(Error::Partial {
            missing: left,
            of: tasks.len(),
        })
    }

    /// Opens the store of these runs.
    fn open<R: StudyRuns>(&self, keys: &[RowKey]) -> Result<Store<R>, Error> {
        let Some(folder) = &self.folder else {
            return Ok(RowStore::in_memory(identity));
        };
        let folder = folder.join(R::NAME);
        let keys = Some(keys.to_vec());
        Ok(RowStore::open(&folder, self.partition, keys, identity)?)
    }

    /// Does the missing runs; returns the number of those that have ended.
    fn run_missing<R: StudyRuns>(
        &mut self,
        job: &RoundJob<'_, R>,
        missing: &[usize],
        store: &mut Store<R>,
        observer: &mut dyn ProgressObserver,
    ) -> Result<usize, Error> {
        let stopwatch = Stopwatch::start();
        let all = self.all.max(self.before + job.tasks.len());
        let stored = self.before + job.tasks.len() - missing.len();
        let mut done = 0;
        let ended = self.workers.run(job, missing, store, &mut |event| {
            done += usize::from(matches!(event, TaskEvent::Done { .. }));
            let left = all.saturating_sub(stored + done);
            let left_s = stopwatch.elapsed_s() * left as f64 / done.max(1) as f64;
            observer.at(stored + done, all, &format!("{left_s:.0} s left"))
        });
        Ok(ended?.done)
    }

    /// Returns the error of a study that was stopped after so many runs of a round.
    fn interrupted(&self, done: usize) -> Error {
        let (done, of) = (self.before + done, self.all.max(self.before + done));
        let source = match self.folder {
            Some(_) => StudyError::InterruptedRuns { done, of },
            None => StudyError::Interrupted { done, of },
        };
        Error::of_study(&self.file, source)
    }
}

/// Store of the results of runs, which are few enough to be in memory.
type Store<R> = RowStore<RunResult<<R as StudyRuns>::Run>, RunResult<<R as StudyRuns>::Run>>;

/// Runs of a round as a job.
struct RoundJob<'a, R: StudyRuns> {
    runs: &'a R,
    tasks: &'a [R::Task],
    build: BuildKey,
    /// Key of each run.
    keys: Vec<RowKey>,
}

impl<'a, R: StudyRuns> RoundJob<'a, R> {
    /// The key of a run is the hash of program, files, settings, and of all that the task has.
    fn new(runs: &'a R, tasks: &'a [R::Task], build: BuildKey) -> Self {
        let scenes = runs.scenes().into_iter();
        let scenes: Vec<Vec<u8>> = scenes.map(RunScene::contents).collect();
        let key = |task: &R::Task| {
            let (scene, task_bytes) = (&scenes[R::scene_of(task)], encoded(task));
            RowKey::of([build.as_bytes(), R::NAME.as_bytes(), scene, &task_bytes])
        };
        Self {
            keys: tasks.iter().map(key).collect(),
            runs,
            tasks,
            build,
        }
    }
}

impl<R: StudyRuns> StoredRuns for RoundJob<'_, R> {
    type Row = RunResult<R::Run>;

    fn key(&self, run: usize) -> RowKey {
        self.keys[run]
    }

    fn name(&self, _: usize) -> String {
        R::NAME.to_owned()
    }

    fn row(
        &self,
        result: Result<Vec<u8>, String>,
    ) -> Result<(RunResult<R::Run>, Option<RecordingPlace>), String> {
        let row = result.and_then(|bytes| {
            let read: Result<RunResult<R::Run>, _> = postcard::from_bytes(&bytes);
            read.unwrap_or_else(|error| Err(format!("a result cannot be read: {error}")))
        });
        Ok((row, None))
    }
}

impl<R: StudyRuns> Job for RoundJob<'_, R> {
    fn shared(&self) -> Vec<u8> {
        let scenes = self.runs.scenes().into_iter().cloned().collect();
        let name = R::NAME.to_owned();
        shared_bytes(&self.build, &SharedJob::Study { name, scenes })
    }

    fn task(&self, index: usize) -> Vec<u8> {
        encoded(&self.tasks[index])
    }

    fn run(&self, index: usize) -> Option<Vec<u8>> {
        let ran = self.runs.run(&self.tasks[index]);
        (!interrupt::is_requested()).then(|| encoded(&ran))
    }
}

/// Does a task of another process: reads it, runs it on its scene, and returns the bytes of the
/// result, or none after an interrupt. An error is that of data that is no task of these runs.
pub(crate) fn run_on_worker<R: StudyRuns>(
    scenes: &[RunScene],
    task: &[u8],
    run: impl FnOnce(&RunScene, &R::Task) -> RunResult<R::Run>,
) -> Result<Option<Vec<u8>>, String>
where
    R::Task: DeserializeOwned,
{
    let task: R::Task = postcard::from_bytes(task).map_err(|error| error.to_string())?;
    let scene = scenes.get(R::scene_of(&task)).ok_or("it lacks a scene")?;
    let ran = run(scene, &task);
    Ok((!interrupt::is_requested()).then(|| encoded(&ran)))
}

#[cfg(test)]
mod tests;
