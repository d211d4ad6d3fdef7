//! Rising of a trunk that lies.

use twinrig_kernel::SimTime;

use super::outcome::{Finding, Witness};
use super::tracker::seconds;
use crate::body::GetsUp;
use crate::limits::Limits;

/// Time from the first instant at which the trunk lies to the one from which on it stands.
#[derive(Clone, Debug)]
pub(crate) struct GetsUpMeter {
    claim: GetsUp,
    /// Index of the height.
    height: usize,
    /// Index of the roll; the pitch follows.
    roll: usize,
    standing_height: Option<f64>,
    /// First sample at which it lies.
    lies_at: Option<SimTime>,
    /// First of the samples without interruption at which it stands.
    stands_at: Option<SimTime>,
    /// Whether it has stood for as long as it has to.
    is_up: bool,
    last_at: Option<SimTime>,
    non_finite_at: Option<SimTime>,
}

impl GetsUpMeter {
    pub fn new(claim: GetsUp, height: usize, roll: usize) -> Self {
        GetsUpMeter {
            claim,
            height,
            roll,
            standing_height: None,
            lies_at: None,
            stands_at: None,
            is_up: false,
            last_at: None,
            non_finite_at: None,
        }
    }

    /// Stores the first height of the run, inside or outside the window, and returns it.
    #[inline]
    pub fn record_standing_height(&mut self, values: &[f64]) -> f64 {
        *self.standing_height.get_or_insert(values[self.height])
    }

    /// Evaluates a sample and returns whether the trunk lies or has lain.
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) -> bool {
        let least = self.claim.height * self.record_standing_height(values);
        let height = values[self.height];
        let [roll, pitch] = [values[self.roll], values[self.roll + 1]];
        if ![height, roll, pitch].iter().all(|value| value.is_finite()) {
            self.non_finite_at.get_or_insert(now);
        }
        let tilt = roll.abs().max(pitch.abs());
        if self.lies_at.is_none() && tilt < self.claim.lying {
            return false;
        }
        self.lies_at.get_or_insert(now);
        self.last_at = Some(now);
        if self.is_up {
            return true;
        }
        if tilt <= self.claim.tilt && height >= least {
            let since = *self.stands_at.get_or_insert(now);
            self.is_up = now - since >= self.claim.hold;
        } else {
            self.stands_at = None;
        }
        true
    }

    pub fn finding(&self) -> Finding {
        if self.non_finite_at.is_some() {
            return Finding::not_a_number(self.non_finite_at);
        }
        let (Some(lies_at), Some(last_at)) = (self.lies_at, self.last_at) else {
            return Finding::unobserved("the trunk never lies in its window");
        };
        let GetsUp { within, hold, .. } = self.claim;
        let up_at = self.stands_at.filter(|_| self.is_up);
        let time = up_at.unwrap_or(last_at) - lies_at;
        // The last observation may be that of a trunk that stands, though not for long enough yet.
        if up_at.is_none() && time < within + hold {
            return Finding::unobserved(
                "the observation ended before `within` and `hold` were over",
            );
        }
        let comparison = Limits::at_most(seconds(within)).compare(seconds(time), seconds(time));
        let detail = match up_at {
            Some(_) => format!("lies from {lies_at} on"),
            None => format!("lies from {lies_at} on, and does not get up"),
        };
        let finding = Finding::of(comparison, lies_at.checked_add(within), detail);
        finding.seen(Witness {
            at: up_at,
            ..Witness::default()
        })
    }
}
