use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::codes::ErrorCode;
use crate::packet::Payload;

/// What stands between the master and the boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Topology {
    /// Nothing: one packet goes out when the answer to the last one is in.
    Direct,
    /// A bus controller: a frame goes out in one piece.
    Controller,
}

/// How a master behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MasterConfig {
    /// What stands between it and the boards.
    pub topology: Topology,
    /// From writing a single request to giving its answer up: 20 ms.
    pub lazy_timeout: Duration,
    /// The same for a packet (direct: 1 ms, of which a good answer over USB takes 0.625 ms) or a frame
    /// (through the bus controller: 2 ms) of a cycle.
    pub cycle_timeout: Duration,
    /// How much later than its time-out an answer may still arrive: 1 ms, see [`GRACE`].
    pub grace: Duration,
    /// After a byte that nobody asked for, no transfer is begun until no such byte has come for that long: 1 ms.
    pub quiet: Duration,
    /// Longest that a transfer waits for that; it is begun then, whoever talks: 2 ms.
    pub drain_timeout: Duration,
    /// Errors at which [`crate::Master::is_out_of_errors`] holds; negative: never. 1, as in the original software.
    pub error_threshold: i64,
}

/// The usual [`MasterConfig::grace`]. It bounds for how long the master has to keep away from a board after an error, and
/// from that board alone:
///
/// *Which bytes can still arrive?* On a half-duplex bus nobody talks unasked. A board that is asked answers once, and
/// begins within its bounded response time (10 µs; 1.1 ms with the first firmware) with at most 32 bytes (96 µs). So
/// after a request was given up the one thing that can still arrive is the answer to it; after a damaged answer, nothing:
/// the board has talked. Through USB an answer is read at most
///
/// write jitter + 2 microframes + request + response time + answer + latency timer + 3 microframes + turnaround + jitter
///
/// after its request was written (0.78 ms with the defaults). Time-outs are longer, so an answer that comes after its
/// time-out comes from a host that is later than configured; the grace is how much later it may be.
///
/// *Which of them can be taken for a new answer?* An answer carries the address of its source. A late one is a stray while
/// another board is asked, so a request to another board can follow at once; only the same board must not be
/// asked again before time-out and grace have passed since its request was *written*. A direct cycle of four boards takes
/// longer than the 2 ms that this makes, so in it nothing is waited for.
///
/// *Does a late answer meet the next request on the bus?* No: what a board says is over 2 microframes, its response
/// time and 126 µs after the write, before any time-out.
pub const GRACE: Duration = Duration::from_millis(1);

impl MasterConfig {
    /// The defaults for that topology.
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

/// Why a request brought nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Failure {
    /// No answer came in time, or only a damaged one.
    #[error("no answer")]
    NoAnswer,
    /// The board, or the bus controller in its place, answered with an error.
    #[error("{0}")]
    Refused(ErrorCode),
}

/// What a request brought.
pub type Outcome = Result<Payload, Failure>;

/// What a master has counted since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MasterCounters {
    /// Single transfers finished.
    pub transfers: u64,
    /// Cycles finished.
    pub cycles: u64,
    /// Requests written.
    pub requests: u64,
    /// Good answers.
    pub answers: u64,
    /// Requests without a good answer; those of [`crate::Master::probe`] do not count.
    pub errors: u64,
    /// Answers that came with a wrong checksum, so that the time-out was not waited for. Direct topology only.
    pub damaged: u64,
    /// Packets that nobody asked for, or that came too late.
    pub strays: u64,
    /// Bytes that belonged to no packet, or to one that came between transfers \[B\].
    pub garbage: u64,
    /// Transfers that began although somebody still talked: [`MasterConfig::drain_timeout`] was over.
    pub drain_timeouts: u64,
}
