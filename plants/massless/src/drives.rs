//! The drives in one step: the rates they want, and what their torque leaves of them. Hips without drives turn freely.

use twinrig_legged::LEGS;

use crate::constraints::Constraints;
use crate::midpoint::Midpoint;
use crate::mobility::{Mobility, Motion};
use crate::model::Model;
use crate::state::State;

/// What hip and pulley of each leg are told \[rad\].
pub(crate) type Commands = [[f64; 2]; LEGS];

/// Whether a drive has torque to spare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Limit {
    /// It has the rate it wants.
    Within,
    /// It pushes forwards with all it has.
    Upper,
    /// It pushes backwards with all it has.
    Lower,
}

/// Hip and pulley drives of all legs during a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DriveStep {
    /// Rates before the step, and those wanted at its end.
    before: [[f64; 2]; LEGS],
    wanted: [[f64; 2]; LEGS],
    limits: [[Limit; 2]; LEGS],
    /// Mean torques over the step.
    pub(crate) torques: [[f64; 2]; LEGS],
    seconds: f64,
}

impl DriveStep {
    pub(crate) fn new(model: &Model, state: &State, commands: &Commands, seconds: f64) -> Self {
        let mut step = Self {
            before: [[0.0; 2]; LEGS],
            wanted: [[0.0; 2]; LEGS],
            limits: [[Limit::Within; 2]; LEGS],
            torques: [[0.0; 2]; LEGS],
            seconds,
        };
        let Some(servos) = &model.servos else {
            return step;
        };
        for (i, leg) in model.legs.iter().enumerate() {
            let [hip, pulley] = commands[i];
            let [hip_rate, pulley_rate] = [state.hip_rate(i), state.pulley_rate(i)];
            let absolute = hip + leg.pantograph.hip_reference();
            step.before[i] = [hip_rate, pulley_rate];
            step.wanted[i] = [
                servos
                    .hip
                    .rate_after(seconds, absolute, state.hip(i), hip_rate),
                servos
                    .knee
                    .rate_after(seconds, pulley, state.pulley(i), pulley_rate),
            ];
        }
        step
    }

    /// Gives each drive its acceleration: the one it wants, or what its greatest torque leaves. A hip without a drive gets
    /// what springs and friction give it.
    pub(crate) fn impose(
        &self,
        model: &Model,
        middle: &Midpoint,
        mobility: &mut Mobility,
        motion: &mut Motion,
    ) {
        let Some(servos) = &model.servos else {
            for (i, leg) in middle.legs.iter().enumerate() {
                let [inertia, _] = model.turning(i);
                mobility.drive[i][0] = 1.0 / inertia;
                motion.drive[i][0] = leg.load(0) / inertia;
            }
            return;
        };
        for (i, leg) in middle.legs.iter().enumerate() {
            for (drive, servo) in servos.both().into_iter().enumerate() {
                let torque = match self.limits[i][drive] {
                    Limit::Within => {
                        mobility.drive[i][drive] = 0.0;
                        motion.drive[i][drive] =
                            (self.wanted[i][drive] - self.before[i][drive]) / self.seconds;
                        continue;
                    }
                    Limit::Upper => servo.torque(),
                    Limit::Lower => -servo.torque(),
                };
                mobility.drive[i][drive] = 1.0 / servo.inertia();
                motion.drive[i][drive] = (torque + leg.load(drive)) / servo.inertia();
            }
        }
    }

    /// Finds the torque each drive needs for a motion; says whether one is used up, or has some to spare again.
    pub(crate) fn exhausted(
        &mut self,
        model: &Model,
        middle: &Midpoint,
        constraints: &Constraints,
        motion: &Motion,
    ) -> bool {
        let Some(servos) = &model.servos else {
            return false;
        };
        let mut changed = false;
        for (i, leg) in middle.legs.iter().enumerate() {
            for (drive, servo) in servos.both().into_iter().enumerate() {
                let acceleration = motion.drive[i][drive];
                let held = constraints.on_drive(i, drive) / self.seconds;
                let torque = servo.inertia() * acceleration - leg.load(drive) - held;
                self.torques[i][drive] = torque;
                let reached = self.before[i][drive] + self.seconds * acceleration;
                let wanted = self.wanted[i][drive];
                let next = match self.limits[i][drive] {
                    Limit::Within if torque > servo.torque() => Limit::Upper,
                    Limit::Within if torque < -servo.torque() => Limit::Lower,
                    Limit::Upper if reached > wanted => Limit::Within,
                    Limit::Lower if reached < wanted => Limit::Within,
                    same => same,
                };
                changed |= next != self.limits[i][drive];
                self.limits[i][drive] = next;
            }
        }
        changed
    }
}
