//! Drives of hips and pulleys.
//!
//! A pulley belongs to the world, since it has no reaction on the trunk: a mass on a horizontal
//! slide, equivalent to its inertia at its radius. The cable has two branches, from hip to ankle
//! and from the pulley to the world; its length has an upper limit only, so it pulls and does not
//! push.
//!
//! A servo accelerates its joint as it requests, up to its torque. It is modelled as a flywheel
//! that turns at the requested rate, and a clutch that transmits the servo's torque at most. The
//! flywheel is so heavy that the joint does not affect it.

use core::fmt::Write;

use twinrig_actuator::PositionServo;
use twinrig_legged::DriveModels;

use super::sections::{Sections, line, triple};
use crate::inputs::DRIVE_NAMES;
use crate::model::{FLYWHEEL, LegModel, Model, UNLIMITED};
use crate::options::Coordinates;

/// Distance from the fixed end of the pulley's branch of the cable to the initial position of the
/// pulley \[m\].
const BRANCH: f64 = 1.0;

/// Drive of a joint: coordinate, its ratio to the angle of the drive, and the inertia that a servo
/// moves.
struct Driven {
    joint: String,
    ratio: f64,
    inertia: f64,
}

/// Writes pulley, cable and drives of a leg.
pub(super) fn write(leg: &LegModel, model: &Model, to: &mut Sections) {
    let tag = &leg.tag;
    if model.drives.is_some() {
        cable(leg, model, to);
    }
    let hip = match model.coordinates {
        Coordinates::Minimal => format!("{tag}_hip"),
        Coordinates::Maximal => format!("{tag}_upper_turn"),
    };
    let [at_hip, at_pulley, at_abduction] = model.drive_inertias();
    let driven = |joint: String, ratio, inertia| Driven {
        joint,
        ratio,
        inertia,
    };
    let joints = [
        driven(hip, 1.0, at_hip + leg.hip_inertia()),
        driven(format!("{tag}_pulley"), 1.0 / leg.pulley_radius, at_pulley),
        driven(
            format!("{tag}_abduction"),
            1.0,
            at_abduction + leg.abduction_inertia(),
        ),
    ];
    for ((drive, servo), driven) in DRIVE_NAMES.into_iter().zip(&model.servos).zip(&joints) {
        let name = format!("{tag}_{drive}");
        match servo {
            Some(servo) if model.position_actuators => {
                position_actuator(&name, servo, driven, to);
            }
            Some(servo) => clutch(&name, servo, driven, to),
            None => {}
        }
    }
    if let Some(DriveModels::Motors(_)) = model.drives {
        let [hip, pulley, abduction] = joints;
        line!(
            to.actuators,
            "    <motor name=\"{tag}_hip\" joint=\"{}\"/>",
            hip.joint
        );
        line!(
            to.actuators,
            "    <motor name=\"{tag}_knee\" joint=\"{}\" gear=\"{}\"/>",
            pulley.joint,
            pulley.ratio
        );
        if let [.., Some(_)] = model.motors() {
            line!(
                to.actuators,
                "    <motor name=\"{tag}_abduction\" joint=\"{}\"/>",
                abduction.joint
            );
        }
    }
}

/// Writes pulley and cable of a leg.
fn cable(leg: &LegModel, model: &Model, to: &mut Sections) {
    let (tag, radius) = (&leg.tag, leg.pulley_radius);
    let [_, inertia, _] = model.drive_inertias();
    let [x, y, z] = leg.pulley_position;
    line!(
        to.world,
        "    <site name=\"{tag}_anchor\" pos=\"{}\"/>",
        triple(&[x - BRANCH, y, z])
    );
    line!(
        to.world,
        "    <body name=\"{tag}_pulley\" pos=\"{}\">\n      <joint name=\"{tag}_pulley\" type=\"slide\" axis=\"1 0 0\"/>",
        triple(&leg.pulley_position)
    );
    let mass = inertia / (radius * radius);
    line!(
        to.world,
        "      <inertial pos=\"0 0 0\" mass=\"{mass}\" diaginertia=\"1 1 1\"/>\n      <site name=\"{tag}_pulley\"/>\n    </body>"
    );
    line!(
        to.tendons,
        "    <spatial name=\"{tag}_cable\" range=\"0 {}\">\n      <site site=\"{tag}_hip\"/><site site=\"{tag}_ankle\"/><pulley divisor=\"1\"/>\n      <site site=\"{tag}_anchor\"/><site site=\"{tag}_pulley\"/>\n    </spatial>",
        leg.cable_max + BRANCH
    );
}

/// Writes a servo as a flywheel and a clutch.
fn clutch(name: &str, servo: &PositionServo, driven: &Driven, to: &mut Sections) {
    let torque = servo.torque().min(UNLIMITED);
    let Driven { joint, ratio, .. } = driven;
    line!(
        to.world,
        "    <body name=\"{name}_flywheel\">\n      <joint name=\"{name}_flywheel\" axis=\"0 -1 0\"/>\n      <inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"{FLYWHEEL} {FLYWHEEL} {FLYWHEEL}\"/>\n    </body>"
    );
    line!(
        to.tendons,
        "    <fixed name=\"{name}_clutch\" frictionloss=\"{torque}\">\n      <joint joint=\"{joint}\" coef=\"{ratio}\"/><joint joint=\"{name}_flywheel\" coef=\"-1\"/>\n    </fixed>"
    );
}

/// Writes a servo as a position actuator, critically damped at the rate of the servo with the
/// inertia of the stretched leg, or of the pulley.
fn position_actuator(name: &str, servo: &PositionServo, driven: &Driven, to: &mut Sections) {
    let Driven {
        joint,
        ratio,
        inertia,
    } = driven;
    let rate = 2.0 / servo.lag();
    let (stiffness, damping) = (inertia * rate * rate, 2.0 * inertia * rate);
    let torque = servo.torque().min(UNLIMITED);
    line!(
        to.actuators,
        "    <position name=\"{name}\" joint=\"{joint}\" gear=\"{ratio}\" kp=\"{stiffness}\" kv=\"{damping}\" \
         forcerange=\"-{torque} {torque}\"/>"
    );
}
