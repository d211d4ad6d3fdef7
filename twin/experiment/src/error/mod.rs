//! Errors of experiments.

mod fit;
mod study;

use std::path::PathBuf;

use thiserror::Error;
use twinrig_document::DocumentError;
use twinrig_rig::error::Error as RigError;
use twinrig_robot::RobotError;

pub use fit::FitError;
pub use study::StudyError;

/// Error that prevents an experiment, or ends it as a whole.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// Error of a scenario, a rig or its run.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// Failure of a study as a whole.
    #[error("error: {}", placed(.source, .file))]
    Study {
        /// Scenario file.
        file: String,
        /// Reason.
        source: StudyError,
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
    /// A fit that is not possible.
    #[error("error: {0}")]
    Fit(#[from] FitError),
    /// A recording that cannot be read.
    #[error("error: {0}")]
    Recording(#[from] twinrig_record::RecordError),
    /// Failure of a store of rows.
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
    /// Failure of an engine; rows up to then are in the store.
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
    /// Runs that have no row, as their workers did not survive.
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
    /// Study of which runs are left to other partitions.
    #[error(
        "{missing} of {of} runs are not done yet\n  = help: they are of other partitions; when these are done, the same command has the result"
    )]
    Partial {
        /// Number of runs that are not done.
        missing: usize,
        /// Number of all runs of the round.
        of: usize,
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
}

impl From<DocumentError> for Error {
    fn from(error: DocumentError) -> Self {
        RigError::from(error).into()
    }
}

impl From<RobotError> for Error {
    fn from(error: RobotError) -> Self {
        RigError::from(error).into()
    }
}

impl Error {
    /// Returns the error of a study of the scenario in `file`.
    pub fn of_study(file: &str, source: StudyError) -> Self {
        let file = file.to_owned();
        Self::Study { file, source }
    }

    /// Returns the error of a scenario without a gait that can be studied.
    pub(crate) fn no_gait(file: &str, why: impl Into<String>, help: impl Into<String>) -> Self {
        Self::NoGait {
            file: file.to_owned(),
            why: why.into(),
            help: help.into(),
        }
    }
}

/// Returns the message of a study with the file between its first line and its remedy.
fn placed(source: &StudyError, file: &str) -> String {
    let message = source.to_string();
    let (first, rest) = match message.find('\n') {
        Some(end) => message.split_at(end),
        None => (&*message, ""),
    };
    format!("{first}\n --> {file}{rest}")
}

/// Returns the first line of a message, without the word before it.
pub(crate) fn first_line(error: &str) -> String {
    let line = error.lines().next().unwrap_or_default();
    line.trim_start_matches("error: ").to_owned()
}
