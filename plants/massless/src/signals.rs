//! The plant's signals: their names and where their values are.

use libm::{asin, atan2};
use twinrig_kernel::{Port, Unit};
use twinrig_leg::Planar;

use twinrig_runtime::EnergyBooks;

use crate::flow::Flow;
use crate::state::LEGS;

/// A measurement of the whole robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BodySignal {
    Position,
    Orientation,
    Rpy,
    Velocity,
    AngularVelocity,
    Kinetic,
    Spring,
    Gravity,
    Dissipated,
    Actuator,
    Impact,
    Exchanged,
    Residual,
}

/// A measurement of one leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LegSignal {
    HipPosition,
    HipTorque,
    KneePosition,
    KneeTorque,
    CableTension,
    Angles,
    FootPosition,
    FootVelocity,
    FootLoad,
    FootForce,
    FootClearance,
}

/// A measurement that somebody wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Signal {
    Body(BodySignal),
    Leg(usize, LegSignal),
}

const BODY: [(&str, Unit, usize, BodySignal); 13] = [
    ("body/position", Unit::Meter, 3, BodySignal::Position),
    ("body/orientation", Unit::One, 4, BodySignal::Orientation),
    ("body/rpy", Unit::Radian, 3, BodySignal::Rpy),
    (
        "body/velocity",
        Unit::MeterPerSecond,
        3,
        BodySignal::Velocity,
    ),
    (
        "body/angular_velocity",
        Unit::RadianPerSecond,
        3,
        BodySignal::AngularVelocity,
    ),
    ("energy/kinetic", Unit::Joule, 1, BodySignal::Kinetic),
    ("energy/spring", Unit::Joule, 1, BodySignal::Spring),
    ("energy/gravity", Unit::Joule, 1, BodySignal::Gravity),
    ("energy/dissipated", Unit::Joule, 1, BodySignal::Dissipated),
    ("energy/actuator", Unit::Joule, 1, BodySignal::Actuator),
    ("energy/impact", Unit::Joule, 1, BodySignal::Impact),
    ("energy/exchanged", Unit::Joule, 1, BodySignal::Exchanged),
    ("energy/residual", Unit::Joule, 1, BodySignal::Residual),
];

const LEG: [(&str, Unit, usize, LegSignal); 11] = [
    ("hip/position", Unit::Radian, 1, LegSignal::HipPosition),
    ("hip/torque", Unit::NewtonMeter, 1, LegSignal::HipTorque),
    ("knee/position", Unit::Radian, 1, LegSignal::KneePosition),
    ("knee/torque", Unit::NewtonMeter, 1, LegSignal::KneeTorque),
    ("cable/tension", Unit::Newton, 1, LegSignal::CableTension),
    ("angles", Unit::Radian, 3, LegSignal::Angles),
    ("foot/position", Unit::Meter, 3, LegSignal::FootPosition),
    (
        "foot/velocity",
        Unit::MeterPerSecond,
        3,
        LegSignal::FootVelocity,
    ),
    ("foot/load", Unit::Newton, 1, LegSignal::FootLoad),
    ("foot/force", Unit::Newton, 3, LegSignal::FootForce),
    ("foot/clearance", Unit::Meter, 1, LegSignal::FootClearance),
];

/// Ground impulses at the start of the present window, and when that was.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Window {
    pub(crate) begun_s: f64,
    pub(crate) impulses: [[f64; 3]; LEGS],
}

/// The measurements that are wanted, in the order of the ports.
#[derive(Debug, Clone)]
pub(crate) struct Signals {
    wanted: Vec<Signal>,
    energy: bool,
    ports: Vec<Port>,
}

impl Signals {
    /// The signals of these legs, with those of the ground where there is one.
    pub(crate) fn new(legs: &[&str], ground: bool, wanted: &dyn Fn(&str) -> bool) -> Self {
        let mut ports = Vec::new();
        for leg in legs {
            for joint in ["hip", "knee"] {
                ports.push(Port::input(
                    format!("leg/{leg}/{joint}/command"),
                    Unit::Radian,
                    1,
                ));
            }
        }
        let mut signals = Vec::new();
        for (name, unit, size, signal) in BODY {
            if wanted(name) {
                ports.push(Port::output(name, unit, size));
                signals.push(Signal::Body(signal));
            }
        }
        for (i, leg) in legs.iter().enumerate() {
            for (name, unit, size, signal) in LEG {
                let name = format!("leg/{leg}/{name}");
                if (ground || !ON_GROUND.contains(&signal)) && wanted(&name) {
                    ports.push(Port::output(name, unit, size));
                    signals.push(Signal::Leg(i, signal));
                }
            }
        }
        let energy = signals
            .iter()
            .any(|signal| matches!(signal, Signal::Body(body) if body.is_energy()));
        Self {
            wanted: signals,
            energy,
            ports,
        }
    }

    pub(crate) fn ports(&self) -> &[Port] {
        &self.ports
    }

    /// Writes all measurements; `elapsed_s` is the time since the window began.
    pub(crate) fn write(
        &self,
        flows: &[Flow],
        window: &Window,
        elapsed_s: f64,
        outputs: &mut [f64],
    ) {
        let books = if self.energy {
            energy(flows)
        } else {
            EnergyBooks::default()
        };
        let mut rest = outputs;
        for signal in &self.wanted {
            rest = match *signal {
                Signal::Body(body) => body.write(&flows[0], &books, rest),
                Signal::Leg(leg, signal) => {
                    let before = &window.impulses[leg];
                    let (flow, own) = if flows.len() == 1 {
                        (&flows[0], leg)
                    } else {
                        (&flows[leg], 0)
                    };
                    signal.write(flow, own, before, elapsed_s, rest)
                }
            };
        }
    }
}

/// The books of all that moves by itself, in one.
pub(crate) fn energy(flows: &[Flow]) -> EnergyBooks {
    let mut sum = EnergyBooks::default();
    for flow in flows {
        let part = flow.energy();
        sum.kinetic += part.kinetic;
        sum.spring += part.spring;
        sum.gravity += part.gravity;
        sum.dissipated += part.dissipated;
        sum.actuator += part.actuator;
        sum.impact += part.impact;
        sum.exchanged += part.exchanged;
        sum.residual += part.residual;
    }
    sum
}

/// What there is to measure only where there is ground.
const ON_GROUND: [LegSignal; 3] = [
    LegSignal::FootLoad,
    LegSignal::FootForce,
    LegSignal::FootClearance,
];

/// Writes values to the front of a slice and returns the rest.
fn put<'a>(values: &[f64], outputs: &'a mut [f64]) -> &'a mut [f64] {
    let (front, rest) = outputs.split_at_mut(values.len());
    front.copy_from_slice(values);
    rest
}

impl BodySignal {
    const fn is_energy(self) -> bool {
        self as usize >= Self::Kinetic as usize
    }

    fn write<'a>(self, flow: &Flow, books: &EnergyBooks, outputs: &'a mut [f64]) -> &'a mut [f64] {
        let state = &flow.state;
        match self {
            Self::Position => put(state.position().as_slice(), outputs),
            Self::Orientation => put(&state.attitude(), outputs),
            Self::Rpy => put(&roll_pitch_yaw(&flow.here.rotation), outputs),
            Self::Velocity => put((flow.here.rotation * state.velocity()).as_slice(), outputs),
            Self::AngularVelocity => put(state.rate().as_slice(), outputs),
            Self::Kinetic => put(&[books.kinetic], outputs),
            Self::Spring => put(&[books.spring], outputs),
            Self::Gravity => put(&[books.gravity], outputs),
            Self::Dissipated => put(&[books.dissipated], outputs),
            Self::Actuator => put(&[books.actuator], outputs),
            Self::Impact => put(&[books.impact], outputs),
            Self::Exchanged => put(&[books.exchanged], outputs),
            Self::Residual => put(&[books.residual], outputs),
        }
    }
}

impl LegSignal {
    fn write<'a>(
        self,
        flow: &Flow,
        leg: usize,
        impulse_before: &[f64; 3],
        elapsed_s: f64,
        outputs: &'a mut [f64],
    ) -> &'a mut [f64] {
        let (state, here, model) = (&flow.state, &flow.here, &flow.model.legs[leg]);
        let foot = model.foot_in_trunk(state.foot(leg));
        let mean_force = || {
            let impulse = nalgebra::Vector3::from(flow.impulses[leg])
                - nalgebra::Vector3::from(*impulse_before);
            if elapsed_s > 0.0 {
                impulse / elapsed_s
            } else {
                nalgebra::Vector3::zeros()
            }
        };
        match self {
            Self::HipPosition => put(
                &[state.hip(leg) - model.pantograph.hip_reference()],
                outputs,
            ),
            Self::HipTorque => put(&[flow.torques[leg][0]], outputs),
            Self::KneePosition => put(&[state.pulley(leg)], outputs),
            Self::KneeTorque => put(&[flow.torques[leg][1]], outputs),
            Self::CableTension => put(
                &[flow.forces[leg][twinrig_leg::Stop::Cable as usize]],
                outputs,
            ),
            // The first angle is a coordinate; the others take an arc tangent each.
            Self::Angles => {
                let [_, second, third] = here.poses[leg].along;
                let of = |e: Planar| atan2(e.x, -e.y);
                put(&[state.hip(leg), of(second), of(third)], outputs)
            }
            Self::FootPosition => put(
                (state.position() + here.rotation * foot).as_slice(),
                outputs,
            ),
            Self::FootVelocity => {
                let own = state.foot_velocity(leg);
                let sideways = (state.velocity() + state.rate().cross(&foot)).y;
                let velocity = here.rotation * nalgebra::Vector3::new(own.x, sideways, own.y);
                put(velocity.as_slice(), outputs)
            }
            Self::FootLoad => put(&[mean_force().dot(&here.surfaces[leg].normal)], outputs),
            Self::FootForce => put(mean_force().as_slice(), outputs),
            Self::FootClearance => put(&[here.surfaces[leg].gap], outputs),
        }
    }
}

/// Angles of the rotation about z, then y, then x (yaw, pitch, roll), in the order roll, pitch, yaw.
fn roll_pitch_yaw(rotation: &nalgebra::Matrix3<f64>) -> [f64; 3] {
    [
        atan2(rotation[(2, 1)], rotation[(2, 2)]),
        asin((-rotation[(2, 0)]).clamp(-1.0, 1.0)),
        atan2(rotation[(1, 0)], rotation[(0, 0)]),
    ]
}
