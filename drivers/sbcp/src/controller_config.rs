use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

use crate::codes::{BYTE_TIME, FRAME_MAX, PACKET_MAX};
use crate::error::SbcpError;

/// Forwarding mode of the bus controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ForwardingMode {
    /// Bytes are relayed as they arrive, once the address is known.
    CutThrough,
    /// Packets are forwarded when they are complete, in both directions.
    StoreAndForward,
}

/// Configuration of the bus controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControllerConfig {
    /// Id of the controller.
    pub id: u8,
    /// Forwarding mode: cut-through.
    pub passing: ForwardingMode,
    /// Maximum time from a request's last bit to the end of the answer's first byte, and maximum
    /// delay of an answer's end relative to its length byte: 20 µs (thesis, section 5.3.2).
    pub timeout: SimDuration,
    /// Maximum time from the end of an answer's first byte to the end of its last: 130 µs, ASSUMED.
    pub response_limit: SimDuration,
    /// Time from an answer's last bit to the next request's first: 2 µs, ASSUMED.
    pub gap: SimDuration,
    /// Silence on the link that ends a request: 15 µs, ASSUMED.
    pub idle_gap: SimDuration,
    /// Size of the buffer in requests, including the one on the bus: 4.
    pub packets_max: usize,
    /// Time of a byte (ten bits), on the link and on the bus.
    pub byte_time: SimDuration,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        Self {
            id: 1,
            passing: ForwardingMode::CutThrough,
            timeout: SimDuration::from_micros(20),
            response_limit: SimDuration::from_micros(130),
            gap: SimDuration::from_micros(2),
            idle_gap: SimDuration::from_micros(15),
            packets_max: FRAME_MAX,
            byte_time: BYTE_TIME,
        }
    }
}

/// Maximum reaction time of a board (thesis, section 5.3.2): a time-out must be at least this and a
/// byte.
const REACTION_MAX: SimDuration = SimDuration::from_micros(10);

impl ControllerConfig {
    /// Checks that valid answers are relayed.
    pub(crate) fn check(&self) -> Result<(), SbcpError> {
        let byte_time = self.byte_time;
        if byte_time.is_zero() {
            return Err(SbcpError::ByteTime);
        }
        let least = REACTION_MAX + byte_time;
        if self.timeout < least {
            let (nanos, least) = (self.timeout.as_nanos(), least.as_nanos());
            return Err(SbcpError::Timeout { nanos, least });
        }
        let least = byte_time * (PACKET_MAX as u64 - 1);
        if self.response_limit < least {
            let (nanos, least) = (self.response_limit.as_nanos(), least.as_nanos());
            return Err(SbcpError::Limit { nanos, least });
        }
        if self.packets_max == 0 {
            return Err(SbcpError::Frame { packets: 0 });
        }
        Ok(())
    }
}

/// Counters of a bus controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControllerCounters {
    /// Requests transmitted on the bus.
    pub requests: u64,
    /// Valid answers relayed.
    pub answers: u64,
    /// Error packets sent in the name of boards, including those for overflows and time-outs.
    pub failures: u64,
    /// Requests without an answer of the board.
    pub timeouts: u64,
    /// Requests dropped because the buffer was full.
    pub overflows: u64,
    /// Bytes from the host outside packets \[B\].
    pub garbage: u64,
    /// Bytes from both sides dropped for a wrong stop bit \[B\].
    pub framing_errors: u64,
}
