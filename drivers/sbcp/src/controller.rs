use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{BYTE_TIME, FRAME_MAX};
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
    /// From a request's last bit to the end of the answer's first byte, and within an answer from one byte
    /// to the next: 20 µs (thesis, section 5.3.2).
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

/// What a bus controller has counted since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ControllerCounters {
    /// Requests put on the bus.
    pub requests: u64,
    /// Good answers passed on.
    pub answers: u64,
    /// Error packets sent in a board's place.
    pub failures: u64,
    /// Of them, for boards that kept silent.
    pub timeouts: u64,
    /// Requests dropped because the buffer was full.
    pub overflows: u64,
    /// Bytes from the link that belonged to no packet \[B\].
    pub garbage: u64,
}

/// The bus controller.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Controller {
    config: ControllerConfig,
    counters: ControllerCounters,
}

impl Controller {
    /// A controller.
    ///
    /// # Errors
    /// [`SbcpError`].
    pub fn new(config: ControllerConfig) -> Result<Self, SbcpError> {
        Ok(Self { config, counters: ControllerCounters::default() })
    }

    /// What was counted so far.
    pub fn counters(&self) -> ControllerCounters {
        self.counters
    }

    /// Bytes from the host.
    pub fn handle_link(&mut self, piece: Piece<'_>) {
        let _ = piece;
    }

    /// Bytes from the boards, complete by `now`.
    pub fn handle_bus(&mut self, now: SimTime, piece: Piece<'_>) {
        let _ = (now, piece);
    }
}
