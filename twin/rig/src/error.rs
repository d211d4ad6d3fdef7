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
pub const NO_ROBOT: &str =
    "it needs a robot, and the scenario names none: add `robot = …`, or use a part that needs none";

/// Error of a scenario, a rig or its run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
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
    /// Plant whose numerical error cannot be found by refinement.
    #[error(
        "error: the plant `{plant}` declares neither a step nor a tolerance: its numerical error is unknown\n --> {file}\n  = help: leave out `--error-bars`, or take another plant"
    )]
    Accuracy {
        /// Scenario file.
        file: String,
        /// Kind of the plant.
        plant: String,
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
    /// Options that are incompatible with each other, or an element of a list that is there twice.
    #[error("error: {why}\n  = help: {help}")]
    InvalidOptions {
        /// Reason.
        why: String,
        /// Remedy.
        help: String,
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

/// Runs `operation` for the scenario in `file` and converts a panic to [`Error::Panic`].
///
/// # Errors
/// That of the operation, or its panic.
pub fn guarded<R, E: From<Error>>(
    file: &str,
    operation: impl FnOnce() -> Result<R, E>,
) -> Result<R, E> {
    catch_panic(operation).unwrap_or_else(|source| {
        let file = file.to_owned();
        Err(Error::Panic { file, source }.into())
    })
}

impl From<RobotError> for Error {
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

impl Error {
    /// Returns the message, with excerpts of files that fit `columns` if there is a limit.
    pub fn text(&self, columns: Option<usize>) -> String {
        match self {
            Self::Document(error) => error.text(columns),
            _ => self.to_string(),
        }
    }

    /// Returns the error of a part of `scenario` that cannot be built.
    pub fn not_built(
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

/// Returns an error and all its causes in one line.
pub fn chain(error: &dyn std::error::Error) -> String {
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
