use thiserror::Error;
use twinrig_kernel::{BoardClockError, SimDuration};
use twinrig_runtime::TimingError;

/// A transport that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WireError {
    /// A time that something is divided into is zero.
    #[error("the {what} of {name} must be longer than zero")]
    Zero {
        /// Of which transport.
        name: String,
        /// Which time.
        what: &'static str,
    },
    /// A jitter cannot be drawn.
    #[error("{what} of {name}: {source}")]
    Jitter {
        /// Of which transport.
        name: String,
        /// Which jitter.
        what: &'static str,
        /// Why.
        source: TimingError,
    },
    /// The host controller's frames cannot run like that.
    #[error("frames of {name}: {source}")]
    Microframes {
        /// Of which transport.
        name: String,
        /// Why.
        source: BoardClockError,
    },
    /// There is no such preset.
    #[error("there is no USB timing {found:?}, but {known}")]
    Preset {
        /// What was asked for.
        found: String,
        /// Those that there are.
        known: String,
    },
    /// A probability or rate is outside of 0 to 1.
    #[error("{what} of a fault on {on} is {value}, not between 0 and 1")]
    Probability {
        /// Where the fault is.
        on: String,
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Refuses a time of zero.
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
