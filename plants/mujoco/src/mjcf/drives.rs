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

use twinrig_legged::{DriveModels, Servos};

use super::sections::{Sections, line, triple};
use crate::model::{FLYWHEEL, LegModel, Model, UNLIMITED};
use crate::options::Coordinates;

/// Distance from the fixed end of the pulley's branch of the cable to the initial position of the
/// pulley \[m\].
const BRANCH: f64 = 1.0;

/// Writes pulley, cable and drives of a leg.
pub(super) fn write(leg: &LegModel, drives: &DriveModels, model: &Model, to: &mut Sections) {
    let (tag, radius) = (&leg.tag, leg.pulley_radius);
    let [_, inertia] = drives.inertias();
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
    let hip = match model.coordinates {
        Coordinates::Minimal => format!("{tag}_hip"),
        Coordinates::Maximal => format!("{tag}_upper_turn"),
    };
    match drives {
        DriveModels::Servos(servos) if model.position_actuators => {
            position_actuators(leg, servos, &hip, to);
        }
        DriveModels::Servos(servos) => {
            let knee = (format!("{tag}_pulley"), 1.0 / radius);
            let joints = [(hip, 1.0), knee];
            for ((drive, servo), (joint, per)) in
                ["hip", "knee"].into_iter().zip(servos.both()).zip(joints)
            {
                let torque = servo.torque().min(UNLIMITED);
                line!(
                    to.world,
                    "    <body name=\"{tag}_{drive}_flywheel\">\n      <joint name=\"{tag}_{drive}_flywheel\" axis=\"0 -1 0\"/>\n      <inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"{FLYWHEEL} {FLYWHEEL} {FLYWHEEL}\"/>\n    </body>"
                );
                line!(
                    to.tendons,
                    "    <fixed name=\"{tag}_{drive}_clutch\" frictionloss=\"{torque}\">\n      <joint joint=\"{joint}\" coef=\"{per}\"/><joint joint=\"{tag}_{drive}_flywheel\" coef=\"-1\"/>\n    </fixed>"
                );
            }
        }
        DriveModels::Motors(_) => {
            line!(
                to.actuators,
                "    <motor name=\"{tag}_hip\" joint=\"{hip}\"/>"
            );
            line!(
                to.actuators,
                "    <motor name=\"{tag}_knee\" joint=\"{tag}_pulley\" gear=\"{}\"/>",
                1.0 / radius
            );
        }
    }
}

/// Writes the servos of a leg as position actuators, critically damped at the rate of the servos
/// with the inertia of the stretched leg, or of the pulley.
fn position_actuators(leg: &LegModel, servos: &Servos, hip: &str, to: &mut Sections) {
    let tag = &leg.tag;
    let [at_hip, at_pulley] = servos.both();
    let pulley = format!("{tag}_pulley");
    for (drive, servo, joint, gear, inertia) in [
        (
            "hip",
            at_hip,
            hip,
            1.0,
            at_hip.inertia() + leg.hip_inertia(),
        ),
        (
            "knee",
            at_pulley,
            pulley.as_str(),
            1.0 / leg.pulley_radius,
            at_pulley.inertia(),
        ),
    ] {
        let rate = 2.0 / servo.lag();
        let (stiffness, damping) = (inertia * rate * rate, 2.0 * inertia * rate);
        let torque = servo.torque().min(UNLIMITED);
        line!(
            to.actuators,
            "    <position name=\"{tag}_{drive}\" joint=\"{joint}\" gear=\"{gear}\" kp=\"{stiffness}\" kv=\"{damping}\" \
             forcerange=\"-{torque} {torque}\"/>"
        );
    }
}
