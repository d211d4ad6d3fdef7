use thiserror::Error;
use twinrig_kernel::{BoardClockError, SimDuration};
use twinrig_runtime::TimingError;

/// Invalid parameters of a transport or of a device at its far end.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WireError {
    /// A time used as a divisor is zero.
    #[error("the {what} of {name} must be longer than zero")]
    Zero {
        /// Name of the transport.
        name: String,
        /// Name of the time.
        what: &'static str,
    },
    /// The distribution of a jitter is invalid.
    #[error("{what} of {name}: {source}")]
    Jitter {
        /// Name of the transport.
        name: String,
        /// Name of the jitter.
        what: &'static str,
        /// Cause.
        source: TimingError,
    },
    /// The clock of the host controller is invalid.
    #[error("frames of {name}: {source}")]
    Microframes {
        /// Name of the transport.
        name: String,
        /// Cause.
        source: BoardClockError,
    },
    /// Unknown preset.
    #[error("unknown USB timing {found:?}; available: {known}")]
    Preset {
        /// Requested name.
        found: String,
        /// Known names.
        known: String,
    },
    /// A probability or rate lies outside \[0, 1\].
    #[error("{what} of a fault on {on} is {value}, not between 0 and 1")]
    Probability {
        /// Place of the fault.
        on: String,
        /// Name of the number.
        what: &'static str,
        /// Value.
        value: f64,
    },
    /// A fault counts frames behind a kind of message that the wire does not have.
    #[error("there is no message `{found}` on {on}; its messages are: {known}")]
    Message {
        /// Place of the fault.
        on: String,
        /// Requested kind of message.
        found: String,
        /// Known kinds.
        known: String,
    },
    /// A board with a fault of its supply that does not model a loss of it.
    #[error("the board at {on} does not model a loss of its supply; unplug it instead")]
    Supply {
        /// Place of the board.
        on: String,
    },
    /// Two faults of one clock.
    #[error("two faults `drift` act on the clock of {on}; give one")]
    Drifts {
        /// Place of the board.
        on: String,
    },
    /// A fault of a clock exceeds its range.
    #[error("fault `drift` on {on}: {source}")]
    Drift {
        /// Place of the board.
        on: String,
        /// Cause.
        source: BoardClockError,
    },
    /// A fault that acts on boards has a direction of bytes.
    #[error("a fault `{kind}` on {on} acts on boards, not on bytes: give no direction")]
    Direction {
        /// Place of the fault.
        on: String,
        /// Name of the kind of fault.
        kind: &'static str,
    },
    /// A fault that does not act on frames chooses some, or a phase.
    #[error(
        "a fault `{kind}` on {on} acts in a window of time only: give neither frames nor phase"
    )]
    Selection {
        /// Place of the fault.
        on: String,
        /// Name of the kind of fault.
        kind: &'static str,
    },
    /// A fault chooses the frames of number zero.
    #[error("a fault on {on} chooses frames by the number 0; they are counted from 1")]
    FrameNumber {
        /// Place of the fault.
        on: String,
    },
    /// A channel of a device does not exist or is used twice.
    #[error("{what} {number} of {count} does not exist, or is used twice")]
    Channel {
        /// Kind of channel.
        what: &'static str,
        /// Its number.
        number: usize,
        /// Number of channels of this kind.
        count: usize,
    },
}

/// Checks that each number is one of `count` channels, and used once.
///
/// # Errors
/// [`WireError::Channel`] with the first that is not.
pub fn check_channels(
    what: &'static str,
    count: usize,
    numbers: impl IntoIterator<Item = usize>,
) -> Result<(), WireError> {
    let mut used = Vec::new();
    for number in numbers {
        if number >= count || used.contains(&number) {
            return Err(WireError::Channel {
                what,
                number,
                count,
            });
        }
        used.push(number);
    }
    Ok(())
}

/// Checks that a time is not zero.
///
/// # Errors
/// [`WireError::Zero`] if it is.
pub(crate) fn nonzero(
    name: &str,
    what: &'static str,
    duration: SimDuration,
) -> Result<(), WireError> {
    if duration.is_zero() {
        return Err(WireError::Zero {
            name: name.to_owned(),
            what,
        });
    }
    Ok(())
}
