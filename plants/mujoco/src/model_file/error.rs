//! Errors of models and of their signals.

use thiserror::Error;
use twinrig_kernel::Unit;

use crate::engine::EngineError;
use crate::engine::refusal::line;
use crate::model_file::signals::ElementKind;

/// Reason why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ModelFileError {
    /// The library has another version, or refuses the model.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The path is not UTF-8 or contains a NUL.
    #[error("this is not a file path")]
    Path,
    /// The bytes are not a compiled model of this version.
    #[error("this is not a compiled model of MuJoCo 3.17.0")]
    Binary,
    /// The model has no keyframe of this name.
    #[error("the model has no keyframe `{name}`")]
    Keyframe {
        /// The requested name.
        name: String,
        /// Names of the model's keyframes.
        known: Vec<String>,
    },
    /// The model's timestep is not a valid step.
    #[error("the model's own timestep, {seconds} s, is not between 1 ns and 1 h")]
    Step {
        /// The timestep \[s\].
        seconds: f64,
    },
    /// The side of a leg cannot be determined.
    #[error("no element of leg `{leg}` has a position in the model, so its side is unknown")]
    Nowhere {
        /// The leg.
        leg: String,
    },
    /// Signals do not match the model.
    #[error("{}", .0.iter().map(|one| one.why.to_string()).collect::<Vec<_>>().join("; "))]
    Signals(Vec<SignalMismatch>),
}

impl ModelFileError {
    /// Returns the line of the model's file in MuJoCo's message, counted from 1; for an error in an
    /// included file, the line of that file.
    pub fn line(&self) -> Option<usize> {
        match self {
            Self::Engine(EngineError::Model(message)) => line(message),
            _ => None,
        }
    }
}

/// Mismatch of a signal and the model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SignalMismatch {
    /// Index among the inputs, or else among the outputs.
    pub index: usize,
    /// Whether it is an input.
    pub input: bool,
    /// The wrong part of the declaration.
    pub place: Place,
    /// The reason.
    pub why: SignalError,
}

/// Part of a signal's declaration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The name of the signal.
    Signal,
    /// The name of the element.
    ElementKind,
    /// The measured quantity of the element.
    Word,
    /// The unit.
    Unit,
}

/// Reason why a signal does not match the model.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SignalError {
    /// The model has no element of this kind and name.
    #[error("the model has no {thing} `{name}`")]
    Unknown {
        /// Kind of the element.
        thing: ElementKind,
        /// Requested name.
        name: String,
        /// Names of the model's elements of this kind.
        known: Vec<String>,
        /// Another kind of element with this name.
        other: Option<ElementKind>,
    },
    /// An element of this kind has no such quantity.
    #[error("a {what} has no `{word}`")]
    Word {
        /// Kind of the element, in words.
        what: &'static str,
        /// Requested quantity.
        word: String,
        /// Available quantities.
        known: &'static [&'static str],
    },
    /// The units of model and scenario differ.
    #[error("it is in {known}, not in {wanted}")]
    Unit {
        /// Unit in the model.
        known: Unit,
        /// Unit in the scenario.
        wanted: Unit,
    },
    /// A standard signal has another unit or size than required.
    #[error("the standard signal `{signal}` is {expected}, but this is {found}")]
    Standard {
        /// The signal.
        signal: String,
        /// Required unit and size.
        expected: String,
        /// Unit and size of the element.
        found: String,
    },
    /// The name of the signal is invalid.
    #[error("`{signal}` is not a valid signal name")]
    Name {
        /// The name.
        signal: String,
    },
    /// The name is that of a built-in signal.
    #[error("`{signal}` is a built-in signal of the plant")]
    Taken {
        /// The signal.
        signal: String,
    },
    /// Two signals drive one actuator.
    #[error("the actuator `{actuator}` is already driven by `{other}`")]
    Driven {
        /// The actuator.
        actuator: String,
        /// The first signal.
        other: String,
    },
}
