//! Pairs of simultaneous values of two signals.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Group;

/// Place of an element in the samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    pub group: Group,
    pub element: usize,
    /// Nominal period of the samples of the group.
    pub period: SimDuration,
}

/// Pairs of the values of a signal and the simultaneous ones of another: sampled together, or
/// interpolated linearly between the samples of the other one. The order of samples of one instant
/// does not matter.
#[derive(Clone, Debug)]
pub(super) struct Pairs {
    signal: Source,
    with: Source,
    /// Last sample of the other signal.
    last: Option<(SimTime, f64)>,
    /// Samples of the signal after that one.
    pending: Vec<(SimTime, f64)>,
    /// Whether there were more of them than expected.
    overflowed: bool,
}

/// Greatest number of pending samples.
const PENDING_MAX: u64 = 4_096;
/// Periods of the other signal that may pass without a sample of it: the controller may miss
/// deadlines.
const PERIODS_WITHOUT: u64 = 4;
/// Number of pending samples beyond those, for irregular samples.
const PENDING_SPARE: u64 = 8;

impl Pairs {
    pub fn new(signal: Source, with: Source) -> Self {
        let ratio = with.period.as_nanos() / signal.period.as_nanos().max(1);
        let capacity = if signal.group == with.group {
            0
        } else {
            let expected = ratio.saturating_mul(PERIODS_WITHOUT);
            expected.saturating_add(PENDING_SPARE).min(PENDING_MAX)
        };
        Pairs {
            signal,
            with,
            last: None,
            pending: Vec::with_capacity(usize::try_from(capacity).unwrap_or(0)),
            overflowed: false,
        }
    }

    pub fn reads(&self, group: Group) -> bool {
        group == self.signal.group || group == self.with.group
    }

    pub fn has_overflowed(&self) -> bool {
        self.overflowed
    }

    /// Adds samples of a group, and calls `pair` with time, signal and other signal of each pair
    /// that they complete. Samples of the signal outside the window are ignored.
    #[inline]
    pub fn sample(
        &mut self,
        now: SimTime,
        group: Group,
        values: &[f64],
        in_window: bool,
        mut pair: impl FnMut(SimTime, f64, f64),
    ) {
        if self.signal.group == self.with.group {
            if in_window {
                pair(now, values[self.signal.element], values[self.with.element]);
            }
        } else if group == self.with.group {
            self.complete(now, values[self.with.element], pair);
        } else if in_window {
            let signal = values[self.signal.element];
            match self.last {
                Some((at, with)) if at >= now => pair(now, signal, with),
                None => {
                    // Only a first sample of the other signal at this instant can be its partner.
                    self.pending.clear();
                    self.pending.push((now, signal));
                }
                _ if self.pending.len() < self.pending.capacity() => {
                    self.pending.push((now, signal));
                }
                _ => self.overflowed = true,
            }
        }
    }

    /// Completes the pending samples by a sample of the other signal. Those before its first one
    /// have no partner.
    fn complete(&mut self, now: SimTime, with: f64, mut pair: impl FnMut(SimTime, f64, f64)) {
        for (at, signal) in self.pending.drain(..) {
            if at == now {
                pair(at, signal, with);
            } else if let Some((before, value)) = self.last {
                let share = (at - before).as_secs_f64() / (now - before).as_secs_f64();
                pair(at, signal, value + share * (with - value));
            }
        }
        self.last = Some((now, with));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(group: Group, period_ms: u64) -> Source {
        Source {
            group,
            element: 0,
            period: SimDuration::from_millis(period_ms),
        }
    }

    fn at(micros: u64) -> SimTime {
        SimTime::ZERO + SimDuration::from_micros(micros)
    }

    /// Pairs from samples of a straight line with slope 1 per ms at 1 ms, compared with itself at
    /// other instants.
    fn pairs(instants_us: &[u64], plant_first: bool) -> Vec<(SimTime, f64, f64)> {
        let mut pairs = Pairs::new(source(Group::ProcessInputs, 3), source(Group::Plant, 1));
        let mut found = Vec::new();
        let mut samples: Vec<(u64, bool)> = (2..50).map(|ms| (1_000 * ms, true)).collect();
        samples.extend(instants_us.iter().map(|at| (*at, false)));
        samples.sort_by_key(|(at, of_plant)| (*at, *of_plant != plant_first));
        for (micros, of_plant) in samples {
            let group = if of_plant {
                Group::Plant
            } else {
                Group::ProcessInputs
            };
            let value = [micros as f64 * 1e-3];
            let pair = |at, signal, with| found.push((at, signal, with));
            pairs.sample(at(micros), group, &value, true, pair);
        }
        assert!(!pairs.has_overflowed());
        found
    }

    #[test]
    fn other_signal_is_interpolated_and_order_at_an_instant_does_not_matter() {
        let instants = [
            500, 2_000, 3_000, 3_250, 3_750, 6_000, 8_999, 49_000, 49_500,
        ];
        let found = pairs(&instants, true);
        assert_eq!(found, pairs(&instants, false));
        let times: Vec<SimTime> = found.iter().map(|(at, ..)| *at).collect();
        // Without those before the first and after the last sample of the other signal.
        let expected = instants[1..8].iter().map(|micros| at(*micros));
        assert_eq!(times, expected.collect::<Vec<_>>());
        // Rounding of the interpolation.
        assert!(
            found
                .iter()
                .all(|(_, signal, with)| (signal - with).abs() < 1e-12)
        );
    }

    #[test]
    fn signal_without_partners_overflows() {
        let mut pairs = Pairs::new(source(Group::ProcessInputs, 1), source(Group::Plant, 10));
        let mut count = 0;
        let mut sample = |pairs: &mut Pairs, ms: u64, group| {
            pairs.sample(at(1_000 * ms), group, &[0.0], true, |_, _, _| count += 1);
        };
        // Before the first sample of the other signal, and for four of its periods.
        (0..=100).for_each(|ms| sample(&mut pairs, ms, Group::ProcessInputs));
        sample(&mut pairs, 100, Group::Plant);
        (101..=140).for_each(|ms| sample(&mut pairs, ms, Group::ProcessInputs));
        sample(&mut pairs, 140, Group::Plant);
        assert!(!pairs.has_overflowed());
        (141..200).for_each(|ms| sample(&mut pairs, ms, Group::ProcessInputs));
        assert!(pairs.has_overflowed());
        assert_eq!(count, 41);
    }
}
