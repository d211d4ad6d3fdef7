//! Requests of visitors.

use serde::Deserialize;

/// Request of a visitor, by the name of its service.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "service", rename_all = "lowercase", deny_unknown_fields)]
pub enum Request {
    /// Time goes on.
    Play,
    /// Time stands still.
    Pause,
    /// Advance, then stand still.
    Step {
        /// Where to.
        #[serde(default)]
        to: StepTo,
    },
    /// Go to an instant.
    Seek {
        /// The instant \[s\].
        at_s: f64,
    },
    /// How fast time goes on.
    Speed {
        /// Simulated time over wall-clock time; 0: as fast as possible.
        factor: f64,
    },
    /// Change a process variable.
    Set {
        /// Its name.
        variable: String,
        /// Its new value, in its unit.
        value: f64,
    },
    /// Limit how fast changes are made.
    Slew {
        /// Greatest change of a variable, in multiples of its default value per second; 0: at once.
        rate: f64,
    },
    /// Go to a branch.
    Branch {
        /// Its number.
        number: usize,
        /// Instant \[s\]; none: the latest that it has reached.
        at_s: Option<f64>,
    },
    /// Compare two branches, footstep by footstep.
    Compare {
        /// Number of the first.
        one: usize,
        /// Number of the second.
        other: usize,
    },
    /// Save the present values of the process variables.
    Save {
        /// Name of the set.
        name: String,
    },
    /// Set the process variables to saved values.
    Recall {
        /// Name of the set.
        name: String,
    },
}

/// Where a step leads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StepTo {
    /// To the next event.
    #[default]
    Event,
    /// To the next control step.
    Control,
}

/// Names of the services.
pub const SERVICES: [&str; 11] = [
    "play", "pause", "step", "seek", "speed", "set", "slew", "branch", "compare", "save", "recall",
];
