//! Errors of instances and of the export.

use std::path::PathBuf;

use thiserror::Error;
use twinrig_runtime::{PanicReport, RigError, VariableError};

use crate::error::Error;

/// Error of an instance of an FMU.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FmuError {
    /// Resources that cannot be read.
    #[error("the resources of the FMU cannot be read: {source}: {}", path.display())]
    Read {
        /// File or folder.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// Resources that do not describe an FMU of this program.
    #[error("{}: {why}", path.display())]
    Manifest {
        /// The file that describes them.
        path: PathBuf,
        /// Reason.
        why: String,
    },
    /// A location of the resources that is no file on this machine.
    #[error("`{location}` is no folder of resources: {why}")]
    Location {
        /// The location.
        location: String,
        /// Reason.
        why: &'static str,
    },
    /// Resources, model description and library that do not belong together.
    #[error(
        "the model description has the token {given}, the resources have {expected}: export the FMU again, its files have been changed"
    )]
    Token {
        /// Token of the model description.
        given: String,
        /// Hash of the resources.
        expected: String,
    },
    /// Resources of another version of the library.
    #[error("the FMU was exported by version {exported}, its library has version {library}")]
    Version {
        /// Version of the exporting program.
        exported: String,
        /// Version of the library.
        library: &'static str,
    },
    /// A scenario that cannot be built.
    #[error("{0}")]
    Scenario(Box<Error>),
    /// There is no variable with that value reference and type.
    #[error("there is no {kind} variable with the value reference {reference}")]
    NoSuchVariable {
        /// `Real`, `Float64`, `String`.
        kind: &'static str,
        /// The value reference.
        reference: u32,
    },
    /// A variable that cannot be set.
    #[error("`{name}` is no input, and cannot be set")]
    NotAnInput {
        /// Its name.
        name: String,
    },
    /// An input that is infinite or NaN.
    #[error("`{name}` cannot be set to {value:?}: inputs are finite")]
    NotFinite {
        /// Its name.
        name: String,
        /// The value.
        value: f64,
    },
    /// A process variable out of its range, or a value that the controller refuses.
    #[error(transparent)]
    OutOfRange(#[from] VariableError),
    /// Numbers of values that do not match the variables.
    #[error("{given} values for variables with {expected} elements")]
    Length {
        /// Number of values.
        given: usize,
        /// Number of elements.
        expected: usize,
    },
    /// A time that is not finite or exceeds the range of the clock.
    #[error("{seconds:?} s is no time of the simulation, which reaches to ±9007199 s (104 days)")]
    NoTime {
        /// The time \[s\].
        seconds: f64,
    },
    /// A start time that is not finite or exceeds the range of the clock.
    #[error(
        "the simulation cannot start at {start_s:?} s: times reach to ±9007199 s (104 days); start it at 0 s"
    )]
    NoStart {
        /// The time \[s\].
        start_s: f64,
    },
    /// A step of negative length.
    #[error("the step has a length of {step_s:?} s, and time does not run backwards")]
    NegativeStep {
        /// Length of the step \[s\].
        step_s: f64,
    },
    /// A step that does not begin at the present time.
    #[error("the step begins at {current_s:?} s, and the present time is {now_s:?} s")]
    NotNow {
        /// Begin of the step \[s\].
        current_s: f64,
        /// Present time \[s\].
        now_s: f64,
    },
    /// A step into the past.
    #[error("the step ends at {to_s:?} s, and the present time is {now_s:?} s")]
    Past {
        /// End of the step \[s\].
        to_s: f64,
        /// Present time \[s\].
        now_s: f64,
    },
    /// A step past the stop time.
    #[error("the step ends at {to_s:?} s, after the stop time of {stop_s:?} s")]
    PastStop {
        /// End of the step \[s\].
        to_s: f64,
        /// Stop time \[s\].
        stop_s: f64,
    },
    /// Failure of plant, controller or driver.
    #[error(transparent)]
    Failed(#[from] RigError),
    /// Panic of a part: the instance is in no defined state.
    #[error("{0}: this is a bug in the named part")]
    Panic(#[from] PanicReport),
    /// Bytes that are no state of this FMU, or a state of another one.
    #[error("it is no state of this FMU: {why}")]
    State {
        /// Reason.
        why: String,
    },
}

impl FmuError {
    /// Returns whether the instance can no longer be used.
    pub fn is_fatal(&self) -> bool {
        matches!(self, Self::Panic(_))
    }
}

impl From<Error> for FmuError {
    fn from(error: Error) -> Self {
        match error {
            Error::Rig { source, .. } => Self::Failed(*source),
            error => Self::Scenario(Box::new(error)),
        }
    }
}

/// A scenario that cannot be exported, or a library that cannot be used.
#[derive(Debug, Error)]
pub enum ExportError {
    /// A part that the library of FMUs lacks.
    #[error("the {sort} `{name}` cannot be part of an FMU: {why}\n --> {file}\n  = help: {help}")]
    Part {
        /// `plant`, `controller` or `bus`.
        sort: &'static str,
        /// Its kind.
        name: String,
        /// Scenario file.
        file: String,
        /// Reason.
        why: &'static str,
        /// Remedy.
        help: &'static str,
    },
    /// The library is not where it is expected.
    #[error(
        "the library of FMUs is not found: {}\n  = help: {}",
        expected.as_ref().map_or_else(|| "the folder of this program is unknown".to_owned(), |path| path.display().to_string()),
        LIBRARY_HELP
    )]
    NoLibrary {
        /// Expected path.
        expected: Option<PathBuf>,
    },
    /// A file that cannot be read as the library.
    #[error("the library of FMUs cannot be read: {source}\n --> {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// A file that is another library, or one of another version.
    #[error(
        "this is not the library of FMUs of version {version}\n --> {}\n  = help: {}",
        path.display(),
        LIBRARY_HELP
    )]
    WrongLibrary {
        /// The file.
        path: PathBuf,
        /// Version of this program.
        version: &'static str,
    },
    /// A machine for which FMI has no folder of binaries.
    #[error("FMI {fmi} has no name for the platform {platform}")]
    Platform {
        /// Version of FMI.
        fmi: &'static str,
        /// The platform.
        platform: &'static str,
    },
    /// An archive that cannot be written.
    #[error("the archive cannot be written: {0}")]
    Archive(#[from] zip::result::ZipError),
    /// The exported resources cannot be instantiated.
    #[error("the FMU cannot be instantiated: {0}")]
    Instance(#[from] FmuError),
}

/// Remedy for a missing library.
const LIBRARY_HELP: &str = "build it by `cargo build --release -p twinrig-fmu` and name it by `--library target/release/libtwinrig_fmu.so`; the Python package that `pip install .` builds contains it";
