use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

use crate::codes::{BYTE_TIME, FRAME_MAX, PACKET_MAX};
use crate::error::SbcpError;

/// How the bus controller passes bytes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Passing {
    /// As they come, as soon as it is known whom they are for.
    CutThrough,
    /// When the packet is complete, both ways.
    StoreAndForward,
}

/// How the bus controller behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControllerConfig {
    /// Its own id.
    pub id: u8,
    /// How it passes bytes on: cut-through.
    pub passing: Passing,
    /// From a request's last bit to the end of the answer's first byte, and how much later than its length
    /// byte promises an answer may end: 20 µs (thesis, section 5.3.2).
    pub timeout: SimDuration,
    /// From the end of an answer's first byte to the end of its last: 130 µs, ASSUMED.
    pub response_limit: SimDuration,
    /// From an answer's last bit to the next request's first: 2 µs, ASSUMED.
    pub gap: SimDuration,
    /// Silence on the link that ends a request: 15 µs, ASSUMED.
    pub idle_gap: SimDuration,
    /// Requests that it holds, the one on the bus included: 4.
    pub packets_max: usize,
    /// Ten bits, on the link and on the bus.
    pub byte_time: SimDuration,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        Self {
            id: 1,
            passing: Passing::CutThrough,
            timeout: SimDuration::from_micros(20),
            response_limit: SimDuration::from_micros(130),
            gap: SimDuration::from_micros(2),
            idle_gap: SimDuration::from_micros(15),
            packets_max: FRAME_MAX,
            byte_time: BYTE_TIME,
        }
    }
}

/// Longest reaction of a good board (thesis, section 5.3.2): no time-out may be shorter than this and a byte.
const REACTION_MAX: SimDuration = SimDuration::from_micros(10);

impl ControllerConfig {
    /// Whether a good answer would pass at all.
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

/// What a bus controller has counted since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControllerCounters {
    /// Requests put on the bus.
    pub requests: u64,
    /// Good answers passed on.
    pub answers: u64,
    /// Error packets sent in a board's place, those for overflows and silent boards included.
    pub failures: u64,
    /// Boards that kept silent.
    pub timeouts: u64,
    /// Requests dropped because the buffer was full.
    pub overflows: u64,
    /// Bytes from the host that belonged to no packet \[B\].
    pub garbage: u64,
    /// Bytes from either side that were dropped for a wrong stop bit \[B\].
    pub framing_errors: u64,
}
