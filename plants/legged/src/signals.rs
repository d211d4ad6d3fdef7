//! Signals of the plants: names, units, sizes and output of values.

use libm::{asin, atan2};
use nalgebra::Matrix3;
use twinrig_kernel::{Direction, Port, SimTime, Unit, signal};
use twinrig_runtime::PlantFault;

use crate::readings::Readings;
use crate::setup::{Drives, Setup};
use crate::window::Window;

/// Motion of the trunk, in the order of [`signal::BODY`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BodySignal {
    Position,
    Orientation,
    Rpy,
    Velocity,
    AngularVelocity,
}

const BODY: [BodySignal; 5] = [
    BodySignal::Position,
    BodySignal::Orientation,
    BodySignal::Rpy,
    BodySignal::Velocity,
    BodySignal::AngularVelocity,
];

/// Measurement of one leg, in the order of [`signal::LEG`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LegSignal {
    HipPosition,
    HipRate,
    HipTorque,
    KneePosition,
    KneeRate,
    KneeTorque,
    CableTension,
    Angles,
    FootPosition,
    FootVelocity,
    FootLoad,
    FootForce,
    FootClearance,
}

/// Selected measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Signal {
    Body(BodySignal),
    /// With the index in [`signal::ENERGY`].
    Energy(usize),
    Leg(usize, LegSignal),
}

const LEG: [LegSignal; 13] = [
    LegSignal::HipPosition,
    LegSignal::HipRate,
    LegSignal::HipTorque,
    LegSignal::KneePosition,
    LegSignal::KneeRate,
    LegSignal::KneeTorque,
    LegSignal::CableTension,
    LegSignal::Angles,
    LegSignal::FootPosition,
    LegSignal::FootVelocity,
    LegSignal::FootLoad,
    LegSignal::FootForce,
    LegSignal::FootClearance,
];

/// Measurements available only with ground.
const ON_GROUND: [LegSignal; 3] = [
    LegSignal::FootLoad,
    LegSignal::FootForce,
    LegSignal::FootClearance,
];

/// Measurements available only with drives.
const OF_DRIVES: [LegSignal; 4] = [
    LegSignal::HipTorque,
    LegSignal::KneePosition,
    LegSignal::KneeTorque,
    LegSignal::CableTension,
];

/// Measurements available only if the drives are motors: their torque depends on the rate.
const OF_MOTORS: [LegSignal; 2] = [LegSignal::HipRate, LegSignal::KneeRate];

/// Inputs and selected measurements of a plant, in the order of the ports.
#[derive(Debug, Clone)]
pub struct Signals {
    selected: Vec<Signal>,
    energy: bool,
    ports: Vec<Port>,
}

impl Signals {
    /// Creates the signals of these legs, which must be those of `setup` in the order of the robot,
    /// with the measurements selected by `selected`. Availability:
    ///
    /// - drives: inputs (the command of a servo, or voltage and bridge of a motor), torques, knee
    ///   positions and cable tensions;
    /// - motors: rates of hip and knee;
    /// - ground: loads, forces and clearances of the feet.
    pub fn new(legs: &[&str], setup: &Setup, selected: &dyn Fn(&str) -> bool) -> Self {
        let (ground, drives) = (setup.ground.is_some(), setup.drives != Drives::None);
        let mut ports = Vec::new();
        for leg in legs.iter().filter(|_| drives) {
            for joint in ["hip", "knee"] {
                for (input, unit) in inputs(&setup.drives) {
                    let name = signal::of_leg(leg, &format!("{joint}/{input}"));
                    ports.push(Port::input(name, *unit, 1));
                }
            }
        }
        let mut signals = Vec::new();
        let body = signal::BODY.iter().zip(BODY.map(Signal::Body));
        let energy = signal::ENERGY.iter().zip((0..).map(Signal::Energy));
        for (standard, signal) in body.chain(energy) {
            if selected(standard.name) {
                ports.push(standard.output());
                signals.push(signal);
            }
        }
        let motors = matches!(setup.drives, Drives::Motors { .. });
        let exists = |signal: &LegSignal| {
            (ground || !ON_GROUND.contains(signal))
                && (drives || !OF_DRIVES.contains(signal))
                && (motors || !OF_MOTORS.contains(signal))
        };
        for (i, leg) in legs.iter().enumerate() {
            for (standard, signal) in signal::LEG.iter().zip(LEG) {
                let port = standard.output_of_leg(leg);
                if exists(&signal) && selected(&port.name) {
                    ports.push(port);
                    signals.push(Signal::Leg(i, signal));
                }
            }
        }
        let energy = signals
            .iter()
            .any(|signal| matches!(signal, Signal::Energy(_)));
        Self {
            selected: signals,
            energy,
            ports,
        }
    }

    /// Returns the ports: inputs of hip and knee, leg by leg; then the measurements.
    pub fn ports(&self) -> &[Port] {
        &self.ports
    }

    /// Checks that all inputs are finite; `stored` returns the energy of the plant at `now` \[J\],
    /// for the fault.
    ///
    /// # Errors
    /// [`PlantFault`] that names the input.
    pub fn check_inputs(
        &self,
        inputs: &[f64],
        now: SimTime,
        stored: impl FnOnce() -> f64,
    ) -> Result<(), PlantFault> {
        let Some(i) = inputs.iter().position(|input| !input.is_finite()) else {
            return Ok(());
        };
        let commands = self.ports.iter();
        let mut commands = commands.filter(|port| port.direction == Direction::Input);
        let part = commands.nth(i).map(|port| port.name.clone());
        Err(PlantFault {
            time: now,
            part: part.unwrap_or_default(),
            energy: stored(),
            why: "the input is not finite".to_owned(),
        })
    }

    /// Writes the selected measurements; ground forces are means over the window up to `now_s`
    /// \[s\].
    pub fn write(
        &self,
        readings: &(impl Readings + ?Sized),
        window: &Window,
        now_s: f64,
        outputs: &mut [f64],
    ) {
        let balance = if self.energy {
            readings.energy().values()
        } else {
            [0.0; 8]
        };
        let mut rest = outputs;
        for signal in &self.selected {
            rest = match *signal {
                Signal::Body(body) => body.write(readings, rest),
                Signal::Energy(index) => put(&[balance[index]], rest),
                Signal::Leg(leg, signal) => signal.write(readings, leg, window, now_s, rest),
            };
        }
    }
}

/// Returns the inputs of a drive.
fn inputs(drives: &Drives) -> &'static [(&'static str, Unit)] {
    match drives {
        Drives::None => &[],
        Drives::Ideal { .. } | Drives::Servos { .. } => &[("command", Unit::Radian)],
        Drives::Motors { .. } => &[("voltage", Unit::Volt), ("bridge", Unit::One)],
    }
}

/// Writes values to the front of a slice and returns the rest.
fn put<'a>(values: &[f64], outputs: &'a mut [f64]) -> &'a mut [f64] {
    let (front, rest) = outputs.split_at_mut(values.len());
    front.copy_from_slice(values);
    rest
}

impl BodySignal {
    fn write<'a>(
        self,
        readings: &(impl Readings + ?Sized),
        outputs: &'a mut [f64],
    ) -> &'a mut [f64] {
        match self {
            Self::Position => put(readings.position().as_slice(), outputs),
            Self::Orientation => put(&readings.attitude(), outputs),
            Self::Rpy => put(&roll_pitch_yaw(&readings.rotation()), outputs),
            Self::Velocity => put(readings.velocity().as_slice(), outputs),
            Self::AngularVelocity => put(readings.angular_velocity().as_slice(), outputs),
        }
    }
}

impl LegSignal {
    fn write<'a>(
        self,
        of: &(impl Readings + ?Sized),
        leg: usize,
        window: &Window,
        now_s: f64,
        outputs: &'a mut [f64],
    ) -> &'a mut [f64] {
        let mean_force = || window.mean_force(leg, &of.ground_impulse(leg), now_s);
        match self {
            Self::HipPosition => put(&[of.hip(leg)], outputs),
            Self::HipRate => put(&[of.hip_rate(leg)], outputs),
            Self::HipTorque => put(&[of.hip_torque(leg)], outputs),
            Self::KneePosition => put(&[of.pulley(leg)], outputs),
            Self::KneeRate => put(&[of.pulley_rate(leg)], outputs),
            Self::KneeTorque => put(&[of.knee_torque(leg)], outputs),
            Self::CableTension => put(&[of.cable_tension(leg)], outputs),
            Self::Angles => put(&of.angles(leg), outputs),
            Self::FootPosition => put(of.foot_position(leg).as_slice(), outputs),
            Self::FootVelocity => put(of.foot_velocity(leg).as_slice(), outputs),
            Self::FootLoad => put(&[mean_force().dot(&of.ground_normal(leg))], outputs),
            Self::FootForce => put(mean_force().as_slice(), outputs),
            Self::FootClearance => put(&[of.clearance(leg)], outputs),
        }
    }
}

/// Returns the angles of the rotation about z, then y, then x (yaw, pitch, roll), in the order
/// roll, pitch, yaw.
fn roll_pitch_yaw(rotation: &Matrix3<f64>) -> [f64; 3] {
    [
        atan2(rotation[(2, 1)], rotation[(2, 2)]),
        asin((-rotation[(2, 0)]).clamp(-1.0, 1.0)),
        atan2(rotation[(1, 0)], rotation[(0, 0)]),
    ]
}
