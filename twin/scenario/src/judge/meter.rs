//! Statistics for one expectation of a signal or the trunk, updated sample by sample without
//! allocation.

use twinrig_kernel::SimTime;

use super::bounds::Bounds;
use super::gets_up::GetsUpMeter;
use super::outcome::Finding;
use super::recovery::RecoveryMeter;
use super::settling::Settling;
use super::tracker::Extremes;
use super::trunk::{MeanTwist, Speed, Upright, Yaw};
use super::until::Until;
use crate::limits::{Comparison, Limits};

/// Statistics of the samples of one channel.
#[derive(Clone, Debug)]
pub(crate) enum Meter {
    /// All elements are always within limits.
    Always {
        elements: Vec<usize>,
        /// Whether magnitudes are compared.
        absolute: bool,
        limits: Limits,
        extremes: Extremes,
        /// Bounds of other expectations on the same samples.
        others: Option<Box<Bounds>>,
    },
    /// Peak-to-peak range of an element.
    Range {
        element: usize,
        limits: Limits,
        extremes: Extremes,
    },
    /// Each element is within limits at least once.
    Eventually {
        elements: Vec<Nearest>,
        limits: Limits,
    },
    /// Elements are within limits until a condition first holds.
    Until(Until),
    /// Elements stay near their last values.
    Settles(Settling),
    /// Mean speed.
    Speed(Speed),
    /// Greatest change from the initial yaw.
    Yaw(Yaw),
    Twist(MeanTwist),
    /// Absence of a fall, and whether a fall ends the run.
    Upright(Upright, bool),
    /// Recovery from a disturbance.
    Recovers(RecoveryMeter),
    /// Rising from lying to standing.
    GetsUp(GetsUpMeter),
}

/// Sample of an element with the greatest margin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub element: usize,
    /// Best comparison; none before the first sample.
    pub best: Option<Comparison>,
    best_at: SimTime,
    pub non_finite_at: Option<SimTime>,
}

impl Meter {
    /// Evaluates the samples of the meter's channel at `now`, which is within its window; samples
    /// outside the window go to [`Meter::outside`]. Returns whether they count: samples before the
    /// settling time do not, nor do samples after the awaited event.
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) -> bool {
        match self {
            Meter::Always {
                elements,
                absolute,
                limits,
                extremes,
                others,
            } => {
                for &element in elements.iter() {
                    let value = values[element];
                    let value = if *absolute { value.abs() } else { value };
                    extremes.add_of_within(element, now, value, limits);
                }
                if let Some(others) = others {
                    let mut sampled = elements.iter().map(|element| values[*element]);
                    others.add(now, extremes, sampled.any(f64::is_nan));
                }
            }
            Meter::Range {
                element,
                limits,
                extremes,
            } => {
                extremes.add(now, values[*element]);
                if extremes.first_violation.is_none()
                    && limits.max.is_some_and(|max| extremes.range() > max)
                {
                    extremes.first_violation = Some(now);
                }
            }
            Meter::Eventually { elements, limits } => {
                for nearest in elements.iter_mut() {
                    nearest.add(now, values[nearest.element], limits);
                }
            }
            Meter::Until(until) => return until.sample(now, values),
            Meter::Settles(settling) => return settling.add(now, values),
            Meter::Speed(speed) => speed.sample(now, values),
            Meter::Yaw(yaw) => yaw.sample(now, values),
            Meter::Twist(twist) => twist.sample(now, values),
            Meter::Upright(upright, _) => upright.sample(now, values),
            Meter::Recovers(recovery) => return recovery.sample(now, values),
            Meter::GetsUp(rising) => return rising.sample(now, values),
        }
        true
    }

    /// Evaluates samples outside the meter's window.
    #[inline]
    pub fn outside(&mut self, values: &[f64]) {
        match self {
            Meter::Upright(Upright { height, .. }, _)
            | Meter::GetsUp(GetsUpMeter { height, .. }) => {
                height.record(values);
            }
            _ => {}
        }
    }

    /// Handles a fall in the meter's window.
    pub fn fall(&mut self, now: SimTime) {
        if let Meter::Recovers(recovery) = self {
            recovery.fall(now);
        }
    }

    /// Returns whether the samples end the run.
    #[inline]
    pub fn ends_the_run(&self) -> bool {
        matches!(self, Meter::Upright(upright, true) if upright.has_fallen())
    }

    /// Returns the finding.
    pub fn finding(&self) -> Finding {
        match self {
            Meter::Always {
                limits, extremes, ..
            } => extremes.finding_of_elements(limits, ""),
            Meter::Range {
                limits, extremes, ..
            } => range_finding(extremes, limits),
            Meter::Eventually { elements, .. } => eventually_finding(elements),
            Meter::Until(until) => until.finding(),
            Meter::Settles(settling) => settling.finding(),
            Meter::Speed(speed) => speed.finding(),
            Meter::Yaw(yaw) => yaw.finding(),
            Meter::Twist(twist) => twist.finding(),
            Meter::Upright(upright, _) => upright.finding(),
            Meter::Recovers(recovery) => recovery.finding(),
            Meter::GetsUp(rising) => rising.finding(),
        }
    }
}

impl Nearest {
    pub fn new(element: usize) -> Self {
        Nearest {
            element,
            best: None,
            best_at: SimTime::ZERO,
            non_finite_at: None,
        }
    }

    fn add(&mut self, now: SimTime, value: f64, limits: &Limits) {
        if !value.is_finite() {
            self.non_finite_at.get_or_insert(now);
            return;
        }
        let comparison = limits.compare(value, value);
        if self.best.is_none_or(|best| comparison.margin > best.margin) {
            (self.best, self.best_at) = (Some(comparison), now);
        }
    }
}

/// Detail of a signal that is within limits at least once, or never.
pub(super) const CLOSEST_APPROACH: &str = "closest approach";

fn range_finding(extremes: &Extremes, limits: &Limits) -> Finding {
    if extremes.non_finite_at.is_some() {
        return Finding::not_a_number(extremes.non_finite_at);
    }
    if extremes.is_empty() {
        return Finding::unobserved("there is no observation in its window");
    }
    let range = extremes.range();
    Finding::of(limits.compare(range, range), extremes.first_violation, "")
}

fn eventually_finding(elements: &[Nearest]) -> Finding {
    let mut worst: Option<(Comparison, &Nearest)> = None;
    for nearest in elements {
        if nearest.non_finite_at.is_some() {
            return Finding {
                element: Some(nearest.element),
                ..Finding::not_a_number(nearest.non_finite_at)
            };
        }
        let Some(best) = nearest.best else {
            return Finding::unobserved("there is no observation in its window");
        };
        if worst.is_none_or(|(worst, _)| best.margin < worst.margin) {
            worst = Some((best, nearest));
        }
    }
    match worst {
        Some((worst, of)) => Finding::of(worst, None, CLOSEST_APPROACH).seen_in(
            of.element,
            of.best_at,
            worst.measured,
        ),
        None => Finding::unobserved("no signal"),
    }
}
