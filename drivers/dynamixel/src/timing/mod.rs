//! Timing of a host's loop over a bus: with one servo predicted from adapter and return delay, and
//! judged against measured loops; with several by the number of servos and the read pattern.
//!
//! [`HostLoop`] runs a loop of writes, sleeps and reads over the emulated wire and servo.
//! [`BusLoop`] runs the driver over a bus of several servos.
//! [`predictions`] has the median periods for many adapters; [`Prediction::agrees`] judges them.

mod adapters;
mod bus_loop;
mod host_loop;
mod prediction;
mod stand;
mod stated;
mod statistics;

pub use adapters::{Adapter, adapters};
pub use bus_loop::{BusLoop, BusTimes};
pub use host_loop::{HostLoop, LoopError};
pub use prediction::{LoopTimes, Prediction, RETURN_DELAYS, SLACKS, predictions};
pub use stated::{StatedTime, stated_times};
pub use statistics::{ks_distance, percentile};
