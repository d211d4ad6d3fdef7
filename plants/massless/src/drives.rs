//! Drives in one step: target rates of servos within their torque limits, torques of motors. Hips
//! without drives turn freely.

use twinrig_actuator::MotorLine;
use twinrig_legged::{DriveModels, LEGS, Motors, Servos};

use crate::constraints::Constraints;
use crate::midpoint::Midpoint;
use crate::mobility::Mobility;
use crate::model::Model;
use crate::motion::Motion;
use crate::state::State;

/// Inputs of the drives of each leg, in the order of the ports: hip and pulley of servos \[rad\],
/// or voltage \[V\] and bridge of the hip's motor and of the pulley's.
pub(crate) type Inputs = [[f64; 4]; LEGS];

/// State of a drive relative to its torque limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Limit {
    /// Below its torque limit: it attains its target rate.
    Within,
    /// At its greatest positive torque.
    Upper,
    /// At its greatest negative torque.
    Lower,
}

/// Hip and pulley drives of all legs during a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DriveStep {
    /// Rates before the step, and target rates at its end \[rad/s\].
    before: [[f64; 2]; LEGS],
    target: [[f64; 2]; LEGS],
    limits: [[Limit; 2]; LEGS],
    /// Torque-rate lines of the motors at their voltages.
    lines: [[MotorLine; 2]; LEGS],
    /// Mean torques over the step \[N·m\].
    pub(crate) torques: [[f64; 2]; LEGS],
    seconds: f64,
}

impl DriveStep {
    pub(crate) fn new(model: &Model, state: &State, inputs: &Inputs, seconds: f64) -> Self {
        let mut step = Self {
            before: [[0.0; 2]; LEGS],
            target: [[0.0; 2]; LEGS],
            limits: [[Limit::Within; 2]; LEGS],
            lines: [[MotorLine::default(); 2]; LEGS],
            torques: [[0.0; 2]; LEGS],
            seconds,
        };
        for (i, leg) in model.legs.iter().enumerate() {
            let [hip_rate, pulley_rate] = [state.hip_rate(i), state.pulley_rate(i)];
            match &model.drives {
                None => return step,
                Some(DriveModels::Servos(servos)) => {
                    let [hip, pulley, ..] = inputs[i];
                    let absolute = hip + leg.pantograph.hip_reference();
                    step.target[i] = [
                        servos
                            .hip
                            .rate_after(seconds, absolute, state.hip(i), hip_rate),
                        servos
                            .knee
                            .rate_after(seconds, pulley, state.pulley(i), pulley_rate),
                    ];
                }
                Some(DriveModels::Motors(motors)) => {
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

    /// Sets the acceleration of each drive: of a servo, that which attains its target rate, or that
    /// of its greatest torque; of a motor, that of its voltage; of a hip without a drive, that of
    /// springs and friction.
    pub(crate) fn impose(
        &self,
        model: &Model,
        middle: &Midpoint,
        mobility: &mut Mobility,
        motion: &mut Motion,
    ) {
        match &model.drives {
            Some(DriveModels::Servos(servos)) => {
                self.impose_servos(servos, middle, mobility, motion);
            }
            Some(DriveModels::Motors(motors)) => {
                self.impose_motors(motors, middle, mobility, motion);
            }
            None => {
                for (i, leg) in middle.legs.iter().enumerate() {
                    let [inertia, _] = model.drive_inertias(i);
                    mobility.drive[i][0] = 1.0 / inertia;
                    motion.drive[i][0] = leg.load(0) / inertia;
                }
            }
        }
    }

    fn impose_servos(
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
                            (self.target[i][drive] - self.before[i][drive]) / self.seconds;
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

    /// The mean torque of a motor is the one at its mean rate, τ₀ − c(ω + ½ h a): its damping is
    /// added to its inertia, so steps far longer than its time constant are stable.
    fn impose_motors(
        &self,
        motors: &Motors,
        middle: &Midpoint,
        mobility: &mut Mobility,
        motion: &mut Motion,
    ) {
        for (i, leg) in middle.legs.iter().enumerate() {
            for (drive, motor) in motors.both().into_iter().enumerate() {
                let line = self.lines[i][drive];
                let effective_inertia = motor.inertia() + 0.5 * self.seconds * line.damping;
                let torque = line.torque_at(self.before[i][drive]);
                mobility.drive[i][drive] = 1.0 / effective_inertia;
                motion.drive[i][drive] = (torque + leg.load(drive)) / effective_inertia;
            }
        }
    }

    /// Computes the torque that each drive needs for a motion; returns whether a servo has reached
    /// or left its torque limit.
    pub(crate) fn update_limits(
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
                let constraint_torque = constraints.drive_impulse(i, drive) / self.seconds;
                let torque = inertia * acceleration - leg.load(drive) - constraint_torque;
                self.torques[i][drive] = torque;
                let DriveModels::Servos(servos) = drives else {
                    continue;
                };
                let servo = servos.both()[drive];
                let reached = self.before[i][drive] + self.seconds * acceleration;
                let target = self.target[i][drive];
                let next = match self.limits[i][drive] {
                    Limit::Within if torque > servo.torque() => Limit::Upper,
                    Limit::Within if torque < -servo.torque() => Limit::Lower,
                    Limit::Upper if reached > target => Limit::Within,
                    Limit::Lower if reached < target => Limit::Within,
                    same => same,
                };
                changed |= next != self.limits[i][drive];
                self.limits[i][drive] = next;
            }
        }
        changed
    }
}
