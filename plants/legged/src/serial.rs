//! Serial servos of the legs: their drives, and the firmware that commands these, if the plant has
//! it.

use serde::{Deserialize, Serialize};
use twinrig_actuator::StepInputs;
use twinrig_actuator::serial::{
    Bridge, Electric, Firmware, FirmwareState, SerialDrive, SerialDriveState, ServoCommand,
};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_robot::serial::SerialServo;

use crate::dynamics::Dynamics;
use crate::readings::Readings;
use crate::setup::{Abduction, FirmwarePlace, Setup};

/// Servos of hip and knee of all legs, then those of abduction, if these are serial, too. A step of
/// their drives is one of the plant.
#[derive(Debug, Clone)]
pub struct SerialServos {
    legs: usize,
    drives: Vec<SerialDrive>,
    /// Inputs in the order of the ports: commands \[rad\], or duty cycle and bridge of each.
    inputs: Vec<f64>,
    /// Firmware, unless it is on a bus.
    control: Option<Control>,
    /// Torque–rate lines of the drives, and their rates of change, which are zero.
    lines: Vec<f64>,
    rates: Vec<f64>,
}

/// Firmware of all servos, which works in steps of its period, at the same instants.
#[derive(Debug, Clone)]
struct Control {
    firmware: Vec<Firmware>,
    /// Next step.
    tick: SimTime,
    period: SimDuration,
}

/// Serialised state.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct SavedServos {
    drives: Vec<SerialDriveState>,
    inputs: Vec<f64>,
    firmware: Vec<FirmwareState>,
    tick: SimTime,
}

/// Joints of a leg with serial servos.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SerialJoint {
    Hip,
    Knee,
    Abduction,
}

/// Returns angle and rate of a joint.
fn motion<R: Readings + ?Sized>(readings: &R, leg: usize, joint: SerialJoint) -> [f64; 2] {
    match joint {
        SerialJoint::Hip => [readings.hip(leg), readings.hip_rate(leg)],
        SerialJoint::Knee => [readings.pulley(leg), readings.pulley_rate(leg)],
        SerialJoint::Abduction => [readings.abduction(leg), readings.abduction_rate(leg)],
    }
}

/// Returns leg and joint of a drive, of so many legs.
fn place(drive: usize, legs: usize) -> (usize, SerialJoint) {
    match drive.checked_sub(2 * legs) {
        Some(leg) => (leg, SerialJoint::Abduction),
        None if drive.is_multiple_of(2) => (drive / 2, SerialJoint::Hip),
        None => (drive / 2, SerialJoint::Knee),
    }
}

impl SavedServos {
    /// Checks that the state is that of a plant without serial servos.
    ///
    /// # Errors
    /// Description of the state.
    pub(crate) fn check_none(&self) -> Result<(), String> {
        match self.drives.len() {
            0 => Ok(()),
            found => Err(format!("{found} serial servos, expected none")),
        }
    }
}

impl Control {
    fn new(servo: &SerialServo, drives: usize) -> Self {
        // Not cloned, which would take the capacity of their queues.
        let firmware = (0..drives).map(|_| Firmware::new(&servo.controller, 0.0));
        Self {
            firmware: firmware.collect(),
            tick: SimTime::ZERO,
            period: Firmware::new(&servo.controller, 0.0).period(),
        }
    }

    /// Accepts the command of a servo.
    fn command(&mut self, drive: usize, now: SimTime, position: f64) {
        let command = ServoCommand {
            position,
            enabled: true,
        };
        self.firmware[drive].command(now, self.tick, command);
    }
}

impl SerialServos {
    /// Note on servos that resume from a state.
    pub(crate) const RESTARTED: &str = "serial servos have cold windings and no commands under way; those with firmware in the \
         plant hold their positions";

    /// Creates the servos of the legs of a setup, which hold their positions, or whose bridges are
    /// open if their firmware is on a bus.
    pub(crate) fn new<R: Readings + ?Sized>(
        servo: &SerialServo,
        place: FirmwarePlace,
        setup: &Setup,
        readings: &R,
    ) -> Self {
        let legs = setup.legs.len();
        let joints = if setup.abduction == Abduction::Serial {
            3
        } else {
            2
        };
        let count = joints * legs;
        let (control, inputs, longest) = match place {
            FirmwarePlace::Plant => {
                let control = Control::new(servo, count);
                let longest = setup.step.min(control.period);
                (Some(control), count, longest)
            }
            FirmwarePlace::Bus => (None, 2 * count, setup.step),
        };
        let drives = (0..count).map(|_| SerialDrive::new(servo, longest.as_secs_f64()));
        let mut servos = Self {
            legs,
            drives: drives.collect(),
            inputs: vec![0.0; inputs],
            control,
            lines: vec![0.0; 2 * count],
            rates: vec![0.0; 2 * count],
        };
        servos.restart(SimTime::ZERO, readings);
        servos
    }

    /// Lets the servos hold the present positions, or opens the bridges of those with their
    /// firmware on a bus.
    pub(crate) fn restart<R: Readings + ?Sized>(&mut self, now: SimTime, readings: &R) {
        self.drives.iter_mut().for_each(SerialDrive::restart);
        let Some(control) = &mut self.control else {
            self.inputs.fill(0.0);
            return;
        };
        control.tick = now;
        let firmware = control.firmware.iter_mut().zip(&mut self.inputs);
        for (drive, (firmware, command)) in firmware.enumerate() {
            let (leg, joint) = place(drive, self.legs);
            let [angle, _] = motion(readings, leg, joint);
            firmware.restart(angle);
            *command = angle;
        }
    }

    /// Writes the last inputs.
    pub(crate) fn inputs(&self, inputs: &mut [f64]) {
        inputs.copy_from_slice(&self.inputs);
    }

    /// Accepts inputs at `now`.
    pub(crate) fn set_inputs(&mut self, now: SimTime, inputs: &[f64]) {
        let Some(control) = &mut self.control else {
            self.inputs.copy_from_slice(inputs);
            let (inputs, _) = self.inputs.as_chunks::<2>();
            for (drive, [duty, closed]) in self.drives.iter_mut().zip(inputs) {
                drive.set_bridge(if *closed > 0.5 {
                    Bridge::Duty(duty.clamp(-1.0, 1.0))
                } else {
                    Bridge::Open
                });
            }
            return;
        };
        let commands = self.inputs.iter_mut().zip(inputs);
        for (drive, (last, command)) in commands.enumerate() {
            if command != last {
                *last = *command;
                control.command(drive, now, *command);
            }
        }
    }

    /// Returns the end of a step from `now`, at most `next`.
    pub(crate) fn step_end(&self, now: SimTime, next: SimTime) -> SimTime {
        match &self.control {
            None => next,
            Some(control) if control.tick > now => next.min(control.tick),
            Some(control) => next.min(now + control.period),
        }
    }

    /// Starts a step of the plant, with the inputs of its dynamics.
    pub(crate) fn start_step<D: Dynamics + ?Sized>(
        &mut self,
        now: SimTime,
        seconds: f64,
        dynamics: &mut D,
    ) {
        let mut due = self.control.as_mut().filter(|control| control.tick <= now);
        let lines = self.lines.chunks_exact_mut(2);
        for (number, (drive, line)) in self.drives.iter_mut().zip(lines).enumerate() {
            let (leg, joint) = place(number, self.legs);
            let motion = motion(dynamics, leg, joint);
            if let Some(control) = &mut due {
                let bridge = control.firmware[number].step(control.tick, motion[0]);
                drive.set_bridge(bridge);
            }
            let started = drive.start_step(motion, seconds);
            (line[0], line[1]) = (started.torque, started.damping);
        }
        if let Some(control) = due {
            control.tick = now + control.period;
        }
        dynamics.set_inputs(&StepInputs {
            start: &self.lines,
            rates: &self.rates,
            mean: &self.lines,
        });
    }

    /// Returns voltage, current and torque of a motor at the present rate of its joint.
    pub(crate) fn electric<R: Readings + ?Sized>(
        &self,
        leg: usize,
        joint: SerialJoint,
        readings: &R,
    ) -> Electric {
        let drive = match joint {
            SerialJoint::Hip => 2 * leg,
            SerialJoint::Knee => 2 * leg + 1,
            SerialJoint::Abduction => 2 * self.legs + leg,
        };
        let [_, rate] = motion(readings, leg, joint);
        self.drives[drive].electric(rate)
    }

    pub(crate) fn save(&self) -> SavedServos {
        let control = self.control.as_ref();
        let firmware = control.into_iter().flat_map(|control| &control.firmware);
        SavedServos {
            drives: self.drives.iter().map(SerialDrive::state).collect(),
            inputs: self.inputs.clone(),
            firmware: firmware.map(|firmware| firmware.state.clone()).collect(),
            tick: control.map_or(SimTime::ZERO, |control| control.tick),
        }
    }

    /// Checks that a state is that of these servos.
    ///
    /// # Errors
    /// Description of the state.
    pub(crate) fn check(&self, saved: &SavedServos) -> Result<(), String> {
        let firmware = self.control.as_ref().map_or(0, |it| it.firmware.len());
        let expected = [self.drives.len(), self.inputs.len(), firmware];
        let found = [saved.drives.len(), saved.inputs.len(), saved.firmware.len()];
        if found == expected {
            return Ok(());
        }
        let text = |[servos, _, firmware]: [usize; 3]| {
            format!("{servos} serial servos, {firmware} of them with firmware in the plant")
        };
        Err(format!("{}, expected {}", text(found), text(expected)))
    }

    /// Restores a state of these servos.
    pub(crate) fn restore(&mut self, saved: SavedServos) {
        for (drive, saved) in self.drives.iter_mut().zip(saved.drives) {
            drive.restore(saved);
        }
        self.inputs = saved.inputs;
        if let Some(control) = &mut self.control {
            for (firmware, saved) in control.firmware.iter_mut().zip(saved.firmware) {
                firmware.state = saved;
            }
            control.tick = saved.tick;
        }
    }
}
