use thiserror::Error;
use twinrig_sbcp::{FRAME_MAX, SbcpError};
use twinrig_wire::WireError;

/// Invalid configuration of a bus.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BusError {
    /// Rejected by the protocol.
    #[error(transparent)]
    Sbcp(#[from] SbcpError),
    /// Rejected by the transport.
    #[error(transparent)]
    Wire(#[from] WireError),
    /// More boards are used than one frame can address.
    #[error("{boards} boards are used, but a frame addresses at most {FRAME_MAX}")]
    Boards {
        /// Number of boards used.
        boards: usize,
    },
    /// Two boards share a name or an id and would answer simultaneously.
    #[error("{first} and {second} have the same name or id")]
    Twice {
        /// Name of the one board.
        first: String,
        /// Name of the other.
        second: String,
    },
    /// The cycle period is not a whole number of milliseconds from 1 to 1000: boards interpolate
    /// over whole milliseconds.
    #[error("a period of {millis} ms is not a whole number of milliseconds from 1 to 1000")]
    Period {
        /// The period \[ms\].
        millis: f64,
    },
}
