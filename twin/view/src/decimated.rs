//! Decimation of samples to what a screen shows: the least and the greatest of each interval, in
//! their order, so that no peak is lost.

/// Intervals of samples that share their times.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Decimation {
    count: usize,
    /// Samples of an interval; 1 if all are kept.
    per_interval: usize,
}

impl Decimation {
    /// Creates the decimation of `count` samples to about `most`, at least two.
    pub(crate) fn to(count: usize, most: usize) -> Self {
        let intervals = (most / 2).max(1);
        let per_interval = if count <= most.max(2) {
            1
        } else {
            count.div_ceil(intervals)
        };
        Self {
            count,
            per_interval,
        }
    }

    /// Returns the number of samples for each one that is kept.
    pub(crate) fn factor(&self) -> f64 {
        if self.per_interval == 1 {
            1.0
        } else {
            self.per_interval as f64 / 2.0
        }
    }

    fn intervals(&self) -> impl Iterator<Item = core::ops::Range<usize>> {
        let (count, step) = (self.count, self.per_interval);
        let starts = (0..count).step_by(step);
        starts.map(move |start| start..(start + step).min(count))
    }

    /// Returns the times of the kept samples: those of the interval's first and middle one.
    pub(crate) fn times(&self, times: &[f64]) -> Vec<f64> {
        if self.per_interval == 1 {
            return times.to_vec();
        }
        let pairs = self.intervals().flat_map(|range| {
            let middle = range.start + range.len() / 2;
            [times[range.start], times[middle]]
        });
        pairs.collect()
    }

    /// Returns the kept values: the least and the greatest of each interval, in their order. Those
    /// that are not finite are kept.
    pub(crate) fn values(&self, values: &[f64]) -> Vec<f64> {
        if self.per_interval == 1 {
            return values.to_vec();
        }
        let pairs = self.intervals().flat_map(|range| {
            let values = &values[range];
            let (mut least, mut greatest) = (0, 0);
            for (index, value) in values.iter().enumerate() {
                if !value.is_finite() {
                    return [*value; 2];
                }
                if *value < values[least] {
                    least = index;
                }
                if *value > values[greatest] {
                    greatest = index;
                }
            }
            let [first, second] = [least.min(greatest), least.max(greatest)];
            [values[first], values[second]]
        });
        pairs.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_samples_are_all_kept() {
        let decimation = Decimation::to(5, 5);
        let values = [3.0, 1.0, 2.0, 5.0, 4.0];
        assert_eq!(decimation.values(&values), values);
        assert_eq!(decimation.times(&values), values);
        assert_eq!(decimation.factor(), 1.0);
    }

    #[test]
    fn peaks_and_gaps_are_kept_in_their_order() {
        let mut values: Vec<f64> = (0..1000).map(|n| f64::from(n % 7)).collect();
        values[313] = 100.0;
        values[314] = -100.0;
        values[702] = f64::NAN;
        let decimation = Decimation::to(values.len(), 100);
        let kept = decimation.values(&values);
        let times: Vec<f64> = (0..1000).map(f64::from).collect();
        let times = decimation.times(&times);
        assert_eq!(kept.len(), times.len());
        assert!(kept.len() <= 100, "{}", kept.len());
        let at = kept.iter().position(|value| *value == 100.0).unwrap();
        assert_eq!(kept[at + 1], -100.0);
        assert!((times[at] - 313.0).abs() <= 20.0);
        assert_eq!(kept.iter().filter(|value| value.is_nan()).count(), 2);
        assert!(times.is_sorted_by(|a, b| a < b));
        assert_eq!(decimation.factor(), 10.0);
    }
}
