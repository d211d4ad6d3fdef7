//! Timing of a host's loop over a bus with one servo: predicted from adapter and return delay, and
//! judged against measured loops.
//!
//! [`HostLoop`] runs a loop of writes, sleeps and reads over the emulated wire and servo.
//! [`predictions`] has the median periods for many adapters; [`Prediction::agrees`] judges them.

mod adapters;
mod host_loop;
mod prediction;
mod stand;
mod statistics;

pub use adapters::{Adapter, adapters};
pub use host_loop::{HostLoop, LoopError};
pub use prediction::{LoopTimes, Prediction, RETURN_DELAYS, SLACKS, predictions};
pub use statistics::{ks_distance, percentile};
