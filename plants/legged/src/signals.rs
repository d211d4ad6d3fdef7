//! Signals of the plants: names, units, sizes and output of values.

use libm::{asin, atan2};
use nalgebra::{Matrix3, Vector3};
use twinrig_kernel::{Direction, Port, SimTime, Unit, signal};
use twinrig_runtime::PlantFault;

use crate::LEGS;
use crate::readings::{FootMotion, Readings};
use crate::serial::{SerialJoint, SerialServos};
use crate::setup::{Abduction, Contacts, Drives, FirmwarePlace, Setup};
use crate::window::Window;

/// Motion of the trunk, in the order of [`signal::BODY`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BodySignal {
    Position,
    Orientation,
    Rpy,
    Velocity,
    AngularVelocity,
    ContactForce,
}

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
    AbductionPosition,
    AbductionTorque,
    SegmentsForce,
    AbductionRate,
    HipCurrent,
    KneeCurrent,
    AbductionCurrent,
    HipSupply,
    KneeSupply,
    AbductionSupply,
}

const LEG: [LegSignal; 23] = [
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
    LegSignal::AbductionPosition,
    LegSignal::AbductionTorque,
    LegSignal::SegmentsForce,
    LegSignal::AbductionRate,
    LegSignal::HipCurrent,
    LegSignal::KneeCurrent,
    LegSignal::AbductionCurrent,
    LegSignal::HipSupply,
    LegSignal::KneeSupply,
    LegSignal::AbductionSupply,
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

/// Measurements available only if the drives have motors: their torque depends on the rate.
const OF_MOTORS: [LegSignal; 2] = [LegSignal::HipRate, LegSignal::KneeRate];

/// Measurements available only with joints of abduction.
const OF_ABDUCTION: [LegSignal; 2] = [LegSignal::AbductionPosition, LegSignal::AbductionTorque];

/// Measurements available only with serial servos whose firmware is on a bus, which measures them.
const OF_SERVOS: [LegSignal; 4] = [
    LegSignal::HipCurrent,
    LegSignal::KneeCurrent,
    LegSignal::HipSupply,
    LegSignal::KneeSupply,
];

/// The same of joints of abduction with such servos.
const OF_ABDUCTION_SERVOS: [LegSignal; 3] = [
    LegSignal::AbductionRate,
    LegSignal::AbductionCurrent,
    LegSignal::AbductionSupply,
];

/// Inputs and selected measurements of a plant, in the order of the ports.
#[derive(Debug, Clone)]
pub struct Signals {
    body: [bool; signal::BODY.len()],
    energy: [bool; signal::ENERGY.len()],
    /// Selection of each leg.
    legs: Vec<[bool; LEG.len()]>,
    /// Measurements selected for any leg.
    any_leg: [bool; LEG.len()],
    ports: Vec<Port>,
}

impl Signals {
    /// Creates the signals of these legs, which must be those of `setup` in the order of the robot,
    /// with the measurements selected by `selected`. Availability:
    ///
    /// - drives: inputs (the command of a servo, or voltage and bridge of a motor, or duty cycle
    ///   and bridge of a servo on a bus), torques, knee positions and cable tensions;
    /// - motors, also those of serial servos: rates of hip and knee;
    /// - joints of abduction: their angles and torques, and with servos their inputs, which follow
    ///   the other inputs;
    /// - servos on a bus: currents, voltages of the supply, and the rate of abduction;
    /// - ground: loads, forces and clearances of the feet;
    /// - contact of trunk, or of knees and ankles: the force on them.
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
        if setup.abduction.is_driven() {
            let inputs = match setup.abduction {
                Abduction::Serial => inputs(&setup.drives),
                _ => COMMAND,
            };
            for leg in legs {
                for (input, unit) in inputs {
                    let name = signal::of_leg(leg, &format!("abduction/{input}"));
                    ports.push(Port::input(name, *unit, 1));
                }
            }
        }
        let mut select = |exists: bool, port: Port| {
            let is_selected = exists && selected(&port.name);
            if is_selected {
                ports.push(port);
            }
            is_selected
        };
        let [trunk, segments] = [
            ground && setup.contacts != Contacts::Feet,
            ground && setup.contacts == Contacts::All,
        ];
        let body = signal::BODY.map(|standard| {
            let exists = trunk || standard.name != signal::BODY_CONTACT_FORCE;
            select(exists, standard.output())
        });
        let energy = signal::ENERGY.map(|standard| select(true, standard.output()));
        let motors = setup.drives.have_motors();
        let abduction = setup.abduction != Abduction::Locked;
        let servos = is_on_bus(&setup.drives);
        let abduction_servos = servos && setup.abduction == Abduction::Serial;
        let exists = |signal: &LegSignal| {
            (ground || !ON_GROUND.contains(signal))
                && (drives || !OF_DRIVES.contains(signal))
                && (motors || !OF_MOTORS.contains(signal))
                && (abduction || !OF_ABDUCTION.contains(signal))
                && (segments || *signal != LegSignal::SegmentsForce)
                && (servos || !OF_SERVOS.contains(signal))
                && (abduction_servos || !OF_ABDUCTION_SERVOS.contains(signal))
        };
        let of_leg = |leg: &&str| {
            LEG.map(|signal| {
                let port = signal::LEG[signal as usize].output_of_leg(leg);
                select(exists(&signal), port)
            })
        };
        let legs: Vec<_> = legs.iter().map(of_leg).collect();
        Self {
            body,
            energy,
            any_leg: LEG.map(|signal| legs.iter().any(|leg| leg[signal as usize])),
            legs,
            ports,
        }
    }

    /// Returns the ports: inputs of hip and knee, leg by leg, those of abduction; then the
    /// measurements.
    pub fn ports(&self) -> &[Port] {
        &self.ports
    }

    /// Returns the number of values of all measurements.
    pub fn outputs(&self) -> usize {
        let ports = self.ports.iter();
        let outputs = ports.filter(|port| port.direction == Direction::Output);
        outputs.map(|port| port.size).sum()
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
        servos: Option<&SerialServos>,
        window: &Window,
        now_s: f64,
        outputs: &mut [f64],
    ) {
        let mut outputs = Outputs(outputs);
        self.write_body(readings, &mut outputs);
        outputs.put_if(self.body[BodySignal::ContactForce as usize], || {
            let impulse = readings.trunk_impulse();
            let force = window.mean_force(|before| before.trunk, &impulse, now_s);
            force.into()
        });
        if self.energy.contains(&true) {
            let balance = readings.energy().values();
            for (selected, value) in self.energy.iter().zip(balance) {
                outputs.put_if(*selected, || [value]);
            }
        }
        self.write_legs(readings, servos, window, now_s, &mut outputs);
    }

    fn write_body(&self, readings: &(impl Readings + ?Sized), outputs: &mut Outputs<'_>) {
        let selected = |signal: BodySignal| self.body[signal as usize];
        outputs.put_if(selected(BodySignal::Position), || {
            readings.position().into()
        });
        outputs.put_if(selected(BodySignal::Orientation), || readings.attitude());
        outputs.put_if(selected(BodySignal::Rpy), || {
            roll_pitch_yaw(&readings.rotation())
        });
        outputs.put_if(selected(BodySignal::Velocity), || {
            readings.velocity().into()
        });
        outputs.put_if(selected(BodySignal::AngularVelocity), || {
            readings.angular_velocity().into()
        });
    }

    fn write_legs(
        &self,
        of: &(impl Readings + ?Sized),
        servos: Option<&SerialServos>,
        window: &Window,
        now_s: f64,
        outputs: &mut Outputs<'_>,
    ) {
        use LegSignal as S;
        let any = |signals: &[S]| signals.iter().any(|signal| self.any_leg[*signal as usize]);
        let on_surface = any(&[S::FootLoad, S::FootClearance]);
        let feet = if on_surface || any(&[S::FootPosition, S::FootVelocity]) {
            of.feet()
        } else {
            [FootMotion::default(); LEGS]
        };
        let surfaces = on_surface.then(|| of.surfaces(&feet));
        for ((leg, selected), foot) in self.legs.iter().enumerate().zip(&feet) {
            let selected = |signal: S| selected[signal as usize];
            outputs.put_if(selected(S::HipPosition), || [of.hip(leg)]);
            outputs.put_if(selected(S::HipRate), || [of.hip_rate(leg)]);
            outputs.put_if(selected(S::HipTorque), || [of.hip_torque(leg)]);
            outputs.put_if(selected(S::KneePosition), || [of.pulley(leg)]);
            outputs.put_if(selected(S::KneeRate), || [of.pulley_rate(leg)]);
            outputs.put_if(selected(S::KneeTorque), || [of.knee_torque(leg)]);
            outputs.put_if(selected(S::CableTension), || [of.cable_tension(leg)]);
            outputs.put_if(selected(S::Angles), || of.angles(leg));
            outputs.put_if(selected(S::FootPosition), || foot.position.into());
            outputs.put_if(selected(S::FootVelocity), || foot.velocity.into());
            let force = if selected(S::FootLoad) || selected(S::FootForce) {
                window.mean_force(|before| before.feet[leg], &of.ground_impulse(leg), now_s)
            } else {
                Vector3::zeros()
            };
            let surface = surfaces.as_ref().map(|surfaces| &surfaces[leg]);
            if let Some(surface) = surface {
                outputs.put_if(selected(S::FootLoad), || [force.dot(&surface.normal)]);
            }
            outputs.put_if(selected(S::FootForce), || force.into());
            if let Some(surface) = surface {
                outputs.put_if(selected(S::FootClearance), || [surface.gap]);
            }
            outputs.put_if(selected(S::AbductionPosition), || [of.abduction(leg)]);
            outputs.put_if(selected(S::AbductionTorque), || [of.abduction_torque(leg)]);
            outputs.put_if(selected(S::SegmentsForce), || {
                let impulse = of.segments_impulse(leg);
                let force = window.mean_force(|before| before.segments[leg], &impulse, now_s);
                force.into()
            });
            if let Some(servos) = servos {
                write_servos(of, servos, leg, selected, outputs);
            }
        }
    }
}

/// Writes the measurements that the servos of a leg have.
fn write_servos(
    of: &(impl Readings + ?Sized),
    servos: &SerialServos,
    leg: usize,
    selected: impl Fn(LegSignal) -> bool,
    outputs: &mut Outputs<'_>,
) {
    use LegSignal as S;
    use SerialJoint::{Abduction, Hip, Knee};
    outputs.put_if(selected(S::AbductionRate), || [of.abduction_rate(leg)]);
    let electric = |joint| servos.electric(leg, joint, of);
    for (signal, joint) in [
        (S::HipCurrent, Hip),
        (S::KneeCurrent, Knee),
        (S::AbductionCurrent, Abduction),
    ] {
        outputs.put_if(selected(signal), || [electric(joint).current]);
    }
    for (signal, joint) in [
        (S::HipSupply, Hip),
        (S::KneeSupply, Knee),
        (S::AbductionSupply, Abduction),
    ] {
        outputs.put_if(selected(signal), || [electric(joint).voltage]);
    }
}

/// Input of a drive that follows commands.
const COMMAND: &[(&str, Unit)] = &[("command", Unit::Radian)];

/// Returns whether the drives are servos on a bus.
const fn is_on_bus(drives: &Drives) -> bool {
    matches!(
        drives,
        Drives::Serial {
            firmware: FirmwarePlace::Bus,
            ..
        }
    )
}

/// Returns the inputs of a drive.
fn inputs(drives: &Drives) -> &'static [(&'static str, Unit)] {
    match drives {
        Drives::None => &[],
        Drives::Motors { .. } => &[("voltage", Unit::Volt), ("bridge", Unit::One)],
        Drives::Serial {
            firmware: FirmwarePlace::Bus,
            ..
        } => &[("duty", Unit::One), ("bridge", Unit::One)],
        Drives::Ideal { .. } | Drives::Servos { .. } | Drives::Serial { .. } => COMMAND,
    }
}

/// Outputs that are not written yet.
struct Outputs<'o>(&'o mut [f64]);

impl Outputs<'_> {
    /// Writes the next values, if they are selected.
    #[inline]
    fn put_if<const M: usize>(&mut self, selected: bool, values: impl FnOnce() -> [f64; M]) {
        if selected {
            let outputs = std::mem::take(&mut self.0);
            let (next, rest) = outputs
                .split_first_chunk_mut()
                .expect("there is an output for each selected value");
            *next = values();
            self.0 = rest;
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
