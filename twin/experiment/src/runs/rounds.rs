//! Rounds of runs of a study: an engine does those whose results are not on disk.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use twinrig_campaign::engine::{Engine, EngineEvent, EngineOptions, Job, LocalEngine};
use twinrig_campaign::sweep::{Partition, RowKey, RowLog};
use twinrig_report::summary::Summary;
use twinrig_rig::build_key::BuildKey;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;

use super::job::{SharedJob, shared_bytes};
use super::scene::{RunScene, encoded};
use super::tasks::engine;
use crate::error::{Error, StudyError};
use crate::options::request::StudyFrame;
use crate::options::run::RunOptions;
use crate::parallel::Ran;
use crate::progress::ProgressObserver;
use crate::stopwatch::Stopwatch;

/// Runs of a study.
pub(crate) trait StudyRuns: Sync {
    /// Everything that a run depends on beside its scene.
    type Task: Serialize + Sync;
    /// Result of a run.
    type Run: Clone + Serialize + DeserializeOwned;
    /// Name of these runs: that of the folder of their rows, and in the table of `worker.rs`.
    const NAME: &'static str;

    /// Returns the scenes, which tasks name by their indices.
    fn scenes(&self) -> Vec<&RunScene>;

    /// Returns the index of the scene of a task.
    fn scene_of(task: &Self::Task) -> usize;

    /// Does a run in this process.
    fn run(&self, task: &Self::Task) -> Ran<Self::Run>;
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
    engine: &'r dyn Engine,
    options: EngineOptions,
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
            engine: engine(registry, &options.engine.engine)?,
            options: options.engine.options(),
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
            engine: &LocalEngine,
            options: EngineOptions::default(),
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
    ) -> Result<Vec<Ran<R::Run>>, Error> {
        let job = RoundJob {
            runs,
            tasks,
            build: self.build,
        };
        let keys = job.keys();
        let mut rows = Rows {
            wanted: keys.iter().copied().collect(),
            known: BTreeMap::new(),
        };
        let mut log = self.open::<R>(&mut rows)?;
        let mut seen = BTreeSet::new();
        let missing: Vec<usize> = (0..tasks.len())
            .filter(|&index| share == RoundShare::Every || self.partition.contains(index))
            .filter(|&index| !rows.known.contains_key(&keys[index]) && seen.insert(keys[index]))
            .collect();
        let done = self.run_missing(&job, &keys, &missing, &mut rows, log.as_mut(), observer)?;
        if let Some(log) = &log {
            // Other partitions may have been completed meanwhile.
            log.read_others(&mut |key, row| rows.keep(key, row))?;
        }
        let left = keys
            .iter()
            .filter(|key| !rows.known.contains_key(key))
            .count();
        if done < missing.len() {
            return Err(self.interrupted(tasks.len() - left));
        }
        self.before += tasks.len();
        self.stored += keys.iter().filter(|key| !seen.contains(key)).count();
        let results: Option<Vec<Ran<R::Run>>> = keys
            .iter()
            .map(|key| rows.known.get(key).cloned())
            .collect();
        results.ok_or(Error::Partial {
            missing: left,
            of: tasks.len(),
        })
    }

    /// Opens the log of these runs and reads their rows.
    fn open<R: StudyRuns>(&mut self, rows: &mut Rows<R::Run>) -> Result<Option<Log<R>>, Error> {
        let Some(folder) = &self.folder else {
            return Ok(None);
        };
        let folder = folder.join(R::NAME);
        let mut keep = |key, row| rows.keep(key, row);
        let (log, opened) = RowLog::open(&folder, self.partition, &mut keep)?;
        let damaged = log.read_others(&mut keep)?;
        let lines = opened.torn.iter().chain(&opened.damaged).chain(&damaged);
        self.notes.extend(lines.map(ToString::to_string));
        Ok(Some(log))
    }

    /// Does the missing runs; returns the number of those that have ended.
    fn run_missing<R: StudyRuns>(
        &self,
        job: &RoundJob<'_, R>,
        keys: &[RowKey],
        missing: &[usize],
        rows: &mut Rows<R::Run>,
        mut log: Option<&mut Log<R>>,
        observer: &mut dyn ProgressObserver,
    ) -> Result<usize, Error> {
        let stopwatch = Stopwatch::start();
        let all = self.all.max(self.before + job.tasks.len());
        let stored = self.before + job.tasks.len() - missing.len();
        let (mut done, mut lost, mut failed) = (0, None, None);
        let ran = self.engine.run(job, missing, &self.options, &mut |event| {
            match event {
                EngineEvent::Status(_) => {}
                EngineEvent::Lost { reason, .. } => {
                    lost.get_or_insert(reason);
                }
                EngineEvent::Done { task, result } => {
                    done += 1;
                    let row = result.and_then(|bytes| ran_of(&bytes));
                    let written = log.as_mut().map(|log| log.append(keys[task], &row));
                    failed = failed.take().or(written.and_then(Result::err));
                    rows.known.insert(keys[task], row);
                }
            }
            let left = all.saturating_sub(stored + done);
            let left_s = stopwatch.elapsed_s() * left as f64 / done.max(1) as f64;
            observer.at(stored + done, all, &format!("{left_s:.0} s left")) && failed.is_none()
        });
        if let Some(error) = failed {
            return Err(error.into());
        }
        ran?;
        match lost {
            None => Ok(done),
            Some(reason) => Err(Error::LostRuns {
                count: missing.len() - done,
                name: R::NAME.to_owned(),
                reason,
            }),
        }
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

/// Log of the results of runs.
type Log<R> = RowLog<Ran<<R as StudyRuns>::Run>>;

/// Results of the runs of a round.
struct Rows<T> {
    wanted: BTreeSet<RowKey>,
    known: BTreeMap<RowKey, Ran<T>>,
}

impl<T> Rows<T> {
    fn keep(&mut self, key: RowKey, row: Ran<T>) {
        if self.wanted.contains(&key) {
            self.known.entry(key).or_insert(row);
        }
    }
}

/// Returns the result in the bytes of a worker.
fn ran_of<T: DeserializeOwned>(bytes: &[u8]) -> Ran<T> {
    let read: Result<Ran<T>, _> = postcard::from_bytes(bytes);
    read.unwrap_or_else(|error| Err(format!("a result cannot be read: {error}")))
}

/// Runs of a round as a job.
struct RoundJob<'a, R: StudyRuns> {
    runs: &'a R,
    tasks: &'a [R::Task],
    build: BuildKey,
}

impl<R: StudyRuns> RoundJob<'_, R> {
    /// Returns the key of each run: the hash of program, files, settings, and of all that the task
    /// has.
    fn keys(&self) -> Vec<RowKey> {
        let scenes = self.runs.scenes().into_iter();
        let scenes: Vec<Vec<u8>> = scenes.map(RunScene::contents).collect();
        let tasks = self.tasks.iter();
        let key = |task: &R::Task| {
            let (scene, task_bytes) = (&scenes[R::scene_of(task)], encoded(task));
            let parts = [
                self.build.as_bytes(),
                R::NAME.as_bytes(),
                scene,
                &task_bytes,
            ];
            RowKey::of(parts)
        };
        tasks.map(key).collect()
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
    run: impl FnOnce(&RunScene, &R::Task) -> Ran<R::Run>,
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
