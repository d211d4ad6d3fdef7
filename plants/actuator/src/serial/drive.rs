//! A serial servo as the drive of a joint.
//!
//! A plant gets a torque–rate line for each of its steps, of a length h at most, which is made of
//! the angle q and the rate ω₀ of the joint at the start of the step:
//!
//! ```text
//! τ(ω) = τ_m + τ_m' (ω − ω₀) − K_v ω − k (z + ½ h ω₀) − c ω
//! ```
//!
//! `τ_m` is the torque of the motor under its duty cycle. Friction is a bristle of the deflection
//! z: it turns with the joint up to its limits, ±T/k, where the joint slides under the friction T
//! of that direction, and holds the joint anywhere between. Its stiffness k is κ J/h² with the
//! inertia J of the motor, its damping c is ζ J/h and vanishes while the joint slides: they are
//! stable for the motor alone, and so for a motor with a load. The deflection T h²/κJ is that of
//! a joint at rest; it vanishes with the square of h, and is large where a motor is light.
//!
//! T depends on the torque x that the gear transmits to the joint, the inertia of the load
//! included; −x is the torque of the load in [`Friction`]. x is known of the last step: the mean
//! torque of the line less that which accelerated the motor. Since more friction lets less torque
//! through, a share 1/(1 + T') of each change of x is taken over in a step, with the derivative T'
//! of the friction by x.

use serde::{Deserialize, Serialize};
use twinrig_robot::serial::{Friction, Gear, SerialServo};

use super::{Bridge, Electric, Winding};
use crate::MotorLine;

/// κ: the bristle and the motor alone oscillate with a period of 14 steps.
const STIFFNESS: f64 = 0.2;
/// ζ: a third of critical damping.
const DAMPING: f64 = 0.3;

/// Serial servo at the joint of a plant.
#[derive(Clone, Debug)]
pub struct SerialDrive {
    winding: Winding,
    friction: Friction,
    gear: Gear,
    inertia: f64,
    /// Greatest length of a step \[s\].
    step: f64,
    state: SerialDriveState,
}

/// State of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SerialDriveState {
    /// Command of the bridge.
    pub bridge: Bridge,
    /// Rise of the temperature of the winding \[K\].
    rise: f64,
    /// Deflection of the bristle \[rad\].
    deflection: f64,
    /// Torque that the gear transmits \[N·m\].
    transmitted: f64,
    /// Start of the last step, if there was one.
    last: Option<StepStart>,
}

/// Start of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct StepStart {
    /// Angle \[rad\] and rate \[rad/s\].
    motion: [f64; 2],
    /// Torque–rate line in the step: torque at rest, and damping.
    line: [f64; 2],
    /// Length of the step \[s\].
    seconds: f64,
}

impl SerialDriveState {
    const AT_REST: Self = Self {
        bridge: Bridge::Open,
        rise: 0.0,
        deflection: 0.0,
        transmitted: 0.0,
        last: None,
    };
}

impl SerialDrive {
    /// Creates the drive with an open bridge and a cold winding, for steps of at most `step`
    /// seconds.
    pub fn new(servo: &SerialServo, step: f64) -> Self {
        Self {
            winding: Winding::new(&servo.motor, &servo.supply),
            friction: servo.friction,
            gear: servo.gear,
            inertia: servo.motor.inertia,
            step,
            state: SerialDriveState::AT_REST,
        }
    }

    /// Opens the bridge, and forgets the motion and the heat of the winding.
    pub fn restart(&mut self) {
        self.state = SerialDriveState::AT_REST;
    }

    /// Returns the state.
    pub fn state(&self) -> SerialDriveState {
        self.state
    }

    /// Restores a state.
    pub fn restore(&mut self, state: SerialDriveState) {
        self.state = state;
    }

    /// Sets the command of the bridge.
    pub fn set_bridge(&mut self, bridge: Bridge) {
        self.state.bridge = bridge;
    }

    /// Returns voltage, current and torque of the motor at a rate of the joint \[rad/s\].
    pub fn electric(&self, rate: f64) -> Electric {
        self.winding
            .electric(self.state.bridge, rate, self.state.rise)
    }

    /// Starts a step of a length \[s\] at an angle \[rad\] and a rate \[rad/s\] of the joint, and
    /// returns the torque of the drive in it, the acceleration of its inertia included.
    pub fn start_step(&mut self, [angle, rate]: [f64; 2], seconds: f64) -> MotorLine {
        self.end_step([angle, rate]);
        let state = &mut self.state;
        let electric = self.winding.electric(state.bridge, rate, state.rise);
        let (motor, current) = (electric.torque, electric.current);
        let damping = match state.bridge {
            Bridge::Open => 0.0,
            Bridge::Duty(duty) => self.winding.damping(duty, current, state.rise),
        };
        state.rise = self.winding.warmed(state.rise, current, seconds);
        let stiffness = STIFFNESS * self.inertia / (self.step * self.step);
        let [most, least] = [1.0, -1.0].map(|direction| {
            let friction = self.sliding([rate, motor], direction);
            direction * friction / stiffness
        });
        let state = &mut self.state;
        // Unlike `clamp`, also of a motion that is not a number, which the plant reports.
        state.deflection = state.deflection.max(least).min(most);
        // In the middle of the step.
        let deflection = state.deflection + 0.5 * seconds * rate;
        let (held, bristle) = if deflection > most {
            (most, 0.0)
        } else if deflection < least {
            (least, 0.0)
        } else {
            (deflection, DAMPING * self.inertia / self.step)
        };
        let line = MotorLine {
            torque: motor + damping * rate - stiffness * held,
            damping: damping + self.friction.viscous + bristle,
        };
        self.state.last = Some(StepStart {
            motion: [angle, rate],
            line: [line.torque, line.damping],
            seconds,
        });
        line
    }

    /// Ends the last step in a motion: turns the bristle, and follows the transmitted torque.
    fn end_step(&mut self, [angle, rate]: [f64; 2]) {
        let Some(last) = self.state.last.take() else {
            return;
        };
        let gain = self.gain(rate);
        let state = &mut self.state;
        let [angle_before, rate_before] = last.motion;
        let [torque, damping] = last.line;
        let turned = angle - angle_before;
        state.deflection += turned;
        let accelerating = self.inertia * (rate - rate_before);
        let transmitted = torque - (damping * turned + accelerating) / last.seconds;
        let followed = (last.seconds / self.step).min(1.0) / (1.0 + gain);
        state.transmitted += followed * (transmitted - state.transmitted);
    }

    /// Returns the friction, but for the viscous one, on a joint that slides in a direction, 1 or
    /// −1, or is about to, at a rate and a torque of the motor \[N·m\].
    fn sliding(&self, [rate, motor]: [f64; 2], direction: f64) -> f64 {
        let transmitted = self.state.transmitted;
        let viscous = self.friction.viscous * rate.abs();
        let simple = self.friction.torque(rate, motor, -transmitted) - viscous;
        if !self.gear.is_lossy() {
            return simple;
        }
        let driving = transmitted * direction;
        let share = if driving < 0.0 {
            self.gear.driven_share(rate)
        } else {
            self.gear.driving_share(rate) + self.gear.driving_square * driving
        };
        simple + share * driving.abs()
    }

    /// Returns the greatest derivative of the friction by the transmitted torque at a rate.
    fn gain(&self, rate: f64) -> f64 {
        let (friction, gear) = (&self.friction, &self.gear);
        let twice = 2.0 * self.state.transmitted.abs();
        let of_gear = if gear.is_lossy() {
            let driving = gear.driving_share(rate) + gear.driving_square * twice;
            driving.max(gear.driven_share(rate))
        } else {
            0.0
        };
        let of_load = friction.external_load + friction.external_load_square * twice;
        of_gear + of_load + friction.stribeck_external_load
    }
}

#[cfg(test)]
mod tests {
    use twinrig_robot::RobotFile;

    use super::*;

    #[test]
    fn motion_that_is_not_a_number_does_not_panic() {
        let cub = RobotFile::find("cheetah-cub-sts3215", "/".as_ref()).unwrap();
        let servo = cub.robot().unwrap().serial.unwrap();
        let mut drive = SerialDrive::new(&servo, 1e-3);
        drive.set_bridge(Bridge::Duty(0.5));
        for motion in [[0.0, 0.0], [0.1, f64::NAN], [f64::INFINITY, 1.0]] {
            drive.start_step(motion, 1e-3);
        }
        drive.restart();
        assert!(drive.start_step([0.0; 2], 1e-3).torque.is_finite());
    }
}
