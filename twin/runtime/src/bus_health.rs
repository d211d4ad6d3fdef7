use std::fmt;

use twinrig_kernel::{Direction, HostTime, Port, SimDuration, SimTime};

use crate::FaultEffect;

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
    /// Effects of the faults of a scenario, of each fault once for each direction and place.
    pub fault_effects: Vec<FaultEffect>,
    /// The longest time without an accepted answer or frame.
    pub silence: Option<Silence>,
}

/// Kind of the error of a board whose clock is slow.
pub const SLOW_CLOCK: &str = "slow clock: periods shortened";

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
    /// Instant of the last one; the end of time where it is not known.
    pub last: HostTime,
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
    /// Instant of the last one.
    pub last: HostTime,
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

impl fmt::Display for Silence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            device,
            since,
            length,
            period,
        } = self;
        let since = since.as_nanos() as f64 / 1e9;
        write!(
            f,
            "{device} silent for {length} from {since:.3} s, its period is {period}"
        )
    }
}

/// A bus of a run as reports have it. Instants are those of the run, from control step 0 on
/// hardware.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusSummary {
    /// Name of the bus.
    pub name: String,
    /// Its traffic.
    pub health: BusHealth,
    /// Names of the measurements and diagnostics that it provides.
    pub signals: Vec<String>,
}

impl BusSummary {
    /// Creates the summary of a bus with the ports of its task and its diagnostics.
    pub(crate) fn new(name: &str, health: BusHealth, ports: impl Iterator<Item = Port>) -> Self {
        let provided = ports.filter(|port| port.direction == Direction::Output);
        Self {
            name: name.to_owned(),
            health,
            signals: provided.map(|port| port.name).collect(),
        }
    }
}

/// Returns whether the instants from `first` to `last` overlap a window of time.
fn overlaps(first: HostTime, last: HostTime, after: SimTime, before: SimTime) -> bool {
    first.as_nanos() <= before.as_nanos() && last.as_nanos() >= after.as_nanos()
}

impl Silence {
    /// Returns whether it overlaps a window of time.
    pub fn overlaps(&self, after: SimTime, before: SimTime) -> bool {
        overlaps(self.since, self.since + self.length, after, before)
    }

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

    /// Returns the longest silence if its device was dead in a window of time.
    pub fn dead(&self, after: SimTime, before: SimTime) -> Option<&Silence> {
        let silence = self.silence.as_ref()?;
        (silence.is_dead() && silence.overlaps(after, before)).then_some(silence)
    }

    /// Returns the number of deadlines that the bus missed in a window of time: points of its
    /// boards, stale answers, and requests and frames without a valid answer in time, of which
    /// there are at least as many as late answers and as the periods of a silence. Counts without
    /// an instant are those of the run, and so are the counts of errors that occurred in the window
    /// as well as outside it.
    pub fn deadline_misses(&self, after: SimTime, before: SimTime) -> u64 {
        let errors = self.errors_in(after, before, |_| true);
        let silent = self.silent_periods(after, before);
        let late = self.late_in(after, before);
        self.missed_points + self.stale + errors.max(late).max(silent)
    }

    /// Returns the number of faults of timing in a window of time, by the same rules: what is not
    /// valid for another reason, such as its checksum, does not count.
    pub fn timing_faults(&self, after: SimTime, before: SimTime) -> u64 {
        let clock = self.errors_in(after, before, |kind| kind == SLOW_CLOCK);
        let silent = self.silent_periods(after, before);
        let late = self.late_in(after, before);
        self.missed_points + self.stale + clock + late.max(silent)
    }

    fn errors_in(&self, after: SimTime, before: SimTime, is_of: impl Fn(&str) -> bool) -> u64 {
        let errors = self.errors.iter().filter(|error| is_of(error.kind));
        let errors = errors.filter(|it| overlaps(it.first, it.last, after, before));
        errors.map(|error| error.count).sum()
    }

    fn late_in(&self, after: SimTime, before: SimTime) -> u64 {
        let late = self.late.iter();
        let late = late.filter(|it| overlaps(it.first, it.last, after, before));
        late.map(|late| late.count).sum()
    }

    /// Returns the number of periods of a silence of a dead device.
    fn silent_periods(&self, after: SimTime, before: SimTime) -> u64 {
        let dead = self.dead(after, before);
        dead.map_or(0, |it| it.length.as_nanos() / it.period.as_nanos().max(1))
    }

    /// Converts the instants to times since `origin`; earlier ones become 0.
    #[must_use]
    pub fn since(mut self, origin: HostTime) -> Self {
        let shift = |at: &mut HostTime| {
            *at = HostTime::from_nanos(at.as_nanos().saturating_sub(origin.as_nanos()));
        };
        for error in &mut self.errors {
            shift(&mut error.first);
            shift(&mut error.last);
        }
        for late in &mut self.late {
            shift(&mut late.first);
            shift(&mut late.last);
        }
        if let Some(silence) = &mut self.silence {
            shift(&mut silence.since);
        }
        self
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
