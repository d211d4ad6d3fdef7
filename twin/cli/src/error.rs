//! Errors of commands.

mod thesis;

use std::path::PathBuf;

use thiserror::Error;
use twinrig_document::DocumentError;
use twinrig_record::{LogError, RecordError};
use twinrig_robot::RobotError;

pub use thesis::ThesisError;
use twinrig_rig::error::{BuildError, Error, chain};
use twinrig_rig::registry::build_needs;

/// Error of a command; the exit code is 2 for all of them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TwinError {
    /// Error of a scenario, a rig or its run.
    #[error(transparent)]
    Rig(#[from] Error),
    /// Scenario without a bus, and thus without boards to emulate.
    #[error("error: there is no [bus] in this scenario, and so nothing to serve\n --> {file}")]
    NothingToServe {
        /// Scenario file.
        file: String,
    },
    /// File or folder that a command refuses.
    #[error("error: {why}\n --> {}\n  = help: {help}", path.display())]
    Refused {
        /// Path.
        path: PathBuf,
        /// Reason.
        why: String,
        /// Remedy.
        help: String,
    },
    /// Recordings that cannot be compared.
    #[error("error: {}", chain(source))]
    Compare {
        /// Reason.
        source: RecordError,
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
    /// Run that cannot be served to visitors.
    #[cfg(feature = "live")]
    #[error("error: {0}")]
    Live(#[from] twinrig_live::server::ServeError),
    /// Leg of a robot without a pose that is asked for.
    #[error("error: the leg of {robot} has no such pose: {source}")]
    Leg {
        /// Name or path of the robot.
        robot: String,
        /// Reason.
        source: twinrig_robot::leg::LegError,
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
        source: twinrig_rig::fmu::ExportError,
    },
    /// Cell that cannot be predicted.
    #[error("error: {source}")]
    Cell {
        /// Reason.
        source: twinrig_sensor::SensorError,
    },
    /// Log that cannot be imported.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Error of an experiment.
    #[error(transparent)]
    Experiment(twinrig_experiment::Error),
    /// Failure of the comparison with the thesis.
    #[error("error: {source}")]
    Thesis {
        /// Reason.
        #[from]
        source: ThesisError,
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
}

impl From<twinrig_experiment::Error> for TwinError {
    /// An error of a rig stays one, so that its excerpts of files fit the terminal.
    fn from(error: twinrig_experiment::Error) -> Self {
        match error {
            twinrig_experiment::Error::Rig(error) => error.into(),
            error => Self::Experiment(error),
        }
    }
}

impl From<DocumentError> for TwinError {
    fn from(error: DocumentError) -> Self {
        Error::from(error).into()
    }
}

impl From<RobotError> for TwinError {
    fn from(error: RobotError) -> Self {
        Error::from(error).into()
    }
}

impl TwinError {
    /// Returns the message, with excerpts of files that fit `columns` if there is a limit.
    pub(crate) fn text(&self, columns: Option<usize>) -> String {
        match self {
            Self::Rig(error) => error.text(columns),
            _ => self.to_string(),
        }
    }
}

/// Returns the command that must precede a build with `feature`, as a suffix of the help line.
fn after(feature: &str) -> String {
    let needs = build_needs(feature);
    needs.map_or_else(String::new, |needs| format!(", after `{needs}`"))
}
