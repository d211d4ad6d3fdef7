//! Jobs of another process on a worker.

use twinrig_rig::build_key::BuildKey;
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;

use crate::feedback::task::run_load;
use crate::gait::task::run_gait;
use crate::robustness::task::run_member;
use crate::runs::job::{MAGIC, PointWorker, SharedJob};
use crate::runs::judged::run_judged;
use crate::runs::parts::MissingPart;
use crate::runs::recordings::host_name;
use crate::runs::scene::RunScene;

/// Bytes of the key of a build.
const KEY_BYTES: usize = 32;

/// Error of a job on a worker.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JobError {
    /// The worker has another build.
    #[error(
        "the worker has another build of twinrig, {here}, than the job, {job}\n  = help: start the workers in an environment without twinrig of their own"
    )]
    OtherBuild {
        /// Key of the build of the worker.
        here: BuildKey,
        /// Key of the build that made the job.
        job: BuildKey,
    },
    /// The worker lacks a kind of parts that runs of the job use. It is no error of a run, whose
    /// row would be kept.
    #[error("the machine `{machine}` lacks the {sort} `{name}`\n  = help: {help}")]
    MissingPart {
        /// Name of the machine.
        machine: String,
        /// Sort of the part.
        sort: &'static str,
        /// Name of its kind.
        name: String,
        /// Remedy.
        help: String,
    },
    /// Bytes that are no job.
    #[error("the data of the job cannot be read: {0}")]
    Damaged(String),
    /// The worker's program cannot be read.
    #[error(transparent)]
    Program(#[from] Error),
}

/// Job of another process on a worker.
pub struct WorkerJob {
    registry: Registry,
    runs: WorkerRuns,
}

/// Runs of a job.
enum WorkerRuns {
    Points(PointWorker),
    Study {
        scenes: Vec<RunScene>,
        run: StudyRun,
    },
}

/// Does a task of a study: from its scenes and the bytes of the task to those of the result.
pub(crate) type StudyRun = fn(&Registry, &[RunScene], &[u8]) -> Result<Option<Vec<u8>>, String>;

/// Runs of studies, by name.
const STUDY_RUNS: &[(&str, StudyRun)] = &[
    ("gait", run_gait),
    ("judged", run_judged),
    ("load", run_load),
    ("member", run_member),
];

impl WorkerJob {
    /// Reads the shared data of a job of the same build; all files are in it.
    ///
    /// # Errors
    /// [`JobError`] if the build is another one, if it lacks a part, or if the data is damaged.
    pub fn new(registry: Registry, shared: &[u8]) -> Result<Self, JobError> {
        let damaged = |reason: &str| JobError::Damaged(reason.to_owned());
        let rest = shared.strip_prefix(MAGIC);
        let (key, data) = rest
            .and_then(|rest| rest.split_at_checked(KEY_BYTES))
            .ok_or_else(|| damaged("wrong magic bytes"))?;
        let (job, here) = (BuildKey::of_key(key), registry.build()?);
        let job = job.ok_or_else(|| damaged("its key is too short"))?;
        if job != here {
            return Err(JobError::OtherBuild { here, job });
        }
        let data = postcard::from_bytes(data).map_err(|error| damaged(&error.to_string()))?;
        let missing = match &data {
            SharedJob::Points(points) => points.parts.first_missing(&registry),
            SharedJob::Study { scenes, .. } => {
                let mut parts = scenes.iter().map(RunScene::parts);
                parts.find_map(|parts| parts.first_missing(&registry))
            }
        };
        if let Some(MissingPart { sort, name, help }) = missing {
            return Err(JobError::MissingPart {
                machine: host_name(),
                sort,
                name,
                help,
            });
        }
        let runs = match data {
            SharedJob::Points(points) => {
                let points = PointWorker::new(points);
                WorkerRuns::Points(points.map_err(|error| damaged(&error.to_string()))?)
            }
            SharedJob::Study { name, scenes } => {
                let mut known = STUDY_RUNS.iter();
                let run = known.find(|(known, _)| *known == name).map(|(_, run)| *run);
                let run = run.ok_or_else(|| damaged("it is of an unknown study"))?;
                WorkerRuns::Study { scenes, run }
            }
        };
        Ok(Self { registry, runs })
    }

    /// Does a task; returns the bytes of its result, or none after an interrupt.
    ///
    /// # Errors
    /// [`JobError::Damaged`] if the task is not of this job.
    pub fn run(&self, task: &[u8]) -> Result<Option<Vec<u8>>, JobError> {
        let done = match &self.runs {
            WorkerRuns::Points(points) => points.run(&self.registry, task),
            WorkerRuns::Study { scenes, run } => run(&self.registry, scenes, task),
        };
        done.map_err(JobError::Damaged)
    }
}
