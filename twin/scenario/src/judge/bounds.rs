//! Bounds of several expectations on the same samples, which share one running minimum and maximum.

use twinrig_kernel::SimTime;

use super::tracker::Extremes;
use crate::limits::Limits;

/// Limits of further expectations on the samples of a meter, with their first violations.
///
/// A limit is violated for the first time where the running extreme passes it. Sorted, the limits
/// are passed in their order, so that a sample is compared with the next one of each side alone.
#[derive(Clone, Debug, Default)]
pub(super) struct Bounds {
    lower: Side,
    upper: Side,
    /// Index of the monitor and first violation of each.
    pub monitors: Vec<(usize, Option<SimTime>)>,
}

/// Limits of one side from the first to be passed to the last, with positions of their monitors.
#[derive(Clone, Debug, Default)]
struct Side {
    limits: Vec<(f64, usize)>,
    passed: usize,
}

impl Bounds {
    /// Adds the limits of a monitor; [`Bounds::sort`] follows the last ones.
    pub fn push(&mut self, monitor: usize, limits: &Limits) {
        let at = self.monitors.len();
        self.lower.limits.extend(limits.min.map(|min| (min, at)));
        self.upper.limits.extend(limits.max.map(|max| (max, at)));
        self.monitors.push((monitor, None));
    }

    /// Brings the limits into the order in which they are passed.
    pub fn sort(&mut self) {
        let Self { lower, upper, .. } = self;
        lower.limits.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        upper.limits.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    }

    /// Takes the extremes after a sample, of which a value may be NaN.
    #[inline]
    pub fn add(&mut self, now: SimTime, extremes: &Extremes, has_nan: bool) {
        let Self {
            lower,
            upper,
            monitors,
        } = self;
        lower.pass(now, monitors, |limit| extremes.least < limit);
        upper.pass(now, monitors, |limit| extremes.greatest > limit);
        if has_nan {
            // No limit holds.
            lower.pass(now, monitors, |_| true);
            upper.pass(now, monitors, |_| true);
        }
    }
}

impl Side {
    #[inline]
    fn pass(
        &mut self,
        now: SimTime,
        monitors: &mut [(usize, Option<SimTime>)],
        is_passed: impl Fn(f64) -> bool,
    ) {
        while let Some(&(limit, at)) = self.limits.get(self.passed)
            && is_passed(limit)
        {
            monitors[at].1.get_or_insert(now);
            self.passed += 1;
        }
    }
}
