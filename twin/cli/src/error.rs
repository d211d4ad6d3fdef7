//! What can be wrong before, during and after a run.

use std::path::PathBuf;

use thiserror::Error;
use twinrig_document::{DocumentError, Problem, suggestion};
use twinrig_record::RecordError;
use twinrig_robot::RobotError;
use twinrig_runtime::{DeviceError, PanicReport, RigError, caught};
use twinrig_scenario::Scenario;

/// Error of a part's builder; `?` converts any error into one.
pub type BuildError = Box<dyn std::error::Error + Send + Sync>;

/// Reason of a part that requires a robot.
pub(crate) const NO_ROBOT: &str = "it needs a robot, and the scenario names none: add `robot = …`, or take a part that needs none";

/// Why something could not be done. Every one of them is exit code 2.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TwinError {
    /// A scenario or robot file is wrong; the message shows where.
    #[error(transparent)]
    Document(#[from] DocumentError),
    /// A part refuses what it is built from.
    #[error("error: the {what} `{name}` cannot be built: {}\n --> {file}", chain(source.as_ref()))]
    Build {
        /// `plant` or `controller`.
        what: &'static str,
        /// Which kind.
        name: String,
        /// The scenario.
        file: String,
        /// Why not.
        source: BuildError,
    },
    /// The parts do not go together, or one of them stopped.
    #[error("error: {source}\n --> {file}{help}")]
    Rig {
        /// The scenario.
        file: String,
        /// What to do, as a line of its own; may be empty.
        help: String,
        /// What happened.
        source: Box<RigError>,
    },
    /// A part panicked, or this program did.
    #[error(
        "error: {source}{}\n  = help: this is a bug in it; with RUST_BACKTRACE=1 the calls that led there are printed",
        at(file)
    )]
    Panic {
        /// The scenario; empty if none was being run.
        file: String,
        /// What happened, and where.
        source: PanicReport,
    },
    /// A device is given to a bus that the scenario does not have.
    #[error("error: there is no bus `{bus}` in this scenario\n  = help: {help}")]
    NoSuchBus {
        /// The bus.
        bus: String,
        /// What may have been meant.
        help: String,
    },
    /// There are no boards to be served.
    #[error("error: there is no [bus] in this scenario, and so nothing to serve\n --> {file}")]
    NothingToServe {
        /// The scenario.
        file: String,
    },
    /// A bus has no device, though others have.
    #[error(
        "error: the bus `{bus}` has no device\n  = help: at hardware every bus needs one: add `--port {bus}=DEVICE`, or run without --port to run on the twin; `twin devices` lists devices"
    )]
    NoPort {
        /// The bus.
        bus: String,
    },
    /// A device cannot be used.
    #[error("error: bus `{bus}`: {source}")]
    Device {
        /// The bus.
        bus: String,
        /// Why not.
        source: DeviceError,
    },
    /// A recording cannot be written or read.
    #[error("error: {}\n --> {}", chain(source), path.display())]
    Record {
        /// The recording.
        path: PathBuf,
        /// Why not.
        source: RecordError,
    },
    /// Recordings cannot be compared.
    #[error("error: {}", chain(source))]
    Compare {
        /// Why not.
        source: RecordError,
    },
    /// What several plants, or a time from which they go on, are given with cannot be.
    #[error("error: {why}\n  = help: {help}")]
    Together {
        /// Why not.
        why: String,
        /// What to do.
        help: String,
    },
    /// A recording lacks what it takes to run it again.
    #[error("error: this recording cannot be run again: {why}\n --> {}", path.display())]
    NotReplayable {
        /// The recording.
        path: PathBuf,
        /// What is missing.
        why: String,
    },
    /// This build lacks it.
    #[error(
        "error: this build cannot {what}\n  = help: build with `--features {feature}`{}",
        after(feature)
    )]
    MissingFeature {
        /// What it cannot do.
        what: &'static str,
        /// The cargo feature that it lacks.
        feature: &'static str,
    },
    /// A robot cannot be written in another language.
    #[error("error: {robot} cannot be written as {language}: {}", chain(source.as_ref()))]
    Export {
        /// The robot.
        robot: String,
        /// The language.
        language: &'static str,
        /// Why not.
        source: BuildError,
    },
    /// There is no study.
    #[error("error: {source}\n --> {file}")]
    Study {
        /// The scenario.
        file: String,
        /// Why not.
        source: twinrig_study::StudyError,
    },
    /// A file or folder cannot be written.
    #[error("error: cannot write: {source}\n --> {}", path.display())]
    Write {
        /// Where.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
}

/// The line that says which file it is about.
fn at(file: &str) -> String {
    match file {
        "" => String::new(),
        file => format!("\n --> {file}"),
    }
}

/// Does `what` for the scenario in `file`; a panic in it is an error like any other.
pub(crate) fn guarded<R>(
    file: &str,
    what: impl FnOnce() -> Result<R, TwinError>,
) -> Result<R, TwinError> {
    caught(what).unwrap_or_else(|source| {
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

/// What comes before a build with a feature.
fn after(feature: &str) -> String {
    let needs = crate::assembly::registry::build_needs(feature);
    needs.map_or_else(String::new, |needs| format!(", after `{needs}`"))
}

impl TwinError {
    /// A part that `scenario` names and that cannot be built.
    pub(crate) fn not_built(
        scenario: &Scenario,
        what: &'static str,
        name: &str,
        source: BuildError,
    ) -> Self {
        Self::Build {
            what,
            name: name.to_owned(),
            file: scenario.file.clone(),
            source,
        }
    }

    /// A rig of `scenario` that cannot be built, or that failed.
    pub(crate) fn rig(scenario: &Scenario, source: RigError) -> Self {
        Self::Rig {
            file: scenario.file.clone(),
            help: String::new(),
            source: Box::new(source),
        }
    }

    /// That there is no bus `name` among those of a scenario.
    pub(crate) fn no_such_bus<'k>(name: &str, known: impl IntoIterator<Item = &'k str>) -> Self {
        let mut known = known.into_iter().peekable();
        let help = if known.peek().is_none() {
            "it has no [bus] at all, and nothing to be joined to hardware".to_owned()
        } else {
            suggestion(name, "buses of this scenario", known)
        };
        let bus = name.to_owned();
        Self::NoSuchBus { bus, help }
    }
}

/// An error with all its causes in one line.
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
