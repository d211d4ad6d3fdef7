//! Drives over a step of the engine.
//!
//! A servo follows its command while its torque suffices: at the hip the engine prescribes the
//! rate, and the angle of the pulley is computed directly. A servo whose computed torque exceeds
//! its limit saturates from the next step on. A saturated servo, and a motor with a voltage, have a
//! torque that falls with the rate, τ₀ − c q̇ (thesis, eq. 2.20), and a rotor. For a rotor of
//! inertia J that is driven for the time k
//!
//! ```text
//! J (q̇⁺ − q̇) = k (τ₀ − c q̇⁺) − P    ⟺    P = d (q̇* − q̇⁺),   d = J + k c,   q̇* = (J q̇ + k
//! τ₀)/d
//! ```
//!
//! with P the impulse transmitted to the joint: a damper towards q̇*, which the engine solves
//! together with all other constraints, whatever the ratio of the inertias of rotor and leg. For a
//! cable this is a rope whose rate yields by r²/d per unit of impulse. As for all forces
//! (`step.rs`), k is the mean of this step and the last: where boards divide a millisecond into 1
//! µs and 999 µs, neither part is driven with the length of the other.

use serde::{Deserialize, Serialize};
use twinrig_actuator::{MotorLine, PositionServo};
use twinrig_legged::{DriveModels, Motors, Servos};

/// State and command of a drive.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Drive {
    /// Angle and rate \[rad\], \[rad/s\].
    pub(crate) angle: f64,
    pub(crate) rate: f64,
    /// Command: an angle, or a voltage and the state of the bridge.
    pub(crate) command: [f64; 2],
    /// Direction of the torque of a saturated servo, −1 or 1; 0 if not saturated.
    pub(crate) saturated: f64,
    /// Torque, mean over the last step \[N·m\].
    pub(crate) torque: f64,
}

/// Time intervals of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepTiming {
    /// Interval of the positions \[s\].
    pub(crate) seconds: f64,
    /// Interval of forces on velocities: from the middle of the last step to the middle of this one
    /// \[s\].
    pub(crate) force_seconds: f64,
    /// Interval in which position errors are corrected: the step, or the remainder of a longer one
    /// before \[s\].
    pub(crate) correction_seconds: f64,
}

/// Action of a drive in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Effort {
    /// Prescribed rate: mean over the step and at its end, with the torque that the rotor takes.
    Rate { mean: f64, last: f64, rotor: f64 },
    /// Damper of this coefficient \[N·m·s per rad/s\] towards a target rate.
    Damper { coefficient: f64, target: f64 },
}

/// A drive's kind with its parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind<'a> {
    Servo(&'a PositionServo),
    Motor(&'a twinrig_actuator::LegMotor),
}

/// Returns the kinds of hip and knee drive.
pub(crate) fn kinds(drives: &DriveModels) -> [Kind<'_>; 2] {
    match drives {
        DriveModels::Servos(Servos { hip, knee }) => [Kind::Servo(hip), Kind::Servo(knee)],
        DriveModels::Motors(Motors { hip, knee, .. }) => [Kind::Motor(hip), Kind::Motor(knee)],
    }
}

impl Kind<'_> {
    pub(crate) fn inertia(self) -> f64 {
        match self {
            Self::Servo(servo) => servo.inertia(),
            Self::Motor(motor) => motor.inertia(),
        }
    }
}

impl Drive {
    /// Returns the action over a step.
    pub(crate) fn effort(&self, kind: Kind<'_>, timing: StepTiming) -> Effort {
        match kind {
            Kind::Servo(servo) if self.saturated == 0.0 => {
                let last = servo.rate_after(timing.seconds, self.command[0], self.angle, self.rate);
                Effort::Rate {
                    mean: 0.5 * (self.rate + last),
                    last,
                    rotor: servo.inertia() * (last - self.rate) / timing.force_seconds,
                }
            }
            Kind::Servo(servo) => {
                let line = saturated_line(servo, self.saturated, self.rate);
                self.damper(servo.inertia(), line, timing)
            }
            Kind::Motor(motor) => {
                let line = motor.line(self.command[0], self.command[1]);
                self.damper(motor.inertia(), line, timing)
            }
        }
    }

    fn damper(&self, inertia: f64, line: MotorLine, timing: StepTiming) -> Effort {
        let coefficient = inertia + timing.force_seconds * line.damping;
        Effort::Damper {
            coefficient,
            target: (inertia * self.rate + timing.force_seconds * line.torque) / coefficient,
        }
    }

    /// Applies the end of the step: the new angle, and the torque delivered to the joint. The rate
    /// follows from the action.
    pub(crate) fn finish(
        &mut self,
        kind: Kind<'_>,
        effort: Effort,
        angle: f64,
        delivered: f64,
        timing: StepTiming,
    ) {
        let before = *self;
        let mean = (angle - self.angle) / timing.seconds;
        self.angle = angle;
        match effort {
            Effort::Rate { last, rotor, .. } => {
                self.rate = last;
                self.torque = delivered + rotor;
                if let Kind::Servo(servo) = kind {
                    let sign = self.torque.signum();
                    let limit = saturated_line(servo, sign, before.rate).torque_at(before.rate);
                    if self.torque.abs() > limit.abs() {
                        self.saturated = sign;
                    }
                }
            }
            Effort::Damper { .. } => {
                self.rate = mean;
                self.torque =
                    delivered + kind.inertia() * (self.rate - before.rate) / timing.force_seconds;
                if let Kind::Servo(servo) = kind {
                    let requested = servo.rate_after(
                        timing.seconds,
                        self.command[0],
                        before.angle,
                        before.rate,
                    );
                    // The saturated torque would exceed the requested one.
                    if (self.rate - requested) * self.saturated > 0.0 {
                        self.saturated = 0.0;
                    }
                }
            }
        }
    }
}

/// Returns the torque–speed line of a saturated servo, with its clamp.
pub(crate) fn saturated_line(servo: &PositionServo, sign: f64, rate: f64) -> MotorLine {
    let along = sign * rate;
    if along < 0.0 || servo.torque().is_infinite() {
        return MotorLine {
            torque: sign * servo.torque(),
            damping: 0.0,
        };
    }
    if along > servo.speed() {
        return MotorLine::default();
    }
    MotorLine {
        torque: sign * servo.torque(),
        damping: servo.torque() / servo.speed(),
    }
}
