use twinrig_kernel::{HostTime, SimDuration};

/// Traffic of a bus as its driver has seen it, for reports: no signal, and no part of a
/// fingerprint.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BusHealth {
    /// Requests written, or frames of a device that transmits unasked.
    pub packets: u64,
    /// Answers and frames accepted.
    pub answers: u64,
    /// Errors by kind and device, in the order of their first instants.
    pub errors: Vec<BusError>,
    /// Answers that arrived after their time-out, by device.
    pub late: Vec<LateDevice>,
    /// Answers accepted although they belong to a request of an earlier cycle.
    pub stale: u64,
    /// Points that a board should have reached and has not, where it counts them.
    pub missed_points: u64,
    /// The longest time without an accepted answer or frame.
    pub silence: Option<Silence>,
}

/// Errors of one kind and device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusError {
    /// The kind in words, such as `no answer` or `checksum`.
    pub kind: &'static str,
    /// The device, such as `board RH (id 4)`; empty where the bus as a whole is concerned.
    pub device: String,
    /// Number of errors.
    pub count: u64,
    /// Instant of the first one.
    pub first: HostTime,
}

/// Late answers of one device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LateDevice {
    /// The device, as in [`BusError::device`].
    pub device: String,
    /// Number of late answers.
    pub count: u64,
    /// Instant of the first one.
    pub first: HostTime,
    /// The greatest delay behind the time-out.
    pub worst: SimDuration,
}

/// A time without an accepted answer or frame of one device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Silence {
    /// The device, as in [`BusError::device`].
    pub device: String,
    /// Its first request without an answer; of a device that transmits unasked, its last frame.
    pub since: HostTime,
    /// Its length, to the next answer or to the present.
    pub length: SimDuration,
    /// Period in which an answer or frame is expected.
    pub period: SimDuration,
}

impl Silence {
    /// Returns whether the device has been silent for more than three of its periods.
    pub fn is_dead(&self) -> bool {
        self.length > self.period * 3
    }
}

impl BusHealth {
    /// Returns the number of errors of all kinds and devices.
    pub fn error_count(&self) -> u64 {
        self.errors.iter().map(|error| error.count).sum()
    }

    /// Returns the number of late answers of all devices.
    pub fn late_count(&self) -> u64 {
        self.late.iter().map(|late| late.count).sum()
    }

    /// Returns whether no error, late or stale answer, missed point or dead device was seen.
    pub fn is_clean(&self) -> bool {
        self.errors.is_empty()
            && self.late.is_empty()
            && self.stale == 0
            && self.missed_points == 0
            && !self.silence.as_ref().is_some_and(Silence::is_dead)
    }
}
