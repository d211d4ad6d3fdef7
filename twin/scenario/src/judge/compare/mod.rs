//! Statistics for one expectation that compares two signals, updated sample by sample without
//! allocation.

mod delay;
mod found;
mod moments;
mod pairs;
mod peaks;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Group;

use super::outcome::{Finding, Witness};
use super::tracker::Extremes;
use crate::compare::CompareMeasure;
use crate::limits::Limits;
use delay::Delay;
use found::NOTHING;
use moments::Moments;
use pairs::Pairs;
use peaks::Peaks;

pub(crate) use pairs::Source;

/// Comparison of two signals.
#[derive(Clone, Debug)]
pub(crate) struct CompareMeter {
    pairs: Pairs,
    limits: Limits,
    statistic: Statistic,
    non_finite_at: Option<SimTime>,
}

#[derive(Clone, Debug)]
enum Statistic {
    /// Number and sum of squares of differences.
    Error(u64, f64),
    /// Magnitudes of differences.
    ErrorPeak(Extremes),
    Delay(Box<Delay>),
    Correlation(Moments),
    Gain(Moments),
    Peaks(Peaks),
}

impl CompareMeter {
    /// Creates a meter for a signal and the one that it is compared with.
    pub fn new(measure: CompareMeasure, limits: Limits, signal: Source, with: Source) -> Self {
        CompareMeter {
            pairs: Pairs::new(signal, with),
            limits,
            statistic: Statistic::new(measure, signal.period),
            non_finite_at: None,
        }
    }

    /// Returns whether the meter evaluates samples of a group.
    pub fn reads(&self, group: Group) -> bool {
        self.pairs.reads(group)
    }

    /// Evaluates samples of a group and returns the number of pairs that they complete.
    /// `in_window`: whether `now` is within the meter's window.
    #[inline]
    pub fn sample(&mut self, now: SimTime, group: Group, values: &[f64], in_window: bool) -> u64 {
        let CompareMeter {
            pairs,
            limits,
            statistic,
            non_finite_at,
        } = self;
        let mut count = 0;
        pairs.sample(now, group, values, in_window, |at, signal, with| {
            count += 1;
            if signal.is_finite() && with.is_finite() {
                statistic.add(at, signal, with, limits);
            } else {
                non_finite_at.get_or_insert(at);
            }
        });
        count
    }

    /// Returns the finding.
    pub fn finding(&self) -> Finding {
        if self.non_finite_at.is_some() {
            return Finding::not_a_number(self.non_finite_at);
        }
        if self.pairs.has_overflowed() {
            return Finding::unobserved(
                "the signal that it is compared with was not observed for a while",
            );
        }
        let (found, first_violation) = match &self.statistic {
            Statistic::Error(0, _) => (Err(NOTHING.to_owned()), None),
            Statistic::Error(count, squares) => {
                let mean = squares / *count as f64;
                (Ok((mean.sqrt(), String::new())), None)
            }
            Statistic::ErrorPeak(extremes) if extremes.is_empty() => {
                (Err(NOTHING.to_owned()), None)
            }
            Statistic::ErrorPeak(extremes) => {
                let found = Ok((extremes.greatest, String::new()));
                (found, extremes.first_violation)
            }
            Statistic::Delay(delay) => (delay.found(), None),
            Statistic::Correlation(moments) => (moments.correlation(), None),
            Statistic::Gain(moments) => (moments.gain(), None),
            Statistic::Peaks(peaks) => (peaks.found(), None),
        };
        match found {
            Ok((value, _)) if !value.is_finite() => Finding::not_a_number(None),
            Ok((value, detail)) => {
                let comparison = self.limits.compare(value, value);
                let finding = Finding::of(comparison, first_violation, detail);
                match &self.statistic {
                    Statistic::ErrorPeak(extremes) => {
                        finding.seen(Witness::default().at(extremes.greatest_site.at, value))
                    }
                    _ => finding,
                }
            }
            Err(reason) => Finding::unobserved(reason),
        }
    }
}

impl Statistic {
    fn new(measure: CompareMeasure, period: SimDuration) -> Self {
        match measure {
            CompareMeasure::Error => Statistic::Error(0, 0.0),
            CompareMeasure::ErrorPeak => Statistic::ErrorPeak(Extremes::default()),
            CompareMeasure::Delay { range } => {
                Statistic::Delay(Box::new(Delay::new(range, period)))
            }
            CompareMeasure::Correlation => Statistic::Correlation(Moments::default()),
            CompareMeasure::Gain => Statistic::Gain(Moments::default()),
            CompareMeasure::Peaks => Statistic::Peaks(Peaks::default()),
        }
    }

    #[inline]
    fn add(&mut self, at: SimTime, signal: f64, with: f64, limits: &Limits) {
        match self {
            Statistic::Error(count, squares) => {
                *count += 1;
                *squares += (signal - with) * (signal - with);
            }
            Statistic::ErrorPeak(extremes) => {
                let error = (signal - with).abs();
                extremes.add(at, error);
                if extremes.first_violation.is_none() && limits.max.is_some_and(|max| error > max) {
                    extremes.first_violation = Some(at);
                }
            }
            Statistic::Delay(delay) => delay.add(at, signal, with),
            Statistic::Correlation(moments) | Statistic::Gain(moments) => {
                moments.add(signal, with);
            }
            Statistic::Peaks(peaks) => peaks.add(signal, with),
        }
    }
}
