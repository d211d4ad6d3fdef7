//! The drives in one step: the rates that servos want and what their torque leaves of them; the torque of motors. Hips
//! without drives turn freely.

use twinrig_actuator::MotorLine;
use twinrig_legged::{Fitted, LEGS, Motors, Servos};

use crate::constraints::Constraints;
use crate::midpoint::Midpoint;
use crate::mobility::{Mobility, Motion};
use crate::model::Model;
use crate::state::State;

/// What the drives of each leg are given, in the order of the ports: hip and pulley of servos \[rad\], or voltage \[V\] and
/// bridge of the hip's motor and of the pulley's.
pub(crate) type Inputs = [[f64; 4]; LEGS];

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
    /// What motors do under their voltages.
    lines: [[MotorLine; 2]; LEGS],
    /// Mean torques over the step.
    pub(crate) torques: [[f64; 2]; LEGS],
    seconds: f64,
}

impl DriveStep {
    pub(crate) fn new(model: &Model, state: &State, inputs: &Inputs, seconds: f64) -> Self {
        let mut step = Self {
            before: [[0.0; 2]; LEGS],
            wanted: [[0.0; 2]; LEGS],
            limits: [[Limit::Within; 2]; LEGS],
            lines: [[MotorLine::default(); 2]; LEGS],
            torques: [[0.0; 2]; LEGS],
            seconds,
        };
        for (i, leg) in model.legs.iter().enumerate() {
            let [hip_rate, pulley_rate] = [state.hip_rate(i), state.pulley_rate(i)];
            match &model.drives {
                None => return step,
                Some(Fitted::Servos(servos)) => {
                    let [hip, pulley, ..] = inputs[i];
                    let absolute = hip + leg.pantograph.hip_reference();
                    step.wanted[i] = [
                        servos
                            .hip
                            .rate_after(seconds, absolute, state.hip(i), hip_rate),
                        servos
                            .knee
                            .rate_after(seconds, pulley, state.pulley(i), pulley_rate),
                    ];
                }
                Some(Fitted::Motors(motors)) => {
                    let [hip, at_hip, pulley, at_pulley] = inputs[i];
                    step.lines[i] = [
                        motors.hip.line(hip, at_hip),
                        motors.knee.line(pulley, at_pulley),
                    ];
                }
            }
            step.before[i] = [hip_rate, pulley_rate];
        }
        step
    }

    /// Gives each drive its acceleration: the one a servo wants, or what its greatest torque leaves; the one that a motor's
    /// voltage makes. A hip without a drive gets what springs and friction give it.
    pub(crate) fn impose(
        &self,
        model: &Model,
        middle: &Midpoint,
        mobility: &mut Mobility,
        motion: &mut Motion,
    ) {
        match &model.drives {
            Some(Fitted::Servos(servos)) => self.serve(servos, middle, mobility, motion),
            Some(Fitted::Motors(motors)) => self.run(motors, middle, mobility, motion),
            None => {
                for (i, leg) in middle.legs.iter().enumerate() {
                    let [inertia, _] = model.turning(i);
                    mobility.drive[i][0] = 1.0 / inertia;
                    motion.drive[i][0] = leg.load(0) / inertia;
                }
            }
        }
    }

    fn serve(
        &self,
        servos: &Servos,
        middle: &Midpoint,
        mobility: &mut Mobility,
        motion: &mut Motion,
    ) {
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

    /// A motor's mean torque is the one at its mean rate, τ₀ − c(ω + ½ h a): what damps it stands beside its inertia, and
    /// steps far beyond its time constant are stable.
    fn run(
        &self,
        motors: &Motors,
        middle: &Midpoint,
        mobility: &mut Mobility,
        motion: &mut Motion,
    ) {
        for (i, leg) in middle.legs.iter().enumerate() {
            for (drive, motor) in motors.both().into_iter().enumerate() {
                let line = self.lines[i][drive];
                let ahead = motor.inertia() + 0.5 * self.seconds * line.damping;
                let torque = line.torque_at(self.before[i][drive]);
                mobility.drive[i][drive] = 1.0 / ahead;
                motion.drive[i][drive] = (torque + leg.load(drive)) / ahead;
            }
        }
    }

    /// Finds the torque each drive needs for a motion; says whether that of a servo is used up, or has some to spare again.
    pub(crate) fn exhausted(
        &mut self,
        model: &Model,
        middle: &Midpoint,
        constraints: &Constraints,
        motion: &Motion,
    ) -> bool {
        let Some(drives) = &model.drives else {
            return false;
        };
        let mut changed = false;
        for (i, leg) in middle.legs.iter().enumerate() {
            for (drive, inertia) in drives.inertias().into_iter().enumerate() {
                let acceleration = motion.drive[i][drive];
                let held = constraints.on_drive(i, drive) / self.seconds;
                let torque = inertia * acceleration - leg.load(drive) - held;
                self.torques[i][drive] = torque;
                let Fitted::Servos(servos) = drives else {
                    continue;
                };
                let servo = servos.both()[drive];
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
