//! Running statistics of samples.

use twinrig_kernel::{SimDuration, SimTime};

use super::outcome::Finding;
use crate::limits::{Comparison, Limits};

/// Returns the floating-point value closest to a duration \[s\]. A limit with the same decimal
/// notation has the same value, so the limit itself is accepted.
pub(crate) fn seconds(duration: SimDuration) -> f64 {
    duration.as_nanos() as f64 / 1e9
}

/// Time window of an expectation, both ends inclusive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    pub after: SimTime,
    pub before: SimTime,
}

impl Window {
    pub fn contains(&self, now: SimTime) -> bool {
        self.after <= now && now <= self.before
    }
}

/// Least and greatest sample, and the times of the first non-finite sample and of the first
/// violation of limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extremes {
    pub least: f64,
    pub greatest: f64,
    pub non_finite_at: Option<SimTime>,
    pub first_violation: Option<SimTime>,
}

impl Default for Extremes {
    fn default() -> Self {
        Extremes {
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
            non_finite_at: None,
            first_violation: None,
        }
    }
}

impl Extremes {
    pub fn is_empty(&self) -> bool {
        self.least > self.greatest
    }

    pub fn range(&self) -> f64 {
        self.greatest - self.least
    }

    #[inline]
    pub fn add(&mut self, now: SimTime, value: f64) {
        if !value.is_finite() {
            self.non_finite_at.get_or_insert(now);
        }
        if value < self.least {
            self.least = value;
        }
        if value > self.greatest {
            self.greatest = value;
        }
    }

    #[inline]
    pub fn add_within(&mut self, now: SimTime, value: f64, limits: &Limits) {
        self.add(now, value);
        if self.first_violation.is_none() && !limits.hold(value) {
            self.first_violation = Some(now);
        }
    }

    pub fn finding(&self, limits: &Limits, detail: &str) -> Finding {
        if self.non_finite_at.is_some() {
            return Finding::not_a_number(self.non_finite_at);
        }
        if self.is_empty() {
            return Finding::unobserved("there is no observation in its window");
        }
        let comparison = limits.compare(self.least, self.greatest);
        Finding::of(comparison, self.first_violation, detail)
    }
}

/// Settling of values: their distances from the last values.
#[derive(Clone, Debug)]
pub(crate) struct Settling {
    within: f64,
    by: SimTime,
    elements: Vec<(Extremes, f64)>,
}

impl Settling {
    pub fn new(within: f64, by: SimTime, elements: usize) -> Self {
        Settling {
            within,
            by,
            elements: vec![(Extremes::default(), f64::NAN); elements],
        }
    }

    /// Adds samples and returns whether they are at or after the settling time.
    #[inline]
    pub fn add(&mut self, now: SimTime, values: impl Iterator<Item = f64>) -> bool {
        if now < self.by {
            return false;
        }
        for ((extremes, last), value) in self.elements.iter_mut().zip(values) {
            extremes.add(now, value);
            *last = value;
        }
        true
    }

    pub fn finding(&self) -> Finding {
        let mut worst = 0.0_f64;
        for (extremes, last) in &self.elements {
            if extremes.non_finite_at.is_some() {
                return Finding::not_a_number(extremes.non_finite_at);
            }
            if extremes.is_empty() {
                return Finding::unobserved("there is no observation in its window");
            }
            worst = worst
                .max(extremes.greatest - last)
                .max(last - extremes.least);
        }
        let comparison: Comparison = Limits::at_most(self.within).compare(worst, worst);
        Finding::of(comparison, None, "largest deviation from the final value")
    }
}
