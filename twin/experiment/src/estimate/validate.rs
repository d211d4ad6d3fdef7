//! Validation of tuned filters on the third run (section 4.3.2.3).

use std::ops::Range;

use serde::Serialize;

use super::data::{Part, Signals};
use super::track::track;
use super::tune::TunedFilter;
use crate::error::StudyError;

/// Result of a filter at a frequency.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FilterRow {
    /// Name of the filter.
    pub filter: &'static str,
    /// Frequency \[Hz\]; `None`: all of them.
    pub hz: Option<f64>,
    /// Periods.
    pub periods: usize,
    /// RMS error of the force \[N\].
    pub force_rmse_n: f64,
    /// RMS error of the rate \[N/s\].
    pub rate_rmse_n_s: f64,
    /// RMS of the true rate \[N/s\].
    pub rate_rms_n_s: f64,
    /// Mean maximum of the estimate over that of the truth \[1\].
    pub maxima: f64,
    /// Mean minimum of the estimate less that of the truth \[N\].
    pub minima_n: f64,
    /// Mean standard deviation of the estimate where the truth is greatest \[N\].
    pub deviation_at_maxima_n: f64,
    /// Mean standard deviation of the estimate where the truth is least \[N\].
    pub deviation_at_minima_n: f64,
    /// Mean normalised innovation squared, of one measurement \[1\].
    pub nis: f64,
    /// 95 % band of that mean for a consistent filter.
    pub nis_band: [f64; 2],
    /// Mean normalised estimation error squared of the force \[1\].
    pub nees: f64,
    /// 95 % band of that mean for a consistent filter.
    pub nees_band: [f64; 2],
}

/// Estimates of a filter beside the truth, sample by sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Estimates {
    force: Vec<f64>,
    deviation: Vec<f64>,
    rate: Vec<f64>,
    /// Normalised innovation squared, with its number of measurements.
    nis: Vec<(f64, u32)>,
    nees: Vec<f64>,
}

/// Estimate of one instant beside the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EstimatePoint {
    /// Time from the first point \[s\].
    pub at_s: f64,
    /// True force \[N\].
    pub truth: f64,
    /// Estimated force \[N\].
    pub estimate: f64,
    /// Its standard deviation \[N\].
    pub deviation: f64,
    /// True rate \[N/s\].
    pub true_rate: f64,
    /// Estimated rate \[N/s\].
    pub rate: f64,
}

impl Estimates {
    /// Runs a filter over the whole of a run.
    pub(crate) fn of(filter: &TunedFilter, signals: &Signals) -> Result<Self, StudyError> {
        let mut found = Self::default();
        let all = 0..signals.force.len();
        track(&filter.settings, signals, all, |i, estimate, estimator| {
            found.force.push(estimate.force);
            found.deviation.push(estimate.deviation);
            found.rate.push(estimate.rate);
            found.nis.push((estimate.nis, estimate.nis_count));
            // A covariance without an inverse has no NEES.
            let nees = estimator.nees(&[signals.force[i]]);
            found.nees.push(nees.unwrap_or(f64::INFINITY));
        })?;
        Ok(found)
    }

    /// Rows of each frequency, then of all.
    pub(crate) fn rows(&self, filter: &'static str, signals: &Signals) -> Vec<FilterRow> {
        let parts = signals.parts.iter();
        let mut rows: Vec<FilterRow> = parts
            .map(|part| self.row(filter, Some(part.hz), signals, std::slice::from_ref(part)))
            .collect();
        rows.push(self.row(filter, None, signals, &signals.parts));
        rows
    }

    fn row(
        &self,
        filter: &'static str,
        hz: Option<f64>,
        signals: &Signals,
        parts: &[Part],
    ) -> FilterRow {
        let steady = || parts.iter().flat_map(|part| part.samples.clone());
        let count = steady().count().max(1) as f64;
        let rms = |of: &dyn Fn(usize) -> f64| {
            let square: f64 = steady().map(|i| of(i) * of(i)).sum();
            (square / count).sqrt()
        };
        let periods: Vec<Range<usize>> = parts
            .iter()
            .flat_map(|part| periods(&signals.force, part.samples.clone()))
            .collect();
        let mean = |of: &dyn Fn(&Range<usize>) -> f64| {
            periods.iter().map(of).sum::<f64>() / periods.len().max(1) as f64
        };
        let truth = &signals.force;
        let maximum = |of: &[f64], range: &Range<usize>| of[greatest(of, range)];
        let minimum = |of: &[f64], range: &Range<usize>| of[least(of, range)];
        let measurements: u32 = steady().map(|i| self.nis[i].1).sum();
        let nis: f64 = steady().map(|i| self.nis[i].0).sum();
        FilterRow {
            filter,
            hz,
            periods: periods.len(),
            force_rmse_n: rms(&|i| self.force[i] - truth[i]),
            rate_rmse_n_s: rms(&|i| self.rate[i] - signals.rate[i]),
            rate_rms_n_s: rms(&|i| signals.rate[i]),
            maxima: mean(&|range| maximum(&self.force, range))
                / mean(&|range| maximum(truth, range)),
            minima_n: mean(&|range| minimum(&self.force, range) - minimum(truth, range)),
            deviation_at_maxima_n: mean(&|range| self.deviation[greatest(truth, range)]),
            deviation_at_minima_n: mean(&|range| self.deviation[least(truth, range)]),
            nis: nis / f64::from(measurements.max(1)),
            nis_band: band(f64::from(measurements)),
            nees: steady().map(|i| self.nees[i]).sum::<f64>() / count,
            nees_band: band(count),
        }
    }

    /// Points of the first two periods at a frequency.
    pub(crate) fn points(&self, signals: &Signals, hz: f64) -> Vec<EstimatePoint> {
        let Some(part) = signals.at(hz) else {
            return Vec::new();
        };
        let mut found = periods(&signals.force, part.samples.clone()).into_iter();
        let (Some(first), Some(second)) = (found.next(), found.next()) else {
            return Vec::new();
        };
        let range = first.start..second.end;
        let every = (range.len() / POINTS).max(1);
        let start = range.start;
        let point = |i: usize| EstimatePoint {
            at_s: (i - start) as f64 * signals.period_s,
            truth: signals.force[i],
            estimate: self.force[i],
            deviation: self.deviation[i],
            true_rate: signals.rate[i],
            rate: self.rate[i],
        };
        range.step_by(every).map(point).collect()
    }
}

/// Greatest number of points of a curve, about.
const POINTS: usize = 240;

fn greatest(values: &[f64], range: &Range<usize>) -> usize {
    let places = range.clone();
    let found = places.max_by(|&a, &b| values[a].total_cmp(&values[b]));
    found.unwrap_or(range.start)
}

fn least(values: &[f64], range: &Range<usize>) -> usize {
    let places = range.clone();
    let found = places.min_by(|&a, &b| values[a].total_cmp(&values[b]));
    found.unwrap_or(range.start)
}

/// Share of the range of a signal by which it has to be below the middle before it begins a period,
/// and above it where it does.
const HYSTERESIS: f64 = 0.1;

/// Returns the complete periods in `range`. A period begins where the signal rises through the
/// middle of its range.
pub(crate) fn periods(signal: &[f64], range: Range<usize>) -> Vec<Range<usize>> {
    let values = || range.clone().map(|i| signal[i]);
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    let (middle, margin) = (f64::midpoint(low, high), HYSTERESIS * (high - low));
    let (mut begins, mut armed) = (Vec::new(), false);
    for i in range {
        if signal[i] < middle - margin {
            armed = true;
        } else if armed && signal[i] > middle + margin {
            armed = false;
            begins.push(i);
        }
    }
    begins.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

/// 97.5 % quantile of the normal distribution.
const NORMAL: f64 = 1.959_963_984_540_054;

/// 95 % band of the mean of `count` independent squares of standard normal numbers: quantiles of
/// the chi-squared distribution by the formula of Wilson and Hilferty, over `count`. From 10 on
/// they are right to 1 %.
fn band(count: f64) -> [f64; 2] {
    let spread = 2.0 / (9.0 * count.max(1.0));
    [-NORMAL, NORMAL].map(|z| {
        let root = 1.0 - spread + z * spread.sqrt();
        root * root * root
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of SciPy: `chi2.ppf([0.025, 0.975], n) / n`.
    #[test]
    fn bands_are_quantiles_of_chi_squared() {
        for (count, expected, tolerance) in [
            (10.0, [0.324_697_3, 2.048_317_7], 1e-2),
            (1000.0, [0.914_257_1, 1.089_530_9], 1e-5),
        ] {
            for (found, expected) in band(count).into_iter().zip(expected) {
                assert!(
                    (found / expected - 1.0).abs() < tolerance,
                    "{count}: {found}"
                );
            }
        }
    }

    #[test]
    fn periods_begin_at_the_middle_whatever_the_noise() {
        let wave =
            |i: usize| libm::sin(i as f64 * 0.1) + if i.is_multiple_of(2) { 0.05 } else { -0.05 };
        let signal: Vec<f64> = (0..400).map(wave).collect();
        let lengths: Vec<usize> = periods(&signal, 0..400).iter().map(Range::len).collect();
        // 2π/0.1, to the next sample and the amplitude of the noise.
        assert_eq!(lengths.len(), 5);
        assert!(
            lengths.iter().all(|length| (60..=66).contains(length)),
            "{lengths:?}"
        );
    }
}
