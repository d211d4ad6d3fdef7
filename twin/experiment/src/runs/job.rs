//! A sweep as a job of an engine: the same run of a point here and on a worker elsewhere.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use twinrig_campaign::engine::Job;
use twinrig_campaign::sweep::{RowKey, SweepRow};
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

use crate::runs::missing::StoredRuns;
use crate::runs::parts::UsedParts;
use crate::runs::plan::RunPlan;
use crate::runs::recordings::RecordingPlace;
use crate::runs::scene::{
    RunScene, SharedSettings, SharedSources, encoded, settings, shared_settings,
};

/// First bytes of the shared data; the key of the build follows. Both are read before all else, as
/// another build may have another form of the rest.
pub(crate) const MAGIC: &[u8; 8] = b"twinjob1";

/// Runs of which each is a task.
pub(crate) struct SweepJob<'p> {
    pub(crate) runs: &'p RunPlan<'p>,
    /// Folder for a recording of each run, on the machine of the run.
    pub(crate) record: Option<&'p Path>,
}

/// Result of a task: the row, and where the recording is.
type PointResult = (SweepRow, Option<RecordingPlace>);

/// Data of all tasks of a job.
#[derive(Serialize, Deserialize)]
pub(crate) enum SharedJob {
    /// Runs at points.
    Points(SharedPoints),
    /// Runs of a study.
    Study {
        /// Name of the runs.
        name: String,
        scenes: Vec<RunScene>,
    },
}

/// Returns the bytes of the data of all tasks.
pub(crate) fn shared_bytes(build: &BuildKey, job: &SharedJob) -> Vec<u8> {
    [&MAGIC[..], build.as_bytes(), &encoded(job)].concat()
}

/// Data of all tasks of runs at points.
#[derive(Serialize, Deserialize)]
pub(crate) struct SharedPoints {
    /// File of the scenario, as given.
    file: String,
    sources: Vec<SharedSources>,
    /// Settings of all runs: origin, key, value.
    base: SharedSettings,
    /// Settings of each case, likewise.
    cases: Vec<SharedSettings>,
    /// Keys of the dimensions, with their origins.
    keys: Vec<(String, String)>,
    record: Option<String>,
    pub(crate) parts: UsedParts,
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
        let sources = self.runs.sources.iter().map(SharedSources::of);
        let cases = self.runs.cases.iter();
        let cases = cases.map(|case| shared_settings(&case.settings));
        let data = SharedPoints {
            file: self.runs.file.clone(),
            sources: sources.collect(),
            base: shared_settings(&self.runs.base),
            cases: cases.collect(),
            keys: self.runs.origins_and_keys(),
            record: self.record.map(|it| it.display().to_string()),
            parts: self.runs.parts.clone(),
        };
        shared_bytes(&self.runs.build, &SharedJob::Points(data))
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

impl StoredRuns for SweepJob<'_> {
    type Row = SweepRow;

    fn key(&self, run: usize) -> RowKey {
        self.runs.points[run].key
    }

    fn name(&self, run: usize) -> String {
        self.runs.name(run)
    }

    fn row(&self, result: Result<Vec<u8>, String>) -> Result<PointResult, String> {
        match result {
            Ok(bytes) => postcard::from_bytes(&bytes)
                .map_err(|error| format!("a result cannot be read: {error}")),
            Err(panic) => Ok((SweepRow::of_error(panic), None)),
        }
    }
}

/// Returns the name of the recording of a run.
fn recording_name(key: RowKey) -> String {
    /// Digits of the key, 64 bits.
    const DIGITS: usize = 16;
    format!("{:.DIGITS$}.mcap", key.to_string())
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
            let assembly = Assembly::builder(self.registry)
                .settings(&self.settings)
                .sources(self.sources)?;
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
        Some((row, recording.as_deref().map(RecordingPlace::here)))
    }
}

/// Runs at points of another process, on a worker.
pub(crate) struct PointWorker {
    file: String,
    sources: Vec<Sources>,
    base: Vec<Setting>,
    cases: Vec<Vec<Setting>>,
    keys: Vec<(String, String)>,
    record: Option<PathBuf>,
}

impl PointWorker {
    /// Returns the worker, or an error of the contents of a file.
    pub(crate) fn new(data: SharedPoints) -> Result<Self, RigError> {
        let sources = data.sources.into_iter().map(SharedSources::sources);
        Ok(Self {
            file: data.file,
            sources: sources.collect::<Result<_, _>>()?,
            base: settings(data.base),
            cases: data.cases.into_iter().map(settings).collect(),
            keys: data.keys,
            record: data.record.map(PathBuf::from),
        })
    }

    /// Does a task; returns the bytes of its result, or none after an interrupt. An error is that
    /// of data that is no task of this job.
    pub(crate) fn run(&self, registry: &Registry, task: &[u8]) -> Result<Option<Vec<u8>>, String> {
        let task: TaskData = postcard::from_bytes(task).map_err(|error| error.to_string())?;
        let sources = self.sources.get(task.sources).ok_or("it lacks a file")?;
        let case = self.cases.get(task.case).ok_or("it lacks a case")?;
        let values = self.keys.iter().zip(task.values);
        let values = values.map(|((origin, key), value)| Setting {
            origin: origin.clone(),
            key: key.clone(),
            value,
        });
        let given = self.base.iter().chain(case);
        let recording = self.record.as_ref().zip(task.recording);
        let run = PointRun {
            registry,
            file: &self.file,
            sources,
            settings: given.cloned().chain(values).collect(),
            recording: recording.map(|(folder, name)| folder.join(name)),
        };
        Ok(run.execute().map(|result| encoded(&result)))
    }
}
