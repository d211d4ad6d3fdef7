use twinrig_kernel::{BoardClock, LocalDuration, SimDuration, SimTime};

use crate::{UsbTiming, WireError};

/// Microframes of a host controller: number by time and start time by number.
#[derive(Clone, Debug)]
pub(crate) struct Microframes {
    length: SimDuration,
    length_ns: i64,
    /// Clock of the host controller; None if it equals the host's.
    clock: Option<BoardClock>,
}

impl Microframes {
    pub(crate) fn new(name: &str, timing: &UsbTiming) -> Result<Self, WireError> {
        let frames = |source| WireError::Microframes {
            name: name.to_owned(),
            source,
        };
        crate::error::nonzero(name, "microframe", timing.microframe)?;
        let offset = i64::try_from(timing.frame_offset.as_nanos()).unwrap_or(i64::MAX);
        let clock = BoardClock::new(LocalDuration::from_nanos(offset), timing.frame_rate_ppb)
            .map_err(frames)?;
        Ok(Self {
            length: timing.microframe,
            length_ns: i64::try_from(timing.microframe.as_nanos()).unwrap_or(i64::MAX),
            clock: (clock != BoardClock::IDEAL).then_some(clock),
        })
    }

    /// Returns the number of the microframe that contains `now`; the start belongs to the
    /// microframe.
    pub(crate) fn of(&self, now: SimTime) -> u64 {
        match &self.clock {
            None => now.as_nanos() / self.length.as_nanos(),
            // The clock is never negative.
            Some(clock) => (clock.local_at(now).as_nanos() / self.length_ns).unsigned_abs(),
        }
    }

    /// Returns the start of microframe `number`.
    pub(crate) fn start(&self, number: u64) -> SimTime {
        match &self.clock {
            None => SimTime::ZERO + self.length * number,
            Some(clock) => clock.sim_at_period(self.length, number, SimDuration::ZERO),
        }
    }

    /// Returns the number of the first microframe that starts at `now` or later.
    pub(crate) fn next(&self, now: SimTime) -> u64 {
        let number = self.of(now);
        number + u64::from(self.start(number) < now)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn microframes_partition_time(
            offset in 0_u64..1_000_000, ppb in -500_000_i64..500_000, now in 0_u64..3_000_000_000_000,
        ) {
            let timing = UsbTiming {
                frame_offset: SimDuration::from_nanos(offset),
                frame_rate_ppb: ppb,
                ..UsbTiming::default()
            };
            let frames = Microframes::new("any", &timing).unwrap();
            let now = SimTime::from_nanos(now);
            let number = frames.of(now);
            prop_assert!(frames.start(number) <= now && now < frames.start(number + 1));
            prop_assert_eq!(frames.of(frames.start(number + 1)), number + 1);
            prop_assert_eq!(frames.next(frames.start(number + 1)), number + 1);
            prop_assert!(frames.start(frames.next(now)) >= now);
        }
    }
}
