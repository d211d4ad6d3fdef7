//! A sweep as a job of an engine: the same run of a point here and on a worker elsewhere.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_campaign::engine::Job;
use twinrig_campaign::sweep::{RowKey, SweepRow};
use twinrig_document::Document;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::assembly::sources::Sources;
use twinrig_rig::build_key::BuildKey;
use twinrig_rig::error::{Error as RigError, guarded};
use twinrig_rig::registry::Registry;
use twinrig_rig::report::row;
use twinrig_rig::run::execute::execute_until;
use twinrig_rig::run::execution::Execution;
use twinrig_rig::run::interrupt;
use twinrig_scenario::Setting;

use crate::runs::parts::UsedParts;
use crate::runs::plan::RunPlan;

/// First bytes of the shared data; the key of the build follows. Both are read before all else, as
/// another build may have another form of the rest.
const MAGIC: &[u8; 8] = b"twinjob1";
/// Bytes of the key of a build.
const KEY_BYTES: usize = 32;

/// Runs of which each is a task.
pub(crate) struct SweepJob<'p> {
    pub(crate) runs: &'p RunPlan<'p>,
    /// Folder for a recording of each run, on the machine of the run.
    pub(crate) record: Option<&'p Path>,
}

/// Result of a task.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PointResult {
    pub(crate) row: SweepRow,
    pub(crate) recording: Option<RecordingPlace>,
}

/// Place of a recording, which stays where it was made.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RecordingPlace {
    /// Name of the machine.
    pub(crate) host: String,
    pub(crate) path: String,
}

/// Data of all tasks.
#[derive(Serialize, Deserialize)]
struct SharedData {
    /// File of the scenario, as given.
    file: String,
    sources: Vec<SharedSources>,
    /// Settings of all runs: origin, key, value.
    base: Vec<(String, String, String)>,
    /// Settings of each case, likewise.
    cases: Vec<Vec<(String, String, String)>>,
    /// Keys of the dimensions, with their origins.
    keys: Vec<(String, String)>,
    record: Option<String>,
    parts: UsedParts,
}

/// Contents of the files of [`Sources`].
#[derive(Serialize, Deserialize)]
struct SharedSources {
    file: String,
    text: String,
    folder: String,
    robot: Option<String>,
    kept: Option<Vec<(String, Vec<u8>)>>,
}

/// Data of a task.
#[derive(Serialize, Deserialize)]
struct TaskData {
    /// Index of the sources.
    sources: usize,
    /// Index of the case.
    case: usize,
    /// Values of the dimensions, in TOML.
    values: Vec<String>,
    /// Name of the recording.
    recording: Option<String>,
}

impl SweepJob<'_> {
    fn recording(&self, index: usize) -> Option<String> {
        let key = self.runs.points[index].key;
        self.record.map(|_| recording_name(key))
    }
}

impl Job for SweepJob<'_> {
    fn shared(&self) -> Vec<u8> {
        let sources = self.runs.sources.iter().map(|sources| SharedSources {
            file: sources.document.file().to_owned(),
            text: sources.document.text().to_owned(),
            folder: sources.folder.display().to_string(),
            robot: sources.robot.clone(),
            kept: sources.kept.clone(),
        });
        let cases = self.runs.cases.iter();
        let cases = cases.map(|case| shared_settings(&case.settings));
        let data = SharedData {
            file: self.runs.file.clone(),
            sources: sources.collect(),
            base: shared_settings(&self.runs.base),
            cases: cases.collect(),
            keys: self.runs.origins_and_keys(),
            record: self.record.map(|it| it.display().to_string()),
            parts: self.runs.parts.clone(),
        };
        let build = self.runs.build.as_bytes();
        [&MAGIC[..], build, &encoded(&data)].concat()
    }

    fn task(&self, index: usize) -> Vec<u8> {
        let point = &self.runs.points[index];
        encoded(&TaskData {
            sources: point.sources,
            case: point.case,
            values: point.values.iter().map(|it| it.toml.clone()).collect(),
            recording: self.recording(index),
        })
    }

    fn run(&self, index: usize) -> Option<Vec<u8>> {
        let (sources, settings) = self.runs.run_of(index);
        let recording = self.record.zip(self.recording(index));
        let run = PointRun {
            registry: self.runs.registry,
            file: &self.runs.file,
            sources,
            settings,
            recording: recording.map(|(folder, name)| folder.join(name)),
        };
        Some(encoded(&run.execute()?))
    }
}

/// Returns origin, key and value of settings.
fn shared_settings(settings: &[Setting]) -> Vec<(String, String, String)> {
    let settings = settings.iter().cloned();
    settings.map(|it| (it.origin, it.key, it.value)).collect()
}

/// Returns settings by origin, key and value.
fn settings(shared: Vec<(String, String, String)>) -> Vec<Setting> {
    let setting = |(origin, key, value)| Setting { origin, key, value };
    shared.into_iter().map(setting).collect()
}

/// Returns the name of the recording of a run.
fn recording_name(key: RowKey) -> String {
    /// Digits of the key, 64 bits.
    const DIGITS: usize = 16;
    format!("{:.DIGITS$}.mcap", key.to_string())
}

/// Returns the bytes of job data, whose types have lists and texts only, which can be serialised.
fn encoded(data: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(data).unwrap_or_default()
}

impl PointResult {
    /// Reads the bytes of a result.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, String> {
        postcard::from_bytes(bytes).map_err(|error| format!("a result cannot be read: {error}"))
    }
}

/// Run of a point.
struct PointRun<'r> {
    registry: &'r Registry,
    file: &'r str,
    sources: &'r Sources,
    settings: Vec<Setting>,
    recording: Option<PathBuf>,
}

impl PointRun<'_> {
    /// Runs the point; none if it was interrupted.
    fn execute(self) -> Option<PointResult> {
        let recording = self.recording;
        let run = guarded(self.file, || {
            let assembly = Assembly::new(self.registry, self.sources, &self.settings)?;
            let execution = Execution {
                recording: recording.clone(),
                ..Execution::default()
            };
            execute_until(&assembly, &execution, assembly.end())
        });
        let row = match run {
            Ok(report) if report.error.is_some() && interrupt::is_requested() => return None,
            Ok(report) => row::of_report(report),
            Err(error) => SweepRow::of_error(error.to_string()),
        };
        let recording = recording.filter(|path| path.exists());
        Some(PointResult {
            row,
            recording: recording.as_deref().map(RecordingPlace::here),
        })
    }
}

impl RecordingPlace {
    fn here(path: &Path) -> Self {
        Self {
            host: host_name(),
            path: path.display().to_string(),
        }
    }
}

/// Returns the name of this machine, which Linux has in a file.
fn host_name() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname");
    name.unwrap_or_default().trim().to_owned()
}

/// Error of a job on a worker.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JobError {
    /// The worker has another build.
    #[error(
        "the worker has another build of twinrig, {here}, than the sweep, {job}\n  = help: start the workers in an environment without twinrig of their own"
    )]
    OtherBuild {
        /// Key of the build of the worker.
        here: BuildKey,
        /// Key of the build that made the job.
        job: BuildKey,
    },
    /// The worker lacks a kind of parts that runs of the sweep use. It is no error of a run, whose
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
    Program(#[from] RigError),
}

/// Job of another process on a worker.
pub struct WorkerJob {
    registry: Registry,
    file: String,
    sources: Vec<Sources>,
    base: Vec<Setting>,
    cases: Vec<Vec<Setting>>,
    keys: Vec<(String, String)>,
    record: Option<PathBuf>,
}

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
            .ok_or_else(|| damaged("it does not begin as one"))?;
        let (job, here) = (BuildKey::of_key(key), registry.build()?);
        let job = job.ok_or_else(|| damaged("its key is too short"))?;
        if job != here {
            return Err(JobError::OtherBuild { here, job });
        }
        let data: SharedData =
            postcard::from_bytes(data).map_err(|error| damaged(&error.to_string()))?;
        if let Some((sort, name, help)) = data.parts.first_missing(&registry) {
            return Err(JobError::MissingPart {
                machine: host_name(),
                sort,
                name,
                help,
            });
        }
        let sources = data.sources.into_iter().map(SharedSources::sources);
        Ok(Self {
            registry,
            file: data.file,
            sources: sources.collect::<Result<_, _>>()?,
            base: settings(data.base),
            cases: data.cases.into_iter().map(settings).collect(),
            keys: data.keys,
            record: data.record.map(PathBuf::from),
        })
    }

    /// Does a task; returns the bytes of its result, or none after an interrupt.
    ///
    /// # Errors
    /// [`JobError::Damaged`] if the task is not of this job.
    pub fn run(&self, task: &[u8]) -> Result<Option<Vec<u8>>, JobError> {
        let task: TaskData =
            postcard::from_bytes(task).map_err(|error| JobError::Damaged(error.to_string()))?;
        let sources = self.sources.get(task.sources);
        let sources = sources.ok_or_else(|| JobError::Damaged("it lacks a file".to_owned()))?;
        let case = self.cases.get(task.case);
        let case = case.ok_or_else(|| JobError::Damaged("it lacks a case".to_owned()))?;
        let values = self.keys.iter().zip(task.values);
        let values = values.map(|((origin, key), value)| Setting {
            origin: origin.clone(),
            key: key.clone(),
            value,
        });
        let given = self.base.iter().chain(case);
        let recording = self.record.as_ref().zip(task.recording);
        let run = PointRun {
            registry: &self.registry,
            file: &self.file,
            sources,
            settings: given.cloned().chain(values).collect(),
            recording: recording.map(|(folder, name)| folder.join(name)),
        };
        Ok(run.execute().map(|result| encoded(&result)))
    }
}

impl SharedSources {
    fn sources(self) -> Result<Sources, JobError> {
        let document = Document::parse(&self.file, &self.text);
        let document = document.map_err(|error| JobError::Damaged(error.to_string()))?;
        Ok(Sources {
            robot: self.robot,
            kept: self.kept,
            ..Sources::of(document, Path::new(&self.folder))
        })
    }
}
