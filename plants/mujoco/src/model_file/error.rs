//! What can be wrong with a model, or with what is wanted of it.

use thiserror::Error;
use twinrig_kernel::Unit;

use crate::engine::EngineError;
use crate::engine::refusal::line;
use crate::model_file::signals::ElementKind;

/// Why there is no plant.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ModelFileError {
    /// The library is not the right one, or refuses the model.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The path has what no path can have.
    #[error("this is no path of a file")]
    Path,
    /// The bytes are no compiled model of this version.
    #[error("this is no compiled model of MuJoCo 3.17.0")]
    Binary,
    /// There is no such keyframe.
    #[error("the model has no keyframe `{name}`")]
    Keyframe {
        /// The name.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// The model has no step, or none that a plant could take.
    #[error("the model's own timestep is {seconds} s")]
    Step {
        /// It.
        seconds: f64,
    },
    /// A leg whose side nobody can tell.
    #[error("nothing of leg `{leg}` has a place in the model, so it is neither fore nor hind")]
    Nowhere {
        /// The leg.
        leg: String,
    },
    /// Signals cannot be what they are wanted to be.
    #[error("{}", .0.iter().map(|one| one.why.to_string()).collect::<Vec<_>>().join("; "))]
    Signals(Vec<SignalMismatch>),
}

impl ModelFileError {
    /// The line of the model's file that MuJoCo says it refuses, counted from 1; of a file that it includes, if it does.
    pub fn line(&self) -> Option<usize> {
        match self {
            Self::Engine(EngineError::Model(message)) => line(message),
            _ => None,
        }
    }
}

/// A signal that cannot be what it is wanted to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SignalMismatch {
    /// Its number among the inputs, or else among the outputs.
    pub index: usize,
    /// Whether it is an input.
    pub input: bool,
    /// What of the wish is wrong.
    pub place: Place,
    /// How.
    pub why: SignalError,
}

/// What of a wish is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The name of the signal.
    Signal,
    /// The name of the thing.
    ElementKind,
    /// What of the thing.
    Word,
    /// The unit.
    Unit,
}

/// Why a signal cannot be what it is wanted to be.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SignalError {
    /// The model has no such thing.
    #[error("the model has no {thing} `{name}`")]
    Unknown {
        /// What kind of thing.
        thing: ElementKind,
        /// Its name.
        name: String,
        /// The names there are.
        known: Vec<String>,
        /// What else has the name.
        other: Option<ElementKind>,
    },
    /// A thing of that kind has no such measurement.
    #[error("a {what} has no `{word}`")]
    Word {
        /// What kind of thing, in words.
        what: &'static str,
        /// What is wanted of it.
        word: String,
        /// What it has.
        known: &'static [&'static str],
    },
    /// It is in another unit.
    #[error("it is in {known}, not in {wanted}")]
    Unit {
        /// As the model has it.
        known: Unit,
        /// As it is wanted.
        wanted: Unit,
    },
    /// The signal is one that everybody knows, and is not this.
    #[error("`{signal}` is {expected} everywhere, and this is {found}")]
    Standard {
        /// The signal.
        signal: String,
        /// Unit and size that it has.
        expected: String,
        /// Those of the thing.
        found: String,
    },
    /// It is no name of a signal.
    #[error("`{signal}` is no name of a signal")]
    Name {
        /// The name.
        signal: String,
    },
    /// The plant has a signal of that name anyway.
    #[error("`{signal}` is a signal of every such plant already")]
    Taken {
        /// The signal.
        signal: String,
    },
    /// Two signals drive one actuator.
    #[error("the actuator `{actuator}` is driven by `{other}` already")]
    Driven {
        /// The actuator.
        actuator: String,
        /// The first signal.
        other: String,
    },
}
