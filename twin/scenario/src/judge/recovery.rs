//! Recovery of quantities from a disturbance.

use twinrig_kernel::{SimDuration, SimTime};

use super::outcome::{Finding, WITHIN_NOT_OVER, Witness};
use super::settling::LAST_OUTSIDE;
use super::tracker::{Extremes, seconds};
use super::trunk::turn;
use crate::limits::Limits;
use crate::recovery::{Recovery, TrunkQuantity};

/// Statistics of the quantities that recover from a disturbance: their ranges before it, and the
/// time from which on they stay within these.
#[derive(Clone, Debug)]
pub(crate) struct RecoveryMeter {
    recovery: Recovery,
    /// End of the window: after a fall the recovery counts as longer than that.
    window_end: SimTime,
    quantities: Vec<RecoveringQuantity>,
    /// Number of samples before the disturbance.
    count_before: u64,
    recovered_at: Option<SimTime>,
    /// Last sample at which a quantity was outside its range, and its index.
    last_outside: Option<(SimTime, usize)>,
    /// Last sample after the disturbance.
    last_at: Option<SimTime>,
    non_finite_at: Option<SimTime>,
    fell_at: Option<SimTime>,
}

/// A quantity that recovers.
#[derive(Clone, Debug)]
pub(crate) struct RecoveringQuantity {
    /// Name in the detail of the verdict; may be empty.
    pub name: &'static str,
    pub source: QuantitySource,
    pub tolerance: f64,
    pub before: Extremes,
}

/// Calculation of a quantity from the samples.
#[derive(Clone, Debug)]
pub(crate) enum QuantitySource {
    /// An element.
    Element(usize),
    /// The heading, with its last value and the turn since the first one \[rad\].
    Yaw {
        element: usize,
        last: Option<f64>,
        turned: f64,
    },
    /// The speed along the heading, with time and place of the last sample.
    Speed {
        /// Index of x; y follows.
        position: usize,
        yaw: usize,
        last: Option<(SimTime, [f64; 2])>,
    },
}

/// Time of a recovery, a detail, and instant and element of the last sample outside.
type Recovered = (SimDuration, String, Option<SimTime>, Option<usize>);

/// Least number of samples before the disturbance.
const BEFORE_MIN: u64 = 10;

impl RecoveryMeter {
    pub fn new(
        recovery: Recovery,
        window_end: SimTime,
        quantities: Vec<RecoveringQuantity>,
    ) -> Self {
        RecoveryMeter {
            recovery,
            window_end,
            quantities,
            count_before: 0,
            recovered_at: None,
            last_outside: None,
            last_at: None,
            non_finite_at: None,
            fell_at: None,
        }
    }

    /// Evaluates a sample and returns whether it is after the disturbance.
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) -> bool {
        let is_before = now < self.recovery.start;
        let is_after = now > self.recovery.end;
        let mut outside = None;
        for (index, quantity) in self.quantities.iter_mut().enumerate() {
            let Some(value) = quantity.source.value(now, values) else {
                continue;
            };
            if !value.is_finite() {
                self.non_finite_at.get_or_insert(now);
            }
            if is_before {
                quantity.before.add(now, value);
            } else if is_after && !quantity.limits().hold(value) {
                outside = Some(index);
            }
        }
        self.count_before += u64::from(is_before);
        if is_after {
            self.last_at = Some(now);
            if let Some(index) = outside {
                self.last_outside = Some((now, index));
                self.recovered_at = None;
            } else {
                self.recovered_at.get_or_insert(now);
            }
        }
        is_after
    }

    /// Ends the observation by a fall, from which nothing recovers.
    pub fn fall(&mut self, now: SimTime) {
        self.fell_at = Some(now);
    }

    pub fn finding(&self) -> Finding {
        if self.non_finite_at.is_some() {
            return Finding::not_a_number(self.non_finite_at);
        }
        let Recovery { end, within, .. } = self.recovery;
        let found = match self.fell_at {
            Some(at) => Ok((
                self.window_end - end,
                format!("fell at {at}"),
                Some(at),
                None,
            )),
            None => self.recovery_time(),
        };
        match found {
            Ok((time, detail, at, element)) => {
                let comparison =
                    Limits::at_most(seconds(within)).compare(seconds(time), seconds(time));
                let violated_at = self.fell_at.or(end.checked_add(within));
                let finding = Finding::of(comparison, violated_at, detail);
                let witness = Witness {
                    at,
                    ..Witness::default()
                };
                Finding {
                    element,
                    ..finding.seen(witness)
                }
            }
            Err(reason) => Finding::unobserved(reason),
        }
    }

    /// Returns the time of the recovery, a detail, and instant and element of the last sample
    /// outside; or the reason for which it is unobserved.
    fn recovery_time(&self) -> Result<Recovered, String> {
        let Recovery { end, within, .. } = self.recovery;
        if self.count_before < BEFORE_MIN {
            return Err(format!(
                "{} samples before the disturbance, and {BEFORE_MIN} are needed",
                self.count_before
            ));
        }
        let Some(last_at) = self.last_at else {
            return Err("there is no observation after the disturbance".to_owned());
        };
        match (self.recovered_at, self.last_outside) {
            (Some(_), None) => Ok((SimDuration::ZERO, "never outside".to_owned(), None, None)),
            (Some(at), Some((outside, index))) => {
                let detail = self.named(LAST_OUTSIDE, index);
                Ok((at - end, detail, Some(outside), self.element(index)))
            }
            (None, Some((_, index))) if last_at - end > within => {
                let detail = self.named("not recovered", index);
                Ok((last_at - end, detail, None, self.element(index)))
            }
            (None, _) => Err(WITHIN_NOT_OVER.to_owned()),
        }
    }

    /// Returns the element of the quantity `index`, if it is one of a signal.
    fn element(&self, index: usize) -> Option<usize> {
        match self.quantities[index].source {
            QuantitySource::Element(element) | QuantitySource::Yaw { element, .. } => Some(element),
            QuantitySource::Speed { .. } => None,
        }
    }

    /// Returns `words` with the name of the quantity `index`.
    fn named(&self, words: &str, index: usize) -> String {
        match self.quantities[index].name {
            "" => words.to_owned(),
            name => format!("{words}: {name}"),
        }
    }
}

impl RecoveringQuantity {
    pub fn new(name: &'static str, source: QuantitySource, tolerance: f64) -> Self {
        RecoveringQuantity {
            name,
            source,
            tolerance,
            before: Extremes::default(),
        }
    }

    fn limits(&self) -> Limits {
        Limits {
            min: Some(self.before.least - self.tolerance),
            max: Some(self.before.greatest + self.tolerance),
        }
    }
}

impl QuantitySource {
    /// Returns the source of a quantity of the trunk. `position` and `rpy` are the indices of x and
    /// of the roll.
    pub fn of_trunk(quantity: TrunkQuantity, position: usize, rpy: usize) -> Self {
        match quantity {
            TrunkQuantity::Roll => QuantitySource::Element(rpy),
            TrunkQuantity::Pitch => QuantitySource::Element(rpy + 1),
            TrunkQuantity::Height => QuantitySource::Element(position + 2),
            TrunkQuantity::Yaw => QuantitySource::Yaw {
                element: rpy + 2,
                last: None,
                turned: 0.0,
            },
            TrunkQuantity::Speed => QuantitySource::Speed {
                position,
                yaw: rpy + 2,
                last: None,
            },
        }
    }

    /// Returns the value at `now`; none at the first sample of a rate.
    fn value(&mut self, now: SimTime, values: &[f64]) -> Option<f64> {
        match self {
            QuantitySource::Element(element) => Some(values[*element]),
            QuantitySource::Yaw {
                element,
                last,
                turned,
            } => {
                let yaw = values[*element];
                *turned += turn(last.replace(yaw).unwrap_or(yaw), yaw);
                Some(*turned)
            }
            QuantitySource::Speed {
                position,
                yaw,
                last,
            } => {
                let [x, y] = [values[*position], values[*position + 1]];
                let (before, [from_x, from_y]) = last.replace((now, [x, y]))?;
                let elapsed = (now - before).as_secs_f64();
                let heading = values[*yaw];
                let (sin, cos) = (libm::sin(heading), libm::cos(heading));
                Some(((x - from_x) * cos + (y - from_y) * sin) / elapsed)
            }
        }
    }
}
