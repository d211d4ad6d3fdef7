//! Servos whose torque is used up, and servos that have some to spare again.

use twinrig_legged::Fitted;

use crate::drives::greatest;
use crate::flow::Flow;
use crate::real::{Lanes, Real};

/// What the two motors of each leg do: hip, then pulley.
pub(crate) struct Effort {
    /// Torque that each gives \[N·m\].
    pub(crate) torques: [Lanes; 2],
    /// The acceleration that each gives its joint, and the one it would want to \[rad/s²\].
    pub(crate) given: [Lanes; 2],
    pub(crate) wanted: [Lanes; 2],
    /// The rates that go with the torques \[rad/s\].
    pub(crate) rates: [Lanes; 2],
}

impl<const N: usize> Flow<N> {
    /// Notes which servos are used up by this effort; says whether that is news.
    pub(crate) fn saturate(&mut self, effort: &Effort) -> bool {
        let Some(Fitted::Servos(servos)) = self.model.drives else {
            return false;
        };
        let commands = &mut self.mode.commands;
        let saturated = [&mut commands.hip_saturated, &mut commands.pulley_saturated];
        let mut news = false;
        for (drive, (servo, saturated)) in servos.both().into_iter().zip(saturated).enumerate() {
            if servo.torque().is_infinite() {
                continue;
            }
            for leg in 0..self.model.legs.len() {
                let of = |lanes: &[Lanes; 2]| lanes[drive].lane(leg);
                let now = saturated.lane(leg);
                let next = if now == 0.0 {
                    let torque = of(&effort.torques);
                    let way = torque.signum();
                    let most = greatest(servo, way, of(&effort.rates)).abs();
                    if torque.abs() > most { way } else { 0.0 }
                } else if (of(&effort.given) - of(&effort.wanted)) * now > 0.0 {
                    // It would give more than is wanted.
                    0.0
                } else {
                    now
                };
                if next != now {
                    news = true;
                    *saturated = saturated.with_lane(leg, next);
                }
            }
        }
        if news {
            let saturated = commands.hip_saturated * commands.hip_saturated;
            self.mode.active.hip = Lanes::splat(1.0) - saturated;
            self.mode.recount();
        }
        news
    }
}
