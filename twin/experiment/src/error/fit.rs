use thiserror::Error;

/// Reason why a fit is impossible.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// A recording lacks a signal.
    #[error("{recording} has no signal `{signal}`{nearest}")]
    NoSignal {
        /// File of the recording.
        recording: String,
        /// The signal.
        signal: String,
        /// The nearest name, as a sentence.
        nearest: String,
    },
    /// A signal has no samples.
    #[error("`{signal}` has no samples in {recording}")]
    Empty {
        /// File of the recording.
        recording: String,
        /// The signal.
        signal: String,
    },
    /// A recording has no command for the twin.
    #[error("{recording} has none of the inputs of the twin: {inputs}")]
    NoCommands {
        /// File of the recording.
        recording: String,
        /// Names of the inputs.
        inputs: String,
    },
    /// A signal has more than one component, or not the one named.
    #[error(
        "`{signal}` has {size} component(s): commands and states have one, \
         a residual names one by `component`, counted from 0"
    )]
    Component {
        /// The signal.
        signal: String,
        /// Components.
        size: usize,
    },
    /// The twin has no such signal.
    #[error("{0}")]
    Playback(#[from] twinrig_rig::playback::PlaybackError),
    /// A value of `[[residual]]` or `[[start]]` is no quantity of the unit of its signal.
    #[error("`{key}` of `{signal}`: {why}")]
    Distance {
        /// `deviation`, `spike` or `minus`.
        key: &'static str,
        /// The signal.
        signal: String,
        /// Reason.
        why: String,
    },
    /// A recording does not state the value by which recordings are left out.
    #[error("{recording} does not state `{key}`, by which recordings are left out")]
    LeftOut {
        /// File of the recording.
        recording: String,
        /// The key.
        key: String,
    },
    /// All recordings are left out together.
    #[error(
        "without the recordings left out there are none to fit: \
         give others, or leave --cross-validate out"
    )]
    NothingLeft,
    /// Settings hold all dimensions.
    #[error("no dimension is left to fit: the settings hold all of them")]
    AllHeld,
    /// The twin does not start as the recording does.
    #[error("the twin cannot start as {recording}: {why}")]
    Start {
        /// File of the recording.
        recording: String,
        /// Reason.
        why: String,
    },
    /// Fewer samples than parameters.
    #[error("{samples} samples cannot tell {parameters} parameters")]
    TooFewSamples {
        /// Samples of all recordings.
        samples: usize,
        /// Parameters.
        parameters: usize,
    },
    /// The same recording twice.
    #[error("{0} is given twice")]
    Twice(String),
    /// Failure of least squares.
    #[error("{0}")]
    Minimum(#[from] twinrig_campaign::least_squares::Failure),
}
