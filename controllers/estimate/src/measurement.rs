//! Measurements, and what an estimator did with them.

use serde::{Deserialize, Serialize};

/// Source of a measurement. Measurements of one instant are applied in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Channel {
    /// Voltage of the piezoresistive cell's amplifier \[V\].
    Piezoresistive,
    /// Voltage of the piezoelectric cell's charge amplifier \[V\].
    Piezoelectric,
    /// Angular frequency of the load \[rad/s\].
    Frequency,
}

impl Channel {
    /// Number of channels.
    pub const COUNT: usize = 3;
}

/// A measured value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Time of the sample \[ns\], on one clock for all channels.
    pub at_ns: u64,
    /// Its source.
    pub channel: Channel,
    /// Value, in the channel's unit.
    pub value: f64,
}

impl Measurement {
    pub(crate) fn key(&self) -> (u64, Channel) {
        (self.at_ns, self.channel)
    }
}

/// Use that an estimator made of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It was the newest, and is applied.
    Applied,
    /// It was older than another, and is applied at its own time.
    Late,
    /// It was older than the history, and is dropped.
    TooOld,
    /// Its channel has a measurement with the same time stamp, and this one is dropped.
    Duplicate,
    /// It is NaN or beyond ±10⁹, and is dropped.
    Invalid,
    /// Its channel is not configured, or not used by the model.
    Ignored,
}

/// Number of measurements by [`Outcome`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// In order of time.
    pub applied: u64,
    /// Late and applied.
    pub late: u64,
    /// Older than the history.
    pub too_old: u64,
    /// Time stamp twice.
    pub duplicate: u64,
    /// NaN or beyond ±10⁹.
    pub invalid: u64,
    /// Channels that are not used.
    pub ignored: u64,
}
