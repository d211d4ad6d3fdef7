//! Serial servos of the legs: their firmware, and the drives that it commands.

use serde::{Deserialize, Serialize};
use twinrig_actuator::StepInputs;
use twinrig_actuator::serial::{
    Firmware, FirmwareState, SerialDrive, SerialDriveState, ServoCommand,
};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_robot::serial::SerialServo;

use crate::dynamics::Dynamics;
use crate::readings::Readings;

/// Servos of hip and knee of all legs. They work in steps of the period of their firmware, at the
/// same instants; a step of their drives is one of the plant.
#[derive(Debug, Clone)]
pub(crate) struct SerialServos {
    servos: Vec<Servo>,
    /// Commands in the order of the ports \[rad\].
    commands: Vec<f64>,
    /// Next step of the firmware.
    tick: SimTime,
    period: SimDuration,
    /// Torque–rate lines of the drives, and their rates of change, which are zero.
    lines: Vec<f64>,
    rates: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Servo {
    firmware: Firmware,
    drive: SerialDrive,
}

/// Serialised state.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct SavedServos {
    servos: Vec<(FirmwareState, SerialDriveState)>,
    commands: Vec<f64>,
    tick: SimTime,
}

/// Returns angle and rate of a drive.
fn motion<R: Readings + ?Sized>(readings: &R, drive: usize) -> [f64; 2] {
    let leg = drive / 2;
    if drive.is_multiple_of(2) {
        [readings.hip(leg), readings.hip_rate(leg)]
    } else {
        [readings.pulley(leg), readings.pulley_rate(leg)]
    }
}

impl SavedServos {
    /// Checks that the state is that of so many servos.
    ///
    /// # Errors
    /// Description of the state.
    pub(crate) fn check(&self, expected: usize) -> Result<(), String> {
        let found = self.servos.len();
        if found == expected && self.commands.len() == expected {
            Ok(())
        } else {
            Err(format!("{found} serial servos, expected {expected}"))
        }
    }
}

impl SerialServos {
    /// Note on servos that resume from a state.
    pub(crate) const RESTARTED: &str =
        "serial servos hold their positions, with cold windings and no commands under way";

    /// Returns the number of servos.
    pub(crate) fn count(&self) -> usize {
        self.servos.len()
    }

    /// Creates the servos of `legs` legs, which hold their positions; steps of the plant have at
    /// most the length `step`.
    pub(crate) fn new<R: Readings + ?Sized>(
        servo: &SerialServo,
        legs: usize,
        step: SimDuration,
        readings: &R,
    ) -> Self {
        let period = Firmware::new(&servo.controller, 0.0).period();
        let step = step.min(period).as_secs_f64();
        let drives = 2 * legs;
        // Not cloned, which would take the capacity of their queues.
        let each = (0..drives).map(|_| Servo {
            firmware: Firmware::new(&servo.controller, 0.0),
            drive: SerialDrive::new(servo, step),
        });
        let mut servos = Self {
            servos: each.collect(),
            commands: vec![0.0; drives],
            tick: SimTime::ZERO,
            period,
            lines: vec![0.0; 2 * drives],
            rates: vec![0.0; 2 * drives],
        };
        servos.restart(SimTime::ZERO, readings);
        servos
    }

    /// Lets the servos hold the present positions.
    pub(crate) fn restart<R: Readings + ?Sized>(&mut self, now: SimTime, readings: &R) {
        self.tick = now;
        for (drive, servo) in self.servos.iter_mut().enumerate() {
            let [angle, _] = motion(readings, drive);
            servo.firmware.restart(angle);
            servo.drive.restart();
            self.commands[drive] = angle;
        }
    }

    /// Writes the last commands.
    pub(crate) fn commands(&self, commands: &mut [f64]) {
        commands.copy_from_slice(&self.commands);
    }

    /// Accepts commands at `now`.
    pub(crate) fn command(&mut self, now: SimTime, commands: &[f64]) {
        let servos = self.servos.iter_mut().zip(&mut self.commands);
        for ((servo, last), command) in servos.zip(commands) {
            if command != last {
                *last = *command;
                let command = ServoCommand {
                    position: *command,
                    enabled: true,
                };
                servo.firmware.command(now, self.tick, command);
            }
        }
    }

    /// Returns the end of a step from `now`, at most `next`.
    pub(crate) fn step_end(&self, now: SimTime, next: SimTime) -> SimTime {
        if self.tick > now {
            next.min(self.tick)
        } else {
            next.min(now + self.period)
        }
    }

    /// Starts a step of the plant, with the inputs of its dynamics.
    pub(crate) fn start_step<D: Dynamics + ?Sized>(
        &mut self,
        now: SimTime,
        seconds: f64,
        dynamics: &mut D,
    ) {
        let is_tick = self.tick <= now;
        let lines = self.lines.chunks_exact_mut(2);
        for (drive, (servo, line)) in self.servos.iter_mut().zip(lines).enumerate() {
            let motion = motion(dynamics, drive);
            if is_tick {
                let bridge = servo.firmware.step(self.tick, motion[0]);
                servo.drive.set_bridge(bridge);
            }
            let started = servo.drive.start_step(motion, seconds);
            (line[0], line[1]) = (started.torque, started.damping);
        }
        if is_tick {
            self.tick = now + self.period;
        }
        dynamics.set_inputs(&StepInputs {
            start: &self.lines,
            rates: &self.rates,
            mean: &self.lines,
        });
    }

    pub(crate) fn save(&self) -> SavedServos {
        let servos = self.servos.iter();
        SavedServos {
            servos: servos
                .map(|servo| (servo.firmware.state.clone(), servo.drive.state()))
                .collect(),
            commands: self.commands.clone(),
            tick: self.tick,
        }
    }

    /// Restores a state of as many servos.
    pub(crate) fn restore(&mut self, saved: SavedServos) {
        for (servo, (firmware, drive)) in self.servos.iter_mut().zip(saved.servos) {
            servo.firmware.state = firmware;
            servo.drive.restore(drive);
        }
        (self.commands, self.tick) = (saved.commands, saved.tick);
    }
}
