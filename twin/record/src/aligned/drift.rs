//! How far one signal of two runs is apart, in the course of time.

use super::warp::Warp;

/// Shares of a signal's range whose first excess is noted.
pub const SHARES: [f64; 2] = [0.01, 0.1];

/// Parts of a run whose differences are summed up each for itself.
pub const PARTS: usize = 10;

/// A signal that varies by less has no range by which to measure a difference, in its unit of the International System: a
/// nanometre, a nanonewton.
const STILL: f64 = 1e-9;

/// The differences of a signal in two runs, second less first, over the time that both have.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drift {
    /// The greatest magnitude, in the signal's unit; infinite where one run has a number and the other has none.
    pub max: f64,
    /// When that was, in the time of the first run \[s\].
    pub max_at_s: f64,
    /// Root of the mean square, in the signal's unit.
    pub rms: f64,
    /// Greatest magnitude as a share of the range that the signal has in the first run; in the second where it stands still
    /// in the first; of how large it is where it does in both. None where it is nothing in both.
    pub share: Option<f64>,
    /// When it first was more than each of [`SHARES`] of that range, in the time of the first run \[s\].
    pub exceeds_at_s: [Option<f64>; 2],
    /// Root of the mean square over each of ten equal parts of the time.
    pub rms_of_parts: [f64; PARTS],
    /// How fast those grow, by the straight line that fits them best, in the signal's unit a second.
    pub growth_per_s: f64,
}

/// What a signal is in two runs at the first and at the last sample of the first run that lies in the time of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// When those are \[s\].
    pub at_s: [f64; 2],
    /// In the first run, in the signal's unit.
    pub a: [f64; 2],
    /// In the second.
    pub b: [f64; 2],
}

/// Samples of one number in one run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Samples<'a> {
    pub(super) times_s: &'a [f64],
    pub(super) values: &'a [f64],
}

impl Samples<'_> {
    /// The value at a time, straight between samples; none before the first and behind the last. `cursor` is as for
    /// [`Warp::at`].
    fn at(&self, at: f64, cursor: &mut usize) -> Option<f64> {
        let next = |n: usize| self.times_s.get(n).copied();
        while next(*cursor + 1).is_some_and(|time| time <= at) {
            *cursor += 1;
        }
        let (from, value) = (next(*cursor)?, *self.values.get(*cursor)?);
        if from == at {
            return Some(value);
        }
        let to = next(*cursor + 1).filter(|_| from < at)?;
        let share = (at - from) / (to - from);
        Some(value + share * (self.values.get(*cursor + 1)? - value))
    }

    /// How far apart least and greatest are, and how large the largest is, of those at times in a window.
    fn extent(&self, window: [f64; 2]) -> [f64; 2] {
        let all = self.times_s.iter().zip(self.values);
        let within = |(time, value): &(&f64, &f64)| {
            value.is_finite() && (window[0]..=window[1]).contains(*time)
        };
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for (_, &value) in all.filter(within) {
            ends = [ends[0].min(value), ends[1].max(value)];
        }
        let [least, most] = ends;
        if least > most {
            return [0.0; 2];
        }
        [most - least, least.abs().max(most.abs())]
    }
}

/// The differences of two runs' samples, those of the second taken at the warped time; over `window` \[s\] of the first.
pub(super) fn drift(a: Samples<'_>, b: Samples<'_>, warp: &Warp, window: [f64; 2]) -> Drift {
    let [[range_a, size_a], [range_b, size_b]] = [a, b].map(|of| of.extent(window));
    let range = [range_a, range_b, size_a, size_b];
    let range = range.into_iter().find(|range| *range >= STILL);
    let mut drift = Drift::default();
    let (mut cursor, mut knot) = (0, 0);
    let mut sums = [(0.0, 0_u32); PARTS];
    let length = window[1] - window[0];
    for (&time, &value) in a.times_s.iter().zip(a.values) {
        if time < window[0] || time > window[1] {
            continue;
        }
        let Some(other) = b.at(warp.at(time, &mut knot), &mut cursor) else {
            continue;
        };
        let size = match (value.is_finite(), other.is_finite()) {
            (true, true) => (other - value).abs(),
            (false, false) => 0.0,
            _ => f64::INFINITY,
        };
        if size > drift.max {
            (drift.max, drift.max_at_s) = (size, time);
        }
        if let Some(range) = range {
            for (at, share) in drift.exceeds_at_s.iter_mut().zip(SHARES) {
                if size > share * range {
                    at.get_or_insert(time);
                }
            }
        }
        let (sum, count) = &mut sums[part(time - window[0], length)];
        *sum += size * size;
        *count += 1;
    }
    let mean = |(sum, count): (f64, u32)| libm::sqrt(sum / f64::from(count.max(1)));
    let whole = sums.iter();
    drift.rms = mean(whole.fold((0.0, 0), |(s, n), &(sum, count)| (s + sum, n + count)));
    drift.share = range.map(|range| drift.max / range);
    drift.rms_of_parts = sums.map(mean);
    drift.growth_per_s = slope(&drift.rms_of_parts, length / PARTS as f64);
    drift
}

/// What both are in the beginning and in the end of `window` \[s\].
pub(super) fn ends(a: Samples<'_>, b: Samples<'_>, window: [f64; 2]) -> Option<Ends> {
    let mut cursor = 0;
    let mut ends: Option<Ends> = None;
    for (&time, &value) in a.times_s.iter().zip(a.values) {
        if !(window[0]..=window[1]).contains(&time) {
            continue;
        }
        let Some(other) = b.at(time, &mut cursor) else {
            continue;
        };
        let first = ends.get_or_insert(Ends {
            at_s: [time; 2],
            a: [value; 2],
            b: [other; 2],
        });
        (first.at_s[1], first.a[1], first.b[1]) = (time, value, other);
    }
    ends
}

/// The part of a time that something falls into.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small number, clamped"
)]
fn part(since: f64, length: f64) -> usize {
    let share = if length > 0.0 { since / length } else { 0.0 };
    ((share * PARTS as f64) as usize).min(PARTS - 1)
}

/// The slope of the straight line through equidistant values that fits them best.
fn slope(values: &[f64; PARTS], distance: f64) -> f64 {
    let middle = (PARTS - 1) as f64 / 2.0;
    let (mut product, mut square) = (0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let off = i as f64 - middle;
        product += off * value;
        square += off * off;
    }
    if distance > 0.0 {
        product / (square * distance)
    } else {
        0.0
    }
}
