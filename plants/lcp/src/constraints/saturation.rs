//! Saturation of servos.

use twinrig_legged::DriveModels;

use super::mode::Mode;
use crate::model::Model;
use crate::model::drives::saturation_torque;
use crate::model::real::{Lanes, Real};

/// Action of the two motors of each leg: hip, then pulley.
pub(crate) struct Effort {
    /// Motor torques \[N·m\].
    pub(crate) torques: [Lanes; 2],
    /// Actual and commanded accelerations of the joints \[rad/s²\].
    pub(crate) actual: [Lanes; 2],
    pub(crate) commanded: [Lanes; 2],
    /// Rates at these torques \[rad/s\].
    pub(crate) rates: [Lanes; 2],
}

impl Mode {
    /// Updates the saturation of the servos for this effort; returns whether it changed.
    pub(crate) fn saturate<const N: usize>(&mut self, model: &Model<N>, effort: &Effort) -> bool {
        let Some(DriveModels::Servos(servos)) = model.drives else {
            return false;
        };
        let commands = &mut self.commands;
        let saturated = [&mut commands.hip_saturated, &mut commands.pulley_saturated];
        let mut changed = false;
        for (drive, (servo, saturated)) in servos.both().into_iter().zip(saturated).enumerate() {
            if servo.torque().is_infinite() {
                continue;
            }
            for leg in 0..model.legs.len() {
                let of = |lanes: &[Lanes; 2]| lanes[drive].lane(leg);
                let now = saturated.lane(leg);
                let next = if now == 0.0 {
                    let torque = of(&effort.torques);
                    let direction = torque.signum();
                    let most = saturation_torque(servo, direction, of(&effort.rates)).abs();
                    if torque.abs() > most { direction } else { 0.0 }
                } else if (of(&effort.actual) - of(&effort.commanded)) * now > 0.0 {
                    // The saturated torque exceeds the command.
                    0.0
                } else {
                    now
                };
                if next != now {
                    changed = true;
                    *saturated = saturated.with_lane(leg, next);
                }
            }
        }
        if changed {
            let saturated = commands.hip_saturated * commands.hip_saturated;
            self.active.hip = Lanes::splat(1.0) - saturated;
            self.update_any();
        }
        changed
    }
}
