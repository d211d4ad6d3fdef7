//! Errors of the comparison with the thesis.

use std::path::PathBuf;

use thiserror::Error;

/// Error of the comparison with the thesis.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ThesisError {
    /// Item that does not exist.
    #[error("there is no item `{id}`\n  = help: {help}")]
    UnknownItem {
        /// Identifier.
        id: String,
        /// Similar identifiers, or the command that lists them.
        help: String,
    },
    /// Scenario that is missing.
    #[error(
        "a scenario of the comparison is missing\n --> {}\n  = help: run in a clone of the repository, or name its folder by `--scenarios DIR`",
        path.display()
    )]
    NoScenario {
        /// Its path.
        path: PathBuf,
    },
    /// Record of gaits that cannot be read.
    #[error("the gaits of the comparison cannot be read: {why}\n --> {}", path.display())]
    Gaits {
        /// Its path.
        path: PathBuf,
        /// Reason.
        why: String,
    },
    /// Scenario that lacks an expectation.
    #[error(
        "the scenario has no expectation `{name}`, by which the item is measured\n --> {file}\n  = help: take the scenario of the repository"
    )]
    NoExpectation {
        /// Scenario file.
        file: String,
        /// Name of the expectation.
        name: String,
    },
    /// Setting of an item without a scenario.
    #[error("the item `{id}` runs no scenario, which could be set\n  = help: omit `--set`")]
    UnusedSetting {
        /// Identifier.
        id: String,
    },
    /// Run that did not complete.
    #[error("a run of the comparison did not complete: {reason}\n --> {file}")]
    Run {
        /// Scenario file.
        file: String,
        /// Reason.
        reason: String,
    },
    /// Robot or bench that lacks what an item is about.
    #[error("the scenario has no {what}, of which the item is\n --> {file}")]
    Lacks {
        /// Scenario file.
        file: String,
        /// Missing part.
        what: &'static str,
    },
    /// Leg without the poses of an item.
    #[error("the leg cannot be evaluated: {source}")]
    Leg {
        /// Reason.
        #[from]
        source: twinrig_robot::leg::LegError,
    },
    /// Cell whose models cannot be evaluated.
    #[error("the cells cannot be evaluated: {source}")]
    Cells {
        /// Reason.
        #[from]
        source: twinrig_sensor::SensorError,
    },
    /// Interrupt by the user.
    #[error("interrupted after {done} of {of} items")]
    Interrupted {
        /// Number of finished items.
        done: usize,
        /// Number of items.
        of: usize,
    },
}
