//! Drives over a step of the engine.
//!
//! A servo turns as it is told while it has the torque for it: at the hip the engine holds the rate, and the pulley is
//! simply where it will be; one that turns out to have given more than it has is used up from the next step on. One whose
//! torque is used up, and a motor that is given a voltage, has a torque that falls with the rate, τ₀ − c q̇ (thesis,
//! eq. 2.20), and a rotor. A rotor of inertia J that is driven for the time k is
//!
//! ```text
//! J (q̇⁺ − q̇) = k (τ₀ − c q̇⁺) − P    ⟺    P = d (q̇* − q̇⁺),   d = J + k c,   q̇* = (J q̇ + k τ₀)/d
//! ```
//!
//! with P the impulse that it gives on: a damper that drags the joint to q̇*, which the engine has and solves with all else,
//! however large the rotor is beside the leg. A cable sees the same as a rope that gives r²/d a unit of impulse. As for all
//! forces (`step.rs`), k is half this step and half the last: boards that cut a millisecond into 1 µs and 999 µs drive
//! neither half as if it were the other.

use serde::{Deserialize, Serialize};
use twinrig_actuator::{MotorLine, PositionServo};
use twinrig_legged::{Fitted, Motors, Servos};

/// A drive, and what it is told.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Drive {
    /// Where it is and how it turns \[rad\], \[rad/s\].
    pub(crate) angle: f64,
    pub(crate) rate: f64,
    /// What it is told: an angle, or a voltage and a bridge.
    pub(crate) told: [f64; 2],
    /// Which way a servo pushes whose torque is used up: −1, 0 or 1.
    pub(crate) saturated: f64,
    /// Torque, mean over the last step \[N·m\].
    pub(crate) torque: f64,
}

/// A step in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pace {
    /// For which positions move on \[s\].
    pub(crate) seconds: f64,
    /// For which velocities are driven: from the middle of the last step to the middle of this one \[s\].
    pub(crate) kick: f64,
    /// In which errors of positions are taken back: the step, or what is left of the length of a longer one before \[s\].
    pub(crate) whole: f64,
}

/// What a drive does in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Effort {
    /// It turns at this mean rate, to have this rate in the end; its rotor takes so much of its torque.
    Follows { mean: f64, last: f64, rotor: f64 },
    /// It drags towards a rate with an impulse for the difference, \[N·m·s\] for a rad/s.
    Drags { drag: f64, towards: f64 },
}

/// A kind of drive.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind<'a> {
    Servo(&'a PositionServo),
    Motor(&'a twinrig_actuator::DcMotor),
}

/// Hip and knee.
pub(crate) fn kinds(drives: &Fitted) -> [Kind<'_>; 2] {
    match drives {
        Fitted::Servos(Servos { hip, knee }) => [Kind::Servo(hip), Kind::Servo(knee)],
        Fitted::Motors(Motors { hip, knee }) => [Kind::Motor(hip), Kind::Motor(knee)],
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
    /// What it does over a step.
    pub(crate) fn effort(&self, kind: Kind<'_>, pace: Pace) -> Effort {
        match kind {
            Kind::Servo(servo) if self.saturated == 0.0 => {
                let last = servo.rate_after(pace.seconds, self.told[0], self.angle, self.rate);
                Effort::Follows {
                    mean: 0.5 * (self.rate + last),
                    last,
                    rotor: servo.inertia() * (last - self.rate) / pace.kick,
                }
            }
            Kind::Servo(servo) => {
                let line = saturated_line(servo, self.saturated, self.rate);
                self.drags(servo.inertia(), line, pace)
            }
            Kind::Motor(motor) => {
                let line = motor.line(self.told[0], self.told[1]);
                self.drags(motor.inertia(), line, pace)
            }
        }
    }

    fn drags(&self, inertia: f64, line: MotorLine, pace: Pace) -> Effort {
        let drag = inertia + pace.kick * line.damping;
        Effort::Drags {
            drag,
            towards: (inertia * self.rate + pace.kick * line.torque) / drag,
        }
    }

    /// Takes the end of the step: where it is now, how fast it turned if it was free to, and what it gave on.
    pub(crate) fn finish(
        &mut self,
        kind: Kind<'_>,
        effort: Effort,
        angle: f64,
        given: f64,
        pace: Pace,
    ) {
        let before = *self;
        let mean = (angle - self.angle) / pace.seconds;
        self.angle = angle;
        match effort {
            Effort::Follows { last, rotor, .. } => {
                self.rate = last;
                self.torque = given + rotor;
                if let Kind::Servo(servo) = kind {
                    let way = self.torque.signum();
                    let most = saturated_line(servo, way, before.rate).torque_at(before.rate);
                    if self.torque.abs() > most.abs() {
                        self.saturated = way;
                    }
                }
            }
            Effort::Drags { .. } => {
                self.rate = mean;
                self.torque = given + kind.inertia() * (self.rate - before.rate) / pace.kick;
                if let Kind::Servo(servo) = kind {
                    let wanted =
                        servo.rate_after(pace.seconds, self.told[0], before.angle, before.rate);
                    // It would give more than is wanted.
                    if (self.rate - wanted) * self.saturated > 0.0 {
                        self.saturated = 0.0;
                    }
                }
            }
        }
    }
}

/// The torque–speed line of a servo that is used up, with its clamp.
pub(crate) fn saturated_line(servo: &PositionServo, way: f64, rate: f64) -> MotorLine {
    let along = way * rate;
    if along < 0.0 || servo.torque().is_infinite() {
        return MotorLine {
            torque: way * servo.torque(),
            damping: 0.0,
        };
    }
    if along > servo.speed() {
        return MotorLine::default();
    }
    MotorLine {
        torque: way * servo.torque(),
        damping: servo.torque() / servo.speed(),
    }
}
