//! Rising of a trunk that lies.

use twinrig_kernel::SimTime;

use super::outcome::{Finding, WITHIN_NOT_OVER, Witness};
use super::tracker::seconds;
use super::trunk::StandingHeight;
use crate::body::GetsUp;
use crate::limits::Limits;
use crate::recovery::TrunkQuantity;

/// Time from the first instant at which the trunk lies to the beginning of its first stand.
#[derive(Clone, Debug)]
pub(crate) struct GetsUpMeter {
    claim: GetsUp,
    pub height: StandingHeight,
    /// Index of the roll; the pitch follows.
    roll: usize,
    /// First sample at which it lies.
    lies_at: Option<SimTime>,
    /// First sample of the present stand.
    stands_at: Option<SimTime>,
    /// Quantity by which it did not stand in the last sample that was not of a stand.
    obstacle: &'static str,
    /// Whether it has stood for as long as it has to.
    is_up: bool,
    last_at: Option<SimTime>,
    non_finite_at: Option<SimTime>,
}

impl GetsUpMeter {
    pub fn new(claim: GetsUp, height: usize, roll: usize) -> Self {
        GetsUpMeter {
            claim,
            height: StandingHeight::new(height),
            roll,
            lies_at: None,
            stands_at: None,
            obstacle: "",
            is_up: false,
            last_at: None,
            non_finite_at: None,
        }
    }

    /// Evaluates a sample and returns whether the trunk lies or has lain.
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) -> bool {
        let least = self.claim.height * self.height.record(values);
        let height = values[self.height.element];
        let [roll, pitch] = [values[self.roll], values[self.roll + 1]];
        if ![height, roll, pitch].iter().all(|value| value.is_finite()) {
            self.non_finite_at.get_or_insert(now);
        }
        let [roll, pitch] = [roll.abs(), pitch.abs()];
        if self.lies_at.is_none() && roll.max(pitch) < self.claim.lying {
            return false;
        }
        self.lies_at.get_or_insert(now);
        self.last_at = Some(now);
        if self.is_up {
            return true;
        }
        let most = self.claim.tilt;
        let quantities = [
            (roll <= most, TrunkQuantity::Roll),
            (pitch <= most, TrunkQuantity::Pitch),
            (height >= least, TrunkQuantity::Height),
        ];
        if let Some((_, obstacle)) = quantities.iter().find(|(stands, _)| !stands) {
            self.obstacle = obstacle.name();
            self.stands_at = None;
        } else {
            let since = *self.stands_at.get_or_insert(now);
            self.is_up = now - since >= self.claim.hold;
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
        let within = self.claim.within;
        // The least time that is possible: of a trunk that does not stand yet, or not for long
        // enough, as if it were up.
        let time = self.stands_at.unwrap_or(last_at) - lies_at;
        if !self.is_up && time <= within {
            return Finding::unobserved(WITHIN_NOT_OVER);
        }
        let comparison = Limits::at_most(seconds(within)).compare(seconds(time), seconds(time));
        let detail = match self.stands_at {
            Some(_) => format!("lies from {lies_at} on"),
            None => format!("lies from {lies_at} on, not up: {}", self.obstacle),
        };
        let finding = Finding::of(comparison, lies_at.checked_add(within), detail);
        finding.seen(Witness {
            at: self.stands_at,
            ..Witness::default()
        })
    }
}
