use thiserror::Error;
use twinrig_sbcp::{FRAME_MAX, SbcpError};
use twinrig_wire::WireError;

/// A bus that cannot be built.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BusError {
    /// The protocol refuses something.
    #[error(transparent)]
    Sbcp(#[from] SbcpError),
    /// The transport refuses something.
    #[error(transparent)]
    Wire(#[from] WireError),
    /// A frame has no room for all boards that are used.
    #[error("{boards} boards are used, and a frame has room for {FRAME_MAX}")]
    Boards {
        /// How many are used.
        boards: usize,
    },
    /// Two boards would answer at once.
    #[error("{first} and {second} have the same name or id")]
    Twice {
        /// A board.
        first: String,
        /// Another.
        second: String,
    },
    /// Set-points cannot come at that pace.
    #[error("a period of {millis} ms: boards interpolate over whole milliseconds, 1 to 1000")]
    Period {
        /// The period \[ms\].
        millis: f64,
    },
}
