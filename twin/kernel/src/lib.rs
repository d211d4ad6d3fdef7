//! Foundation of Twinrig: integer time, board clocks, event order, wake-ups, random streams and the
//! description of signals. Deterministic: the same calls return the same results, bit for bit, on
//! every machine and in every build profile.
//!
//! ```
//! use twinrig_kernel::{Agenda, Rank, SimDuration, SimTime};
//!
//! // Two parts with periods of 3 ms and 2 ms; at 6 ms, when both are due, the lower rank is first.
//! let mut agenda = Agenda::new(1_000);
//! let board = agenda.register("board", Rank(0));
//! let control = agenda.register("control", Rank(1));
//! agenda.arm(control, SimTime::ZERO);
//! agenda.arm(board, SimTime::ZERO);
//! let mut order = String::new();
//! while let Some(wake) = agenda.pop_until(SimTime::ZERO + SimDuration::from_millis(6))? {
//!     let (letter, period) = if wake.part == board { ('b', 3) } else { ('C', 2) };
//!     order.push(letter);
//!     agenda.arm(wake.part, wake.time + SimDuration::from_millis(period));
//! }
//! assert_eq!(order, "bCCbCbC");
//! # Ok::<(), twinrig_kernel::LivelockError>(())
//! ```
//!
//! Out of scope: input and output, physics, protocols, controllers. The crate reads no clock of the
//! machine, starts no thread, has no global state, and depends on no other crate of the project.

mod agenda;
mod board_clock;
mod cycle_jitter;
mod dimension;
mod event_queue;
mod host_time;
mod layout;
mod livelock;
mod local_time;
mod near_miss;
mod port;
pub mod signal;
mod sim_time;
mod snapshot;
mod stream;
mod unit;

pub use agenda::{Agenda, PartId, Wake};
pub use board_clock::{BoardClock, BoardClockError};
pub use cycle_jitter::CycleJitter;
pub use dimension::BaseExponents;
pub use event_queue::{EventQueue, Rank, Scheduled};
pub use host_time::HostTime;
pub use layout::{Field, Layout};
pub use livelock::{LivelockError, LivelockGuard, WakeEdge};
pub use local_time::{LocalDuration, LocalTime};
pub use near_miss::near_misses;
pub use port::{Direction, Port, SignalKind};
pub use sim_time::{SimDuration, SimTime};
pub use snapshot::{Snapshot, SnapshotError};
pub use stream::{Stream, count_drawn, drawn_streams, stream};
pub use unit::Unit;
