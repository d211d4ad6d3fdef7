use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::codes::ErrorCode;
use crate::packet::Payload;

/// Connection between the master and the boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Topology {
    /// Direct: one packet is written when the answer to the last one is complete.
    Direct,
    /// Through a bus controller: a frame is written in one piece.
    Controller,
}

/// Configuration of a master.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MasterConfig {
    /// Connection to the boards.
    pub topology: Topology,
    /// Time-out of a single request, from its write: 20 ms.
    pub lazy_timeout: Duration,
    /// Time-out of a packet (direct: 1 ms, of which a valid answer over USB takes 0.625 ms) or a
    /// frame (through the bus controller: 2 ms) of a cycle.
    pub cycle_timeout: Duration,
    /// Maximum delay of an answer after its time-out: 1 ms, see [`GRACE`].
    pub grace: Duration,
    /// Time without unsolicited bytes before a transfer begins: 1 ms.
    pub quiet: Duration,
    /// Maximum wait of a transfer for that; then it begins in any case: 2 ms.
    pub drain_timeout: Duration,
    /// Number of errors from which [`crate::Master::error_threshold_reached`] is true; negative:
    /// never. 1, as in the original software.
    pub error_threshold: i64,
}

/// Default of [`MasterConfig::grace`]. It bounds the time for which the master sends no request to
/// a board after an error, and to that board only:
///
/// *Which bytes can still arrive?* On a half-duplex bus no board transmits unsolicited. A board
/// answers a request once, and begins within its bounded response time (10 µs; 1.1 ms with the
/// first firmware) with at most 32 bytes (96 µs). So after a request was abandoned, only the answer
/// to it can still arrive; after a damaged answer, nothing: the board has transmitted. Through USB
/// an answer is read at most
///
/// write jitter + 2 microframes + request + response time + answer + latency timer +
/// 3 microframes + turnaround + jitter
///
/// after its request was written (0.78 ms with the defaults). Time-outs are longer, so an answer
/// that arrives after its time-out is due to a host later than configured; the grace is the maximum
/// of that delay.
///
/// *Which of them can be taken for a new answer?* An answer carries the address of its source. A
/// late one is a stray while another board is requested, so a request to another board can follow
/// at once; only the same board must not be requested again before time-out and grace have passed
/// since its request was *written*. A direct cycle of four boards takes longer than the resulting 2
/// ms, so there is no wait in it.
///
/// *Does a late answer collide with the next request on the bus?* No: a board's transmission ends 2
/// microframes, its response time and 126 µs after the write, before any time-out.
pub const GRACE: Duration = Duration::from_millis(1);

impl MasterConfig {
    /// The defaults for a topology.
    pub const fn new(topology: Topology) -> Self {
        Self {
            topology,
            lazy_timeout: Duration::from_millis(20),
            cycle_timeout: match topology {
                Topology::Direct => Duration::from_millis(1),
                Topology::Controller => Duration::from_millis(2),
            },
            grace: GRACE,
            quiet: Duration::from_millis(1),
            drain_timeout: Duration::from_millis(2),
            error_threshold: 1,
        }
    }
}

/// Reason why a request failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum RequestError {
    /// No answer within the time-out, or a damaged one.
    #[error("no answer")]
    NoAnswer,
    /// The board, or the bus controller in its name, answered with an error.
    #[error("{0}")]
    Refused(ErrorCode),
}

/// Result of a request: the payload of the answer.
pub type Outcome = Result<Payload, RequestError>;

/// Counters of a master.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MasterCounters {
    /// Single transfers completed.
    pub transfers: u64,
    /// Cycles completed.
    pub cycles: u64,
    /// Requests written.
    pub requests: u64,
    /// Valid answers.
    pub answers: u64,
    /// Requests without a valid answer, except those of [`crate::Master::probe`].
    pub errors: u64,
    /// Answers with a wrong checksum that ended the wait before the time-out. Direct topology only.
    pub damaged: u64,
    /// Unsolicited or late packets.
    pub strays: u64,
    /// Bytes outside packets, or of packets received between transfers \[B\].
    pub garbage: u64,
    /// Transfers begun at [`MasterConfig::drain_timeout`] in spite of unsolicited bytes.
    pub drain_timeouts: u64,
}
