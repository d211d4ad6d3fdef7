//! Recordings of runs: their contents, and what a replay requires.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use twinrig_kernel::SimDuration;
use twinrig_record::{
    Cadence, Encoder, RecordError, RecordedGroup, Recorder, RunInfo, Sink, Skeleton,
    SkeletonAbduction, SkeletonLeg,
};
use twinrig_robot::Leg;
use twinrig_robot::leg::{Joints, Pantograph};
use twinrig_runtime::Group;
use twinrig_scenario::{Abduction, Setting};

use crate::assembly::Assembly;
use crate::assembly::sources::{ROBOT_FILE, SCENARIO_FILE};
use crate::error::Error;
use crate::report::seconds;
use crate::run::execution::Execution;
use crate::run::executor::Executor;

/// Simulated time between flushes of the recording; flushed data survive a crash.
const FLUSH: SimDuration = SimDuration::from_secs(1);

/// Metadata key of a recording: settings of the run.
pub const SETTINGS_NOTE: &str = "settings";
/// Metadata key of the rules for values that the scenario leaves open, and their present version.
pub const DEFAULTS_NOTE: &str = "defaults";
const DEFAULTS: &str = "2";

/// Metadata key of a recording made on hardware.
pub const HARDWARE_NOTE: &str = "at_hardware";

/// Metadata key of a recording with an exchanged plant: time of the exchange \[s\].
pub const EXCHANGED_NOTE: &str = "exchanged_at_s";

/// Creates the recording of a run, if requested.
pub(crate) fn recorder(
    assembly: &Assembly<'_>,
    executor: &dyn Executor,
    execution: &Execution,
) -> Result<Option<Recorder<BufWriter<File>>>, Error> {
    let path = execution.recording.as_deref();
    path.map(|path| create(assembly, executor, path))
        .transpose()
}

fn create(
    assembly: &Assembly<'_>,
    executor: &dyn Executor,
    path: &Path,
) -> Result<Recorder<BufWriter<File>>, Error> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|source| Error::Write {
            path: folder.to_owned(),
            source,
        })?;
    }
    let created = File::create(path).map_err(|source| RecordError::Create {
        path: path.to_owned(),
        source,
    });
    let recorder = created.and_then(|file| recorder_to(assembly, executor, BufWriter::new(file)));
    recorder.map_err(|source| Error::Record {
        path: path.to_owned(),
        source,
    })
}

/// Contents of a recording.
#[derive(Clone, Copy)]
pub(crate) struct Contents<'a> {
    /// Selection of the signals, by name.
    pub(crate) keep: &'a dyn Fn(&str) -> bool,
    /// Whether the bytes of the wires are recorded.
    pub(crate) bytes: bool,
    /// Time between two sets of coordinate frames; none if none are recorded.
    pub(crate) frames: Option<SimDuration>,
}

/// Creates the recording of a run as its scenario specifies it, written to `out`.
///
/// # Errors
/// `out` cannot be written.
pub fn recorder_to<W: Write>(
    assembly: &Assembly<'_>,
    executor: &dyn Executor,
    out: W,
) -> Result<Recorder<W>, RecordError> {
    let recorded = &assembly.scene().recorded;
    let contents = Contents {
        keep: &|name| recorded.iter().any(|other| other == name),
        bytes: assembly.scenario().record.bytes,
        frames: assembly.frame_period(),
    };
    recorder_of(assembly, executor, contents, out)
}

/// Creates a recording of these contents, written to `out`.
pub(crate) fn recorder_of<W: Write>(
    assembly: &Assembly<'_>,
    executor: &dyn Executor,
    contents: Contents<'_>,
    out: W,
) -> Result<Recorder<W>, RecordError> {
    let cadence = Cadence {
        frames: contents.frames,
        flush: FLUSH,
    };
    let info = info(assembly, executor, contents.bytes);
    let groups = groups(executor, contents.keep);
    Recorder::new(out, &info, &groups, &assembly.skeleton(), cadence)
}

/// Creates the encoder of a run with all its signals, whose messages `sink` receives; frames are
/// `frames` apart.
///
/// # Errors
/// As [`Encoder::new`].
pub fn encoder<S: Sink>(
    assembly: &Assembly<'_>,
    executor: &dyn Executor,
    frames: SimDuration,
    sink: S,
) -> Result<Encoder<S>, RecordError> {
    let info = info(assembly, executor, false);
    let groups = groups(executor, &|_| true);
    Encoder::new(sink, &info, &groups, &assembly.skeleton(), Some(frames))
}

/// Returns the recorded groups of signals.
fn groups<'g>(
    executor: &'g dyn Executor,
    keep: &'g dyn Fn(&str) -> bool,
) -> Vec<RecordedGroup<'g>> {
    let group = |group| RecordedGroup {
        group,
        layout: executor.layout(group),
        keep,
    };
    let groups = [
        group(Group::Plant),
        group(Group::ProcessInputs),
        group(Group::ProcessOutputs),
    ];
    let diagnostics = group(Group::Diagnostics);
    let groups = groups.into_iter();
    groups
        .chain((!diagnostics.layout.is_empty()).then_some(diagnostics))
        .collect()
}

fn info(assembly: &Assembly<'_>, executor: &dyn Executor, bytes: bool) -> RunInfo {
    let scenario = assembly.scenario();
    let robot = assembly.robot_file();
    let notes = [
        ("scenario", scenario.name.clone()),
        ("scenario_file", scenario.file.clone()),
        (
            "robot_file",
            robot.map_or_else(String::new, |(file, _)| file.to_owned()),
        ),
        ("plant", scenario.plant.model.clone()),
        (DEFAULTS_NOTE, DEFAULTS.to_owned()),
        // Pairs of strings can always be serialised.
        (
            SETTINGS_NOTE,
            serde_json::to_string(&pairs(&scenario.settings)).unwrap_or_default(),
        ),
    ];
    let on_hardware = executor
        .on_hardware()
        .then(|| (HARDWARE_NOTE, "true".to_owned()));
    let variables = executor.process().variables().iter();
    let exchanged = executor.exchanged();
    let exchanged = exchanged.map(|at| (EXCHANGED_NOTE, seconds(at.as_nanos()).to_string()));
    RunInfo {
        files: kept_files(assembly),
        seed: scenario.seed,
        build: concat!("twinrig ", env!("CARGO_PKG_VERSION")).to_owned(),
        notes: notes
            .into_iter()
            .chain(on_hardware)
            .chain(exchanged)
            .map(|(key, value)| (key.to_owned(), value))
            .collect(),
        description: description(assembly),
        tasks: executor.tasks(),
        variables: variables
            .map(|variable| variable.name().to_owned())
            .collect(),
        traces: if bytes {
            executor.traces().to_vec()
        } else {
            Vec::new()
        },
    }
}

/// Returns the files from which the run can be repeated, by name: scenario, robot, and those of
/// sensors and standalone models.
pub(crate) fn kept_files(assembly: &Assembly<'_>) -> Vec<(String, Vec<u8>)> {
    let scenario = &assembly.scenario().text;
    let mut files = vec![(SCENARIO_FILE.to_owned(), scenario.clone().into_bytes())];
    let robot = assembly.robot_file();
    files.extend(robot.map(|(_, text)| (ROBOT_FILE.to_owned(), text.as_bytes().to_vec())));
    files.extend(assembly.body().files());
    files
}

/// Returns the keys and values of settings.
pub(crate) fn pairs(settings: &[Setting]) -> Vec<[String; 2]> {
    let pair = |setting: &Setting| [setting.key.clone(), setting.value.clone()];
    settings.iter().map(pair).collect()
}

/// Returns the settings of these keys and values.
pub fn settings_of(pairs: Vec<[String; 2]>) -> Vec<Setting> {
    let setting = |[key, value]: [String; 2]| Setting {
        origin: "--set".to_owned(),
        key,
        value,
    };
    pairs.into_iter().map(setting).collect()
}

/// Returns the robot as URDF; empty without a robot with legs.
pub fn description(assembly: &Assembly<'_>) -> String {
    let robot = assembly.robot().filter(|robot| !robot.legs.is_empty());
    // A robot whose legs make no pantograph has been refused before.
    let urdf = robot.and_then(|robot| twinrig_description::urdf(robot).ok());
    urdf.unwrap_or_default()
}

/// Returns the absolute angles of the segments of a leg in its reference pose.
fn reference(leg: &Leg) -> [f64; 3] {
    let zero = Joints { q2: 0.0, q3: 0.0 };
    Pantograph::new(leg).map_or([0.0; 3], |pantograph| pantograph.angles(0.0, zero))
}

impl Assembly<'_> {
    /// Returns the geometry from which coordinate frames are computed; without legs for a
    /// standalone plant without a robot.
    pub fn skeleton(&self) -> Skeleton {
        let mounts = self.robot().map_or(&[][..], |robot| &robot.legs);
        let is_free = self.scenario().plant.abduction == Abduction::Free;
        let legs = mounts.iter().map(|mount| SkeletonLeg {
            name: mount.name.clone(),
            hip: mount.hip,
            segments: [mount.leg.l1, mount.leg.l2, mount.leg.l3 - mount.leg.l_delta],
            reference: reference(&mount.leg),
            abduction: mount.abduction_axis().map(|axis| SkeletonAbduction {
                axis: [mount.hip[0], axis.place[0], axis.place[1]],
                is_free,
            }),
        });
        Skeleton {
            legs: legs.collect(),
        }
    }

    /// Returns the time between two sets of coordinate frames; none if none are recorded.
    pub fn frame_period(&self) -> Option<SimDuration> {
        let rate = self.scenario().record.frames?;
        SimDuration::try_from_secs_f64(1.0 / rate)
    }
}
