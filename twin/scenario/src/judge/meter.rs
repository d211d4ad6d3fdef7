//! One expectation of a signal or the trunk, fed sample by sample. Nothing here allocates once the run has begun.

use twinrig_kernel::SimTime;

use super::outcome::Finding;
use super::tracker::{Extremes, Settling};
use super::trunk::{Speed, Upright, Yaw};
use crate::limits::{Comparison, Limits};

/// Watches the samples of one channel.
#[derive(Clone, Debug)]
pub(crate) enum Meter {
    /// Elements stay within limits.
    Always {
        elements: Vec<usize>,
        /// Watch magnitudes.
        absolute: bool,
        limits: Limits,
        seen: Extremes,
    },
    /// The distance between the greatest and the least value of an element.
    Range {
        element: usize,
        limits: Limits,
        seen: Extremes,
    },
    /// Elements come within limits at least once, each.
    Eventually {
        elements: Vec<Nearest>,
        limits: Limits,
    },
    /// Elements stay within limits until another element comes within its own.
    Until {
        elements: Vec<usize>,
        limits: Limits,
        seen: Extremes,
        other: usize,
        other_limits: Limits,
        over_at: Option<SimTime>,
    },
    /// Elements stay near where they end.
    Settles {
        elements: Vec<usize>,
        settling: Settling,
    },
    /// Mean speed.
    Speed(Speed),
    /// Greatest turn away from the first yaw.
    Yaw(Yaw),
    /// The trunk stays up, and whether the run ends when it does not.
    Upright(Upright, bool),
}

/// How near an element has come to the limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub element: usize,
    /// The best so far; none before the first sample.
    pub best: Option<Comparison>,
    pub broken_at: Option<SimTime>,
}

impl Meter {
    /// Takes the samples of the meter's channel at `now`, which is within its window. What must be
    /// known from before the window goes to [`Meter::outside`]. Whether they were looked at: what
    /// settles is not before its time, nor is anything after what is waited for.
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) -> bool {
        match self {
            Meter::Always {
                elements,
                absolute,
                limits,
                seen,
            } => {
                for &element in elements.iter() {
                    let value = values[element];
                    let value = if *absolute { value.abs() } else { value };
                    seen.add_within(now, value, limits);
                }
            }
            Meter::Range {
                element,
                limits,
                seen,
            } => {
                seen.add(now, values[*element]);
                if seen.first_violation.is_none()
                    && limits.max.is_some_and(|max| seen.range() > max)
                {
                    seen.first_violation = Some(now);
                }
            }
            Meter::Eventually { elements, limits } => {
                for nearest in elements.iter_mut() {
                    nearest.add(now, values[nearest.element], limits);
                }
            }
            Meter::Until {
                elements,
                limits,
                seen,
                other,
                other_limits,
                over_at,
            } => {
                if over_at.is_none() && other_limits.hold(values[*other]) {
                    *over_at = Some(now);
                }
                if over_at.is_some() {
                    return false;
                }
                for &element in elements.iter() {
                    seen.add_within(now, values[element], limits);
                }
            }
            Meter::Settles { elements, settling } => {
                return settling.add(now, elements.iter().map(|&element| values[element]));
            }
            Meter::Speed(speed) => speed.sample(now, values),
            Meter::Yaw(yaw) => yaw.sample(now, values),
            Meter::Upright(upright, _) => upright.sample(now, values),
        }
        true
    }

    /// Takes samples outside the meter's window.
    #[inline]
    pub fn outside(&mut self, values: &[f64]) {
        if let Meter::Upright(upright, _) = self {
            upright.stand(values);
        }
    }

    /// Whether what was seen ends the run.
    #[inline]
    pub fn ends_the_run(&self) -> bool {
        matches!(self, Meter::Upright(upright, true) if upright.has_fallen())
    }

    /// What was found.
    pub fn finding(&self) -> Finding {
        match self {
            Meter::Always { limits, seen, .. } => seen.finding(limits, ""),
            Meter::Range { limits, seen, .. } => range_finding(seen, limits),
            Meter::Eventually { elements, .. } => eventually_finding(elements),
            Meter::Until {
                limits,
                seen,
                over_at,
                ..
            } => until_finding(limits, seen, *over_at),
            Meter::Settles { settling, .. } => settling.finding(),
            Meter::Speed(speed) => speed.finding(),
            Meter::Yaw(yaw) => yaw.finding(),
            Meter::Upright(upright, _) => upright.finding(),
        }
    }
}

impl Nearest {
    pub fn new(element: usize) -> Self {
        Nearest {
            element,
            best: None,
            broken_at: None,
        }
    }

    fn add(&mut self, now: SimTime, value: f64, limits: &Limits) {
        if !value.is_finite() {
            self.broken_at.get_or_insert(now);
            return;
        }
        let here = limits.compare(value, value);
        if self.best.is_none_or(|best| here.margin > best.margin) {
            self.best = Some(here);
        }
    }
}

fn range_finding(seen: &Extremes, limits: &Limits) -> Finding {
    if seen.broken_at.is_some() {
        return Finding::not_a_number(seen.broken_at);
    }
    if seen.is_empty() {
        return Finding::unobserved("nothing was observed in its time");
    }
    let range = seen.range();
    Finding::of(limits.compare(range, range), seen.first_violation, "")
}

fn eventually_finding(elements: &[Nearest]) -> Finding {
    let mut worst: Option<Comparison> = None;
    for nearest in elements {
        if nearest.broken_at.is_some() {
            return Finding::not_a_number(nearest.broken_at);
        }
        let Some(best) = nearest.best else {
            return Finding::unobserved("nothing was observed in its time");
        };
        if worst.is_none_or(|worst| best.margin < worst.margin) {
            worst = Some(best);
        }
    }
    match worst {
        Some(worst) => Finding::of(worst, None, "nearest that it came"),
        None => Finding::unobserved("no signal"),
    }
}

fn until_finding(limits: &Limits, seen: &Extremes, over_at: Option<SimTime>) -> Finding {
    if seen.broken_at.is_some() {
        return Finding::not_a_number(seen.broken_at);
    }
    let Some(over_at) = over_at else {
        let mut finding = seen.finding(limits, "what is waited for never happened");
        finding.verdict = super::Verdict::Fail;
        return finding;
    };
    if seen.is_empty() {
        return Finding::unobserved("what is waited for held from the start");
    }
    seen.finding(limits, &format!("until {over_at}"))
}
