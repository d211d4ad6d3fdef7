//! A finding of the check.

use serde::Serialize;

/// Whether something is as it should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum State {
    /// As it should be.
    Ok,
    /// Missing or limited; only some work needs it.
    Notice,
    /// Broken: what the item affects does not work.
    Problem,
}

/// A finding, what it affects, and the remedy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Item {
    /// Examined property.
    pub name: String,
    /// Whether it is as it should be.
    pub state: State,
    /// Finding.
    pub finding: String,
    /// Consequence for the user; empty if the state is [`State::Ok`].
    pub affects: String,
    /// Command or instruction; empty if the state is [`State::Ok`].
    pub remedy: String,
    /// Whether every run of this build needs it: such a problem decides the exit code.
    pub needed: bool,
}

impl Item {
    fn new(name: impl Into<String>, state: State, finding: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            state,
            finding: finding.into(),
            affects: String::new(),
            remedy: String::new(),
            needed: false,
        }
    }

    pub fn ok(name: impl Into<String>, finding: impl Into<String>) -> Self {
        Self::new(name, State::Ok, finding)
    }

    pub fn notice(name: impl Into<String>, finding: impl Into<String>) -> Self {
        Self::new(name, State::Notice, finding)
    }

    pub fn problem(name: impl Into<String>, finding: impl Into<String>) -> Self {
        Self::new(name, State::Problem, finding)
    }

    /// Adds what is affected, and the remedy.
    pub fn affecting(self, affects: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            affects: affects.into(),
            remedy: remedy.into(),
            ..self
        }
    }

    /// Marks what every run of this build needs.
    pub fn needed(self) -> Self {
        Self {
            needed: true,
            ..self
        }
    }

    /// Returns whether something that this build needs is broken.
    pub fn is_fatal(&self) -> bool {
        self.needed && self.state == State::Problem
    }
}
