//! Difference of one signal between two runs, as a function of time.

use super::warp::Warp;

/// Thresholds, as shares of a signal's range, whose first excess is recorded.
pub const SHARES: [f64; 2] = [0.01, 0.1];

/// Share of a signal's range beyond which it has left the other run: more than rounding, less than
/// any cause.
const LEAVE: f64 = 1e-6;

/// Number of equal segments of the time window with a separate RMS each.
pub const PARTS: usize = 10;

/// Minimum range (in the SI unit of the signal) by which a difference is normalised: a nanometre, a
/// nanonewton. A signal with a smaller range counts as constant.
const RANGE_MIN: f64 = 1e-9;

/// Differences of a signal between two runs, second minus first, over the common time window.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drift {
    /// Maximum magnitude, in the signal's unit; infinite where exactly one of the values is not
    /// finite.
    pub max: f64,
    /// Time of the maximum, in the time of the first run \[s\].
    pub max_at_s: f64,
    /// Root mean square, in the signal's unit.
    pub rms: f64,
    /// Maximum magnitude relative to the range of the signal in the first run; if the signal is
    /// constant there, to its range in the second run; if it is constant in both, to its largest
    /// magnitude. `None` if it is zero in both.
    pub share: Option<f64>,
    /// Time of the first excess of each of [`SHARES`] of that range, in the time of the first run
    /// \[s\].
    pub exceeds_at_s: [Option<f64>; 2],
    /// First excess of a millionth of that range: where the runs part.
    pub parts: Option<PartingPoint>,
    /// Root mean square over each of ten equal segments of the window.
    pub rms_of_parts: [f64; PARTS],
    /// Growth of those: slope of the least-squares line, in the signal's unit per second.
    pub growth_per_s: f64,
}

/// Instant at which a signal of two runs parts, and its values there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartingPoint {
    /// Time in the first run \[s\].
    pub at_s: f64,
    /// Value in the first run, in the signal's unit.
    pub a: f64,
    /// Value in the second run.
    pub b: f64,
}

/// Values of a signal in both runs at the first and at the last sample of the first run within the
/// common time window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// Times of the two samples \[s\].
    pub at_s: [f64; 2],
    /// Values in the first run, in the signal's unit.
    pub a: [f64; 2],
    /// Values in the second run.
    pub b: [f64; 2],
}

/// Samples of one component in one run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Samples<'a> {
    pub(super) times_s: &'a [f64],
    pub(super) values: &'a [f64],
}

impl Samples<'_> {
    /// Returns the value at a time by linear interpolation; `None` before the first sample and
    /// after the last. `cursor` is used as in [`Warp::at`].
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

    /// Returns the range (maximum minus minimum) and the largest magnitude of the finite samples
    /// within a time window.
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

/// Computes the differences of two runs over `window` \[s\] of the first, with the second sampled
/// at the warped times.
pub(super) fn drift(a: Samples<'_>, b: Samples<'_>, warp: &Warp, window: [f64; 2]) -> Drift {
    let [[range_a, size_a], [range_b, size_b]] = [a, b].map(|of| of.extent(window));
    let range = [range_a, range_b, size_a, size_b];
    let range = range.into_iter().find(|range| *range >= RANGE_MIN);
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
            if size > LEAVE * range {
                drift.parts.get_or_insert(PartingPoint {
                    at_s: time,
                    a: value,
                    b: other,
                });
            }
            for (at, share) in drift.exceeds_at_s.iter_mut().zip(SHARES) {
                if size > share * range {
                    at.get_or_insert(time);
                }
            }
        }
        let (sum, count) = &mut sums[segment(time - window[0], length)];
        *sum += size * size;
        *count += 1;
    }
    let mean = |(sum, count): (f64, u32)| libm::sqrt(sum / f64::from(count.max(1)));
    let segments = sums.iter();
    drift.rms = mean(segments.fold((0.0, 0), |(s, n), &(sum, count)| (s + sum, n + count)));
    drift.share = range.map(|range| drift.max / range);
    drift.rms_of_parts = sums.map(mean);
    drift.growth_per_s = slope(&drift.rms_of_parts, length / PARTS as f64);
    drift
}

/// Returns the values of both runs at the first and last sample within `window` \[s\].
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

/// Returns the index of the segment that contains a time.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small number, clamped"
)]
fn segment(since: f64, length: f64) -> usize {
    let share = if length > 0.0 { since / length } else { 0.0 };
    ((share * PARTS as f64) as usize).min(PARTS - 1)
}

/// Returns the slope of the least-squares line through equidistant values.
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
