//! Running statistics of samples.

use twinrig_kernel::{SimDuration, SimTime};

use super::outcome::Finding;
use crate::limits::Limits;

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
    pub least_site: Site,
    pub greatest_site: Site,
    pub non_finite_at: Option<SimTime>,
    non_finite_in: usize,
    pub first_violation: Option<SimTime>,
}

/// Instant of a sample, and its element where the statistics are of several.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Site {
    pub at: SimTime,
    pub element: usize,
}

impl Default for Extremes {
    fn default() -> Self {
        Extremes {
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
            least_site: Site::default(),
            greatest_site: Site::default(),
            non_finite_at: None,
            non_finite_in: 0,
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
        self.add_of(0, now, value);
    }

    /// Adds a sample of an element.
    #[inline]
    pub fn add_of(&mut self, element: usize, now: SimTime, value: f64) {
        if !value.is_finite() && self.non_finite_at.is_none() {
            (self.non_finite_at, self.non_finite_in) = (Some(now), element);
        }
        if value < self.least {
            self.least = value;
            self.least_site = Site { at: now, element };
        }
        if value > self.greatest {
            self.greatest = value;
            self.greatest_site = Site { at: now, element };
        }
    }

    #[inline]
    pub fn add_within(&mut self, now: SimTime, value: f64, limits: &Limits) {
        self.add_of_within(0, now, value, limits);
    }

    /// Adds a sample of an element, and compares it with limits.
    #[inline]
    pub fn add_of_within(&mut self, element: usize, now: SimTime, value: f64, limits: &Limits) {
        self.add_of(element, now, value);
        if self.first_violation.is_none() && !limits.hold(value) {
            self.first_violation = Some(now);
        }
    }

    /// Returns the finding of statistics of one element.
    pub fn finding(&self, limits: &Limits, detail: &str) -> Finding {
        let finding = self.finding_of_elements(limits, detail);
        Finding {
            element: None,
            ..finding
        }
    }

    /// Returns the finding of statistics of several elements.
    pub fn finding_of_elements(&self, limits: &Limits, detail: &str) -> Finding {
        if let Some(finding) = self.not_finite() {
            return finding;
        }
        if self.is_empty() {
            return Finding::unobserved("there is no observation in its window");
        }
        let comparison = limits.compare(self.least, self.greatest);
        let site = if comparison.measured.to_bits() == self.greatest.to_bits() {
            self.greatest_site
        } else {
            self.least_site
        };
        Finding::of(comparison, self.first_violation, detail).seen_in(
            site.element,
            site.at,
            comparison.measured,
        )
    }

    /// Returns the finding of a sample that was not finite.
    pub fn not_finite(&self) -> Option<Finding> {
        let at = self.non_finite_at?;
        Some(Finding {
            element: Some(self.non_finite_in),
            ..Finding::not_a_number(Some(at))
        })
    }
}
