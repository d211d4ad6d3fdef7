//! Delay of a signal from another.

use twinrig_kernel::{SimDuration, SimTime};

use super::found::{Found, NOTHING};
use super::moments::ValueRange;
use crate::judge::tracker::seconds;

/// Greatest number of lags on either side of zero. More pairs than that within the range are
/// thinned out.
const LAGS_MAX: u64 = 128;
/// Least coefficient of correlation of a delay; below it the signals are unrelated.
const LEAST_CORRELATION: f64 = 0.5;
/// Difference of coefficients below which two maxima count as equal.
const EQUAL_MAXIMA: f64 = 1e-3;
/// Greatest deviation of an interval between samples from the period, as a share of it. Others
/// interrupt the series.
const IRREGULAR: f64 = 0.1;

/// Cross-correlation of two series on a grid of lags.
///
/// A sample of the signal is multiplied by those of the other series from `lags` before it to
/// `lags` after it, so that each lag is judged by the same samples of the signal, the *centres*.
/// The sums of the other series that belong to a lag follow from those of its complete segments,
/// their heads and their tails, at the end of a segment: a sample costs one product for each lag.
#[derive(Clone, Debug)]
pub(super) struct Delay {
    lags: usize,
    /// One of so many pairs is used.
    stride: u64,
    skipped: u64,
    /// Nominal interval between pairs \[s\].
    period: f64,
    /// Time of the last pair.
    last: Option<SimTime>,
    /// First values, subtracted from all others.
    origin: Option<[f64; 2]>,
    ranges: [ValueRange; 2],
    /// Pairs of the present segment.
    segment: usize,
    signal: Window,
    with: Window,
    /// The first values of the other series in the segment.
    head: Vec<f64>,
    /// Sum of the other series in the segment, and of its squares.
    sums: [f64; 2],
    /// Number of centres, their sum and sum of squares.
    centres: u64,
    signal_sums: [f64; 2],
    /// For each lag, from the greatest to the least: sum of products, and over completed segments
    /// the sums of the other series and of its squares.
    products: Vec<f64>,
    with_sums: Vec<[f64; 2]>,
}

/// The last values of a series, contiguous.
#[derive(Clone, Debug)]
struct Window {
    /// Each value twice, at a distance of the length.
    twice: Vec<f64>,
    /// Place of the oldest value, where the next one is written.
    oldest: usize,
}

impl Window {
    fn new(length: usize) -> Self {
        Window {
            twice: vec![0.0; 2 * length],
            oldest: 0,
        }
    }

    #[inline]
    fn push(&mut self, value: f64) {
        let length = self.twice.len() / 2;
        self.twice[self.oldest] = value;
        self.twice[self.oldest + length] = value;
        self.oldest = (self.oldest + 1) % length;
    }

    /// Returns the values from the oldest to the newest.
    #[inline]
    fn values(&self) -> &[f64] {
        &self.twice[self.oldest..self.oldest + self.twice.len() / 2]
    }
}

impl Delay {
    /// Creates the statistics of delays up to `range`, either way, of pairs with a nominal period.
    pub fn new(range: SimDuration, period: SimDuration) -> Self {
        let steps = range.as_nanos() / period.as_nanos().max(1);
        let stride = steps.div_ceil(LAGS_MAX).max(1);
        // One lag more than the range, as a neighbour of the last maximum.
        let lags = usize::try_from(steps / stride + 1).expect("at most 129");
        let length = 2 * lags + 1;
        Delay {
            lags,
            stride,
            skipped: 0,
            period: seconds(period),
            last: None,
            origin: None,
            ranges: [ValueRange::default(); 2],
            segment: 0,
            signal: Window::new(length),
            with: Window::new(length),
            head: vec![0.0; length - 1],
            sums: [0.0; 2],
            centres: 0,
            signal_sums: [0.0; 2],
            products: vec![0.0; length],
            with_sums: vec![[0.0; 2]; length],
        }
    }

    #[inline]
    pub fn add(&mut self, at: SimTime, signal: f64, with: f64) {
        if let Some(last) = self.last {
            let interval = seconds(at - last);
            if (interval - self.period).abs() > IRREGULAR * self.period {
                self.end_segment();
            }
        }
        self.last = Some(at);
        self.ranges[0].add(signal);
        self.ranges[1].add(with);
        if self.skipped > 0 {
            self.skipped -= 1;
            return;
        }
        self.skipped = self.stride - 1;
        let origin = *self.origin.get_or_insert([signal, with]);
        self.add_to_segment(signal - origin[0], with - origin[1]);
    }

    #[inline]
    fn add_to_segment(&mut self, signal: f64, with: f64) {
        if let Some(head) = self.head.get_mut(self.segment) {
            *head = with;
        }
        self.segment += 1;
        self.sums[0] += with;
        self.sums[1] += with * with;
        self.signal.push(signal);
        self.with.push(with);
        if self.segment >= self.products.len() {
            let centre = self.signal.values()[self.lags];
            self.centres += 1;
            self.signal_sums[0] += centre;
            self.signal_sums[1] += centre * centre;
            for (product, with) in self.products.iter_mut().zip(self.with.values()) {
                *product += centre * with;
            }
        }
    }

    /// Ends a segment: adds its sums for each lag, which are those of the segment without the
    /// values at its begin and end that this lag does not reach.
    fn end_segment(&mut self) {
        if self.segment >= self.products.len() {
            let mut rest = self.sums;
            let tail = &self.with.values()[1..];
            for value in tail {
                rest[0] -= value;
                rest[1] -= value * value;
            }
            let values = self.head.iter().zip(tail);
            let (first, others) = self.with_sums.split_at_mut(1);
            first[0][0] += rest[0];
            first[0][1] += rest[1];
            for (sums, (before, after)) in others.iter_mut().zip(values) {
                rest[0] += after - before;
                rest[1] += after * after - before * before;
                sums[0] += rest[0];
                sums[1] += rest[1];
            }
        }
        self.segment = 0;
        self.skipped = 0;
        self.sums = [0.0; 2];
    }

    /// Returns the delay.
    pub fn found(&self) -> Found {
        if self.last.is_none() {
            return Err(NOTHING.to_owned());
        }
        for (range, name) in self
            .ranges
            .iter()
            .zip(["the signal", "the signal that it is compared with"])
        {
            if range.is_constant() {
                return Err(format!("{name} is constant"));
            }
        }
        let mut ended = self.clone();
        ended.end_segment();
        let least = self.products.len() as u64;
        if self.centres < least {
            let step = self.stride as f64 * self.period;
            return Err(format!(
                "too short: the delays need {:.3} s of evenly spaced observations",
                2.0 * least as f64 * step
            ));
        }
        let coefficients: Vec<f64> = (0..self.products.len())
            .map(|index| ended.coefficient(index))
            .collect();
        self.maximum(&coefficients)
    }

    /// Returns Pearson's coefficient of a lag; 0 if the series is constant.
    fn coefficient(&self, index: usize) -> f64 {
        let count = self.centres as f64;
        let ([x, xx], [y, yy]) = (self.signal_sums, self.with_sums[index]);
        let scale = (xx - x * x / count) * (yy - y * y / count);
        if scale > 0.0 {
            (self.products[index] - x * y / count) / scale.sqrt()
        } else {
            0.0
        }
    }

    /// Returns the delay of the greatest coefficient.
    fn maximum(&self, coefficients: &[f64]) -> Found {
        let greatest = coefficients.iter().copied().fold(f64::MIN, f64::max);
        if greatest < LEAST_CORRELATION {
            return Err(format!(
                "the signals are not related: their correlation is at most {greatest:.3}"
            ));
        }
        let maxima = coefficients.windows(3).enumerate();
        let maxima = maxima.filter(|(_, values)| {
            values[1] >= values[0] && values[1] >= values[2] && values[1] > values[0].min(values[2])
        });
        let step = self.stride as f64 * self.period;
        let refined = maxima.map(|(index, values)| {
            let slope = 0.5 * (values[2] - values[0]);
            let curvature = values[0] - 2.0 * values[1] + values[2];
            let offset = -slope / curvature;
            // Lags decrease with the index.
            let lag = self.lags as f64 - (index as f64 + 1.0) - offset;
            (lag * step, values[1] + 0.5 * slope * offset)
        });
        let refined: Vec<(f64, f64)> = refined.collect();
        let top = refined.iter().map(|(_, top)| *top).fold(f64::MIN, f64::max);
        if greatest > top + EQUAL_MAXIMA {
            return Err("the delay is beyond `delay_range`".to_owned());
        }
        let equal = refined
            .iter()
            .filter(|(_, value)| *value >= top - EQUAL_MAXIMA);
        let nearest = equal.min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let (delay, coefficient) = nearest.ok_or("the delay is beyond `delay_range`")?;
        Ok((*delay, format!("correlation {coefficient:.4}")))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LAGS: usize = 4;

    /// Pearson's coefficient of all pairs, by its definition.
    fn pearson(pairs: &[(f64, f64)]) -> f64 {
        let count = pairs.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(|pair| pair.0), mean(|pair| pair.1));
        let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
            pairs.iter().map(|pair| of(pair.0 - x, pair.1 - y)).sum()
        };
        sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
    }

    proptest! {
        /// The running sums agree with the definition on any series in any segments.
        #[test]
        fn coefficients_agree_with_the_definition(
            segments in prop::collection::vec(
                prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64), 1..40),
                1..5,
            ),
            offset in -1e3..1e3_f64,
        ) {
            let millis = SimDuration::from_millis;
            // A range of three periods has four lags on either side.
            let mut delay = Delay::new(millis(3), millis(1));
            prop_assert_eq!(delay.lags, LAGS);
            let mut now = SimTime::ZERO;
            let mut pairs = vec![Vec::new(); 2 * LAGS + 1];
            for segment in &segments {
                for (signal, with) in segment {
                    delay.add(now, signal + offset, with - offset);
                    now += millis(1);
                }
                now += millis(5);
                for centre in LAGS..segment.len().saturating_sub(LAGS) {
                    for (index, pairs) in pairs.iter_mut().enumerate() {
                        pairs.push((segment[centre].0, segment[centre - LAGS + index].1));
                    }
                }
            }
            prop_assume!(pairs[0].len() > 3);
            delay.end_segment();
            prop_assert_eq!(delay.centres, pairs[0].len() as u64);
            for (index, pairs) in pairs.iter().enumerate() {
                let (found, expected) = (delay.coefficient(index), pearson(pairs));
                // The variances of so few values may be small beside their squares.
                prop_assert!((found - expected).abs() < 1e-8, "{} {}", found, expected);
            }
        }
    }
}
