use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, SimDuration};

/// Newest sample of a board since its start, with the numbers that wrap on the line.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct NewestSample {
    pub(crate) arrived: HostTime,
    sequence: u64,
    /// Stamp \[µs\].
    pub(crate) stamp_us: u64,
}

/// A sample relative to the newest one.
pub(crate) enum Continuity {
    /// A later one, behind as many missing ones.
    Later(NewestSample, u64),
    /// Repeated or late.
    Stale,
    /// The first one of a board that has restarted.
    Restarted(NewestSample),
}

impl NewestSample {
    /// The first sample of a board.
    pub(crate) fn first(arrived: HostTime, sequence: u16, stamp: u32) -> Self {
        Self {
            arrived,
            sequence: sequence.into(),
            stamp_us: stamp.into(),
        }
    }

    /// Compares a sample of the same boot number. The time that has elapsed resolves the wraps;
    /// after a `silence`, a number that goes back is that of a board that has restarted.
    pub(crate) fn compare(
        &self,
        now: HostTime,
        (sequence, stamp): (u16, u32),
        period: SimDuration,
        silence: SimDuration,
    ) -> Continuity {
        let elapsed = now.as_nanos().saturating_sub(self.arrived.as_nanos());
        let first = Self::first(now, sequence, stamp);
        let expected = self.sequence.saturating_add(elapsed / period.as_nanos());
        let sequence = unwrap(sequence.into(), u16::BITS, expected);
        let expected = self.stamp_us.saturating_add(elapsed / 1000);
        let stamp_us = unwrap(stamp.into(), u32::BITS, expected);
        if sequence <= self.sequence && elapsed < silence.as_nanos() {
            Continuity::Stale
        } else if sequence <= self.sequence || stamp_us <= self.stamp_us {
            Continuity::Restarted(first)
        } else {
            let newest = Self {
                arrived: now,
                sequence,
                stamp_us,
            };
            Continuity::Later(newest, sequence - self.sequence - 1)
        }
    }
}

/// Returns the number nearest to `expected` whose lowest `bits` bits are those of `low`.
fn unwrap(low: u64, bits: u32, expected: u64) -> u64 {
    let unused = u64::BITS - bits;
    let ahead = (low.wrapping_sub(expected) << unused).cast_signed() >> unused;
    expected.saturating_add_signed(ahead)
}
