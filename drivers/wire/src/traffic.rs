use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, SimDuration};
use twinrig_runtime::{BusError, BusHealth, LateDevice, Silence};

/// Kind of an error in the traffic of a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TrafficError {
    /// No answer within the time-out.
    NoAnswer,
    /// A wrong checksum.
    Checksum,
    /// Bytes outside frames, by the number of reads that contained any.
    Garbled,
    /// A valid packet or frame that nothing asked for.
    Unexpected,
    /// A valid frame with invalid content.
    Implausible,
    /// A frame that is missing by the device's own numbers.
    Lost,
    /// A frame that came twice or behind a later one, or a transfer without a new frame.
    NotNew,
    /// The device, or a bus controller in its name, reports an error.
    Refused,
    /// The device reports a fault of its own.
    Fault,
    /// The device restarted.
    Restart,
}

impl TrafficError {
    /// Returns the kind in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::NoAnswer => "no answer",
            Self::Checksum => "checksum",
            Self::Garbled => "bytes outside frames",
            Self::Unexpected => "unexpected frame",
            Self::Implausible => "implausible content",
            Self::Lost => "lost frame",
            Self::NotNew => "no new frame",
            Self::Refused => "refused",
            Self::Fault => "fault of the device",
            Self::Restart => "restart",
        }
    }
}

/// Record of the traffic of a bus, from which a driver reports its [`BusHealth`].
///
/// Devices are numbers of the driver's choice. Errors are kept by kind and device, so the size is
/// bounded by their numbers.
///
/// **Silence.** A device that answers requests is silent from the first request that it leaves open
/// to its next answer, so that a host that asks for nothing finds no silence; one that transmits
/// unasked is silent between its frames.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrafficLog {
    packets: u64,
    answers: u64,
    stale: u64,
    errors: Vec<ErrorEntry>,
    late: Vec<LateEntry>,
    silences: Vec<SilenceEntry>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct ErrorEntry {
    kind: TrafficError,
    device: Option<u16>,
    count: u64,
    first: HostTime,
    last: HostTime,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct LateEntry {
    device: u16,
    count: u64,
    first: HostTime,
    last: HostTime,
    worst: SimDuration,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct SilenceEntry {
    device: u16,
    /// Beginning of the present silence.
    since: Option<HostTime>,
    longest: Option<(HostTime, SimDuration)>,
}

/// Returns the time from `earlier` to `later`; zero if it is negative.
fn between(earlier: HostTime, later: HostTime) -> SimDuration {
    SimDuration::from_nanos(later.as_nanos().saturating_sub(earlier.as_nanos()))
}

impl TrafficLog {
    /// Records a request that `device` is to answer, or that nothing is to answer.
    pub fn request(&mut self, device: Option<u16>, now: HostTime) {
        self.packets += 1;
        if let Some(device) = device {
            self.silence(device).since.get_or_insert(now);
        }
    }

    /// Records an accepted answer.
    pub fn answer(&mut self, device: u16, now: HostTime) {
        self.answers += 1;
        self.end_silence(device, now);
    }

    /// Records accepted frames of a device that transmits unasked.
    pub fn frames(&mut self, device: u16, count: u64, now: HostTime) {
        self.packets += count;
        self.answers += count;
        self.end_silence(device, now);
        self.silence(device).since = Some(now);
    }

    /// Records `count` errors; without a device, of the bus as a whole.
    pub fn error(&mut self, kind: TrafficError, device: Option<u16>, count: u64, now: HostTime) {
        if count == 0 {
            return;
        }
        let mut entries = self.errors.iter_mut();
        match entries.find(|entry| (entry.kind, entry.device) == (kind, device)) {
            Some(entry) => {
                entry.count += count;
                entry.last = now;
            }
            None => self.errors.push(ErrorEntry {
                kind,
                device,
                count,
                first: now,
                last: now,
            }),
        }
    }

    /// Records an answer that arrived `lateness` after its time-out.
    pub fn late(&mut self, device: u16, lateness: SimDuration, now: HostTime) {
        match self.late.iter_mut().find(|entry| entry.device == device) {
            Some(entry) => {
                entry.count += 1;
                entry.worst = entry.worst.max(lateness);
                entry.last = now;
            }
            None => self.late.push(LateEntry {
                device,
                count: 1,
                first: now,
                last: now,
                worst: lateness,
            }),
        }
    }

    /// Records an answer that was accepted although it belonged to an earlier request.
    pub fn stale(&mut self) {
        self.stale += 1;
    }

    /// Returns the number of late answers of a device and the greatest delay.
    pub fn lateness(&self, device: u16) -> Option<(u64, SimDuration)> {
        let entry = self.late.iter().find(|entry| entry.device == device)?;
        Some((entry.count, entry.worst))
    }

    /// Forgets the silences so far, as at the end of the opening.
    pub fn forget_silences(&mut self) {
        self.silences.clear();
    }

    /// Begins the silence of a device that transmits unasked.
    pub fn expect_frames(&mut self, device: u16, now: HostTime) {
        self.silence(device).since = Some(now);
    }

    fn silence(&mut self, device: u16) -> &mut SilenceEntry {
        let found = self.silences.iter().position(|of| of.device == device);
        let index = found.unwrap_or_else(|| {
            self.silences.push(SilenceEntry {
                device,
                since: None,
                longest: None,
            });
            self.silences.len() - 1
        });
        &mut self.silences[index]
    }

    fn end_silence(&mut self, device: u16, now: HostTime) {
        let entry = self.silence(device);
        if let Some(since) = entry.since.take() {
            entry.longest = Some(longer(entry.longest, (since, between(since, now))));
        }
    }

    /// Returns the health at `now` of devices of which an answer or frame is expected once in
    /// `period`; None where the silence of a device is not to be judged.
    pub fn health(
        &self,
        now: HostTime,
        period: Option<SimDuration>,
        name: impl Fn(u16) -> String,
    ) -> BusHealth {
        let errors = self.errors.iter().map(|entry| BusError {
            kind: entry.kind.as_str(),
            device: entry.device.map(&name).unwrap_or_default(),
            count: entry.count,
            first: entry.first,
            last: entry.last,
        });
        let late = self.late.iter().map(|entry| LateDevice {
            device: name(entry.device),
            count: entry.count,
            first: entry.first,
            last: entry.last,
            worst: entry.worst,
        });
        let mut worst: Option<(u16, (HostTime, SimDuration))> = None;
        for entry in &self.silences {
            let present = entry.since.map(|since| (since, between(since, now)));
            let longest = present.map_or(entry.longest, |present| {
                Some(longer(entry.longest, present))
            });
            if let Some(longest) = longest
                && worst.is_none_or(|(_, worst)| worst.1 < longest.1)
            {
                worst = Some((entry.device, longest));
            }
        }
        let silence = worst
            .zip(period)
            .map(|((device, (since, length)), period)| Silence {
                device: name(device),
                since,
                length,
                period,
            });
        BusHealth {
            packets: self.packets,
            answers: self.answers,
            errors: errors.collect(),
            late: late.collect(),
            stale: self.stale,
            missed_points: 0,
            fault_effects: Vec::new(),
            silence,
        }
    }
}

fn longer(
    before: Option<(HostTime, SimDuration)>,
    new: (HostTime, SimDuration),
) -> (HostTime, SimDuration) {
    before.filter(|before| before.1 >= new.1).unwrap_or(new)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(micros: u64) -> HostTime {
        HostTime::from_nanos(micros * 1_000)
    }

    fn health(log: &TrafficLog, now: HostTime) -> BusHealth {
        let name = |device| format!("board {device}");
        log.health(now, Some(SimDuration::from_millis(2)), name)
    }

    #[test]
    fn longest_silence_of_the_worst_device_is_reported_and_idle_time_is_none() {
        let mut log = TrafficLog::default();
        for cycle in 0..10 {
            let now = 2_000 * cycle;
            log.request(Some(1), at(now));
            log.answer(1, at(now + 700));
            log.request(Some(2), at(now + 700));
            if cycle < 3 {
                log.answer(2, at(now + 1_500));
            }
        }
        // The host asks nothing of board 1 for a second.
        let silence = health(&log, at(1_000_000)).silence.unwrap();
        assert_eq!(
            (silence.device.as_str(), silence.since),
            ("board 2", at(6_700))
        );
        assert!(silence.is_dead());
        log.answer(2, at(1_000_001));
        assert!(health(&log, at(1_000_002)).silence.unwrap().is_dead());
        log.forget_silences();
        assert_eq!(health(&log, at(2_000_000)).silence, None);
    }

    #[test]
    fn errors_are_counted_by_kind_and_device_with_their_first_instant() {
        let mut log = TrafficLog::default();
        log.error(TrafficError::NoAnswer, Some(3), 1, at(5));
        log.error(TrafficError::Checksum, Some(3), 1, at(6));
        log.error(TrafficError::NoAnswer, Some(3), 2, at(7));
        log.error(TrafficError::Lost, None, 0, at(8));
        let health = health(&log, at(9));
        let found: Vec<_> = health
            .errors
            .iter()
            .map(|e| (e.kind, e.count, e.first))
            .collect();
        assert_eq!(found, [("no answer", 3, at(5)), ("checksum", 1, at(6))]);
        assert!(!health.is_clean());
    }
}
