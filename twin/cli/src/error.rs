//! Errors before, during and after a run.

use std::path::PathBuf;

use thiserror::Error;
use twinrig_document::{DocumentError, Problem, suggestion};
use twinrig_record::RecordError;
use twinrig_robot::RobotError;
use twinrig_runtime::{DeviceError, PanicReport, RigError, catch_panic};
use twinrig_scenario::Scenario;

/// Error of the builder of a part; `?` converts any error into it.
pub type BuildError = Box<dyn std::error::Error + Send + Sync>;

/// Message of a part that requires a robot, for scenarios without one.
pub(crate) const NO_ROBOT: &str =
    "it needs a robot, and the scenario names none: add `robot = …`, or use a part that needs none";

/// Error of a command; the exit code is 2 for all of them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TwinError {
    /// Errors in a scenario or robot file, with their places.
    #[error(transparent)]
    Document(#[from] DocumentError),
    /// Failure to build a part.
    #[error("error: the {what} `{name}` cannot be built: {}\n --> {file}", chain(source.as_ref()))]
    Build {
        /// Kind of part: `plant`, `controller` or `bus`.
        what: &'static str,
        /// Name of the part.
        name: String,
        /// Scenario file.
        file: String,
        /// Reason.
        source: BuildError,
    },
    /// Incompatible parts of a rig, or failure of a part during the run.
    #[error("error: {source}\n --> {file}{help}")]
    Rig {
        /// Scenario file.
        file: String,
        /// Help as a separate line; may be empty.
        help: String,
        /// Reason.
        source: Box<RigError>,
    },
    /// Plant whose start cannot be perturbed.
    #[error(
        "error: the start of the plant cannot be perturbed: {why}\n --> {file}\n  = help: `twin study robustness` varies the seed instead"
    )]
    Start {
        /// Scenario file.
        file: String,
        /// Reason.
        why: String,
    },
    /// Panic of a part or of this program.
    #[error(
        "error: {source}{}\n  = help: this is a bug in the named part; set RUST_BACKTRACE=1 to print a backtrace",
        at(file)
    )]
    Panic {
        /// Scenario file; empty if no scenario was running.
        file: String,
        /// Message and place of the panic.
        source: PanicReport,
    },
    /// Device assigned to a bus that the scenario does not have.
    #[error("error: there is no bus `{bus}` in this scenario\n  = help: {help}")]
    NoSuchBus {
        /// Name of the bus.
        bus: String,
        /// Similar names, or the known ones.
        help: String,
    },
    /// Scenario without a bus, and thus without boards to emulate.
    #[error("error: there is no [bus] in this scenario, and so nothing to serve\n --> {file}")]
    NothingToServe {
        /// Scenario file.
        file: String,
    },
    /// Bus without a device, while other buses have one.
    #[error(
        "error: the bus `{bus}` has no device\n  = help: on hardware every bus needs a device: add `--port {bus}=DEVICE`, or run without --port to run on the twin; `twin devices` lists devices"
    )]
    NoPort {
        /// Name of the bus.
        bus: String,
    },
    /// Failure to open or use a device.
    #[error("error: bus `{bus}`: {source}")]
    Device {
        /// Name of the bus.
        bus: String,
        /// Reason.
        source: DeviceError,
    },
    /// Failure to write or read a recording.
    #[error("error: {}\n --> {}", chain(source), path.display())]
    Record {
        /// Path of the recording.
        path: PathBuf,
        /// Reason.
        source: RecordError,
    },
    /// Recordings that cannot be compared.
    #[error("error: {}", chain(source))]
    Compare {
        /// Reason.
        source: RecordError,
    },
    /// Options that are incompatible with each other, or an element of a list that is there twice.
    #[error("error: {why}\n  = help: {help}")]
    Together {
        /// Reason.
        why: String,
        /// Remedy.
        help: String,
    },
    /// Recording that lacks data required to repeat its run.
    #[error("error: this recording cannot be replayed: {why}\n --> {}", path.display())]
    NotReplayable {
        /// Path of the recording.
        path: PathBuf,
        /// Missing data.
        why: String,
    },
    /// Function that requires a cargo feature which this build lacks.
    #[error(
        "error: this build cannot {what}\n  = help: build with `--features {feature}`{}",
        after(feature)
    )]
    MissingFeature {
        /// Description of the function: `write MJCF`.
        what: &'static str,
        /// Missing cargo feature.
        feature: &'static str,
    },
    /// Leg of a robot without a pose that is asked for.
    #[error("error: the leg of {robot} has no such pose: {source}")]
    Leg {
        /// Name or path of the robot.
        robot: String,
        /// Reason.
        source: twinrig_leg::LegError,
    },
    /// Robot that cannot be exported to a format.
    #[error("error: {robot} cannot be written as {language}: {}", chain(source.as_ref()))]
    Export {
        /// Name or path of the robot.
        robot: String,
        /// Target format.
        language: &'static str,
        /// Reason.
        source: BuildError,
    },
    /// Scenario that cannot be exported as an FMU.
    #[error("error: {source}")]
    Fmu {
        /// Reason.
        #[from]
        source: crate::fmu::ExportError,
    },
    /// Cell that cannot be predicted.
    #[error("error: {source}")]
    Cell {
        /// Reason.
        source: twinrig_sensor::SensorError,
    },
    /// Failure of a study as a whole.
    #[error("error: {}", placed(.source, .file))]
    Study {
        /// Scenario file.
        file: String,
        /// Reason.
        source: twinrig_study::StudyError,
    },
    /// Scenario without what a study of load filters requires.
    #[error("error: load filters cannot be studied: {why}\n --> {file}\n  = help: {help}")]
    NotEstimable {
        /// Scenario file.
        file: String,
        /// Missing part.
        why: String,
        /// Remedy.
        help: String,
    },
    /// Scenario without what a study of gaits requires.
    #[error("error: the gait cannot be studied: {why}\n --> {file}\n  = help: {help}")]
    NoGait {
        /// Scenario file.
        file: String,
        /// Missing or refused part.
        why: String,
        /// Remedy.
        help: String,
    },
    /// Scenario whose cheapest sufficient twin cannot be searched.
    #[error("error: no sufficient twin can be searched: {why}\n --> {file}\n  = help: {help}")]
    NoSufficiency {
        /// Scenario file.
        file: String,
        /// Missing or refused part.
        why: String,
        /// Remedy.
        help: String,
    },
    /// Failure of the store of a sweep.
    #[error("error: {source}")]
    Store {
        /// Reason.
        #[from]
        source: twinrig_campaign::sweep::StoreError,
    },
    /// Failure of a search.
    #[error("error: {source}")]
    Search {
        /// Reason.
        #[from]
        source: twinrig_campaign::search::SearchError,
    },
    /// Failure of the engine of a sweep; rows up to then are in the store.
    #[error("error: {source}")]
    Engine {
        /// Reason.
        #[from]
        source: twinrig_campaign::engine::EngineError,
    },
    /// Engine that this program does not have.
    #[error("error: this program has no engine `{name}`\n  = help: {help}")]
    NoEngine {
        /// Name of the engine.
        name: String,
        /// Remedy.
        help: String,
    },
    /// Runs of a sweep that have no row, as their workers did not survive.
    #[error(
        "error: {count} of the runs have no result; the first is {name}: {reason}\n  = help: all others are kept; the same command repeats these, also by another engine"
    )]
    LostRuns {
        /// Number of runs.
        count: usize,
        /// Name of the first one.
        name: String,
        /// Its reason.
        reason: String,
    },
    /// Program whose file cannot be read.
    #[error(
        "error: cannot read the program: {source}\n --> {}\n  = help: a sweep keeps its runs by the hash of the program",
        path.display()
    )]
    Program {
        /// Its file.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// Failure of the comparison with the thesis.
    #[cfg(feature = "cli")]
    #[error("error: {source}")]
    Thesis {
        /// Reason.
        #[from]
        source: crate::thesis::error::ThesisError,
    },
    /// Name of an example that this build does not contain.
    #[error("error: there is no example `{name}`\n  = help: {help}")]
    NoExample {
        /// Name of the example.
        name: String,
        /// Similar names, or the known ones.
        help: String,
    },
    /// File in place of an example, with other contents.
    #[error(
        "error: a file with other contents is in the place of the example, and nothing is written\n --> {}\n  = help: copy to another folder with --to DIR, or move the file away",
        path.display()
    )]
    ExampleInTheWay {
        /// Path of the file.
        path: PathBuf,
    },
    /// Folder with a result that would be overwritten.
    #[error(
        "error: this folder has the result of {of}\n --> {}\n  = help: give another folder with --out DIR, or remove this one",
        path.display()
    )]
    ForeignResult {
        /// Path of the result.
        path: PathBuf,
        /// Files that it is of.
        of: String,
    },
    /// Failure to write a file or folder.
    #[error("error: cannot write: {source}\n --> {}", path.display())]
    Write {
        /// Path of the file or folder.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
}

/// Returns the line that names the file; empty without a file.
fn at(file: &str) -> String {
    match file {
        "" => String::new(),
        file => format!("\n --> {file}"),
    }
}

/// Runs `operation` for the scenario in `file` and converts a panic to [`TwinError::Panic`].
pub(crate) fn guarded<R>(
    file: &str,
    operation: impl FnOnce() -> Result<R, TwinError>,
) -> Result<R, TwinError> {
    catch_panic(operation).unwrap_or_else(|source| {
        let file = file.to_owned();
        Err(TwinError::Panic { file, source })
    })
}

impl From<RobotError> for TwinError {
    fn from(error: RobotError) -> Self {
        match error {
            RobotError::Document(error) => error.into(),
            RobotError::NotFound { name, help } => {
                let message = format!("there is no robot `{name}`");
                let problems = vec![Problem::of_file(name, message, help)];
                DocumentError { problems }.into()
            }
        }
    }
}

/// Returns the command that must precede a build with `feature`, as a suffix of the help line.
fn after(feature: &str) -> String {
    let needs = crate::registry::build_needs(feature);
    needs.map_or_else(String::new, |needs| format!(", after `{needs}`"))
}

impl TwinError {
    /// Returns the message, with excerpts of files that fit `columns` if there is a limit.
    pub(crate) fn text(&self, columns: Option<usize>) -> String {
        match self {
            Self::Document(error) => error.text(columns),
            _ => self.to_string(),
        }
    }

    /// Returns the error of a part of `scenario` that cannot be built.
    pub(crate) fn not_built(
        scenario: &Scenario,
        what: &'static str,
        name: &str,
        source: BuildError,
    ) -> Self {
        // A mistake of the scenario has a better place.
        let source = match source.downcast::<DocumentError>() {
            Ok(mistake) => return Self::Document(*mistake),
            Err(source) => source,
        };
        Self::Build {
            what,
            name: name.to_owned(),
            file: scenario.file.clone(),
            source,
        }
    }

    /// Returns the error of a rig of `scenario` that cannot be built or that failed.
    pub(crate) fn rig(scenario: &Scenario, source: RigError) -> Self {
        Self::Rig {
            file: scenario.file.clone(),
            help: String::new(),
            source: Box::new(source),
        }
    }

    /// Returns the error of a scenario without a gait that can be studied.
    pub(crate) fn no_gait(file: &str, why: impl Into<String>, help: impl Into<String>) -> Self {
        Self::NoGait {
            file: file.to_owned(),
            why: why.into(),
            help: help.into(),
        }
    }

    /// Returns the error of an unknown bus `name`, with suggestions from the `known` ones.
    pub(crate) fn no_such_bus<'k>(name: &str, known: impl IntoIterator<Item = &'k str>) -> Self {
        let mut known = known.into_iter().peekable();
        let help = if known.peek().is_none() {
            "the scenario has no [bus], hence no connection to hardware".to_owned()
        } else {
            suggestion(name, "buses of this scenario", known)
        };
        let bus = name.to_owned();
        Self::NoSuchBus { bus, help }
    }
}

/// Returns the message of a study with the file between its first line and its remedy.
fn placed(source: &twinrig_study::StudyError, file: &str) -> String {
    let message = source.to_string();
    let (first, rest) = match message.find('\n') {
        Some(end) => message.split_at(end),
        None => (&*message, ""),
    };
    format!("{first}\n --> {file}{rest}")
}

/// Returns an error and all its causes in one line.
pub(crate) fn chain(error: &dyn std::error::Error) -> String {
    let mut line = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let text = error.to_string();
        if !line.ends_with(&text) {
            line = format!("{line}: {text}");
        }
        cause = error.source();
    }
    line
}
