//! The text of a robot file. Values that the description does not have are Cheetah-cub's, scaled,
//! and marked as ASSUMED.

mod leg;
mod lines;
mod scaled;

use twinrig_kernel::Unit;
use twinrig_robot::{RobotError, Servo};

use crate::quadruped::{Leg, Quadruped};
use leg::leg_lines;
use lines::{Lines, Origin, assumed, quantity};
use scaled::Scale;

/// A robot file made of a description.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imported {
    /// Text of the robot file, which is valid.
    pub text: String,
    /// Number of entries that follow from the description.
    pub read: usize,
    /// Number of entries that do not; their comments begin with ASSUMED.
    pub assumed: usize,
    /// Properties that the robot file cannot express, one sentence each.
    pub notes: Vec<String>,
}

/// Returns the robot file of a quadruped read from `file`.
pub(crate) fn robot_file(
    name: &str,
    file: &str,
    robot: &Quadruped,
) -> Result<Imported, RobotError> {
    let scale = Scale::of(robot)?;
    let mut lines = Lines::default();
    head(name, file, robot, &mut lines);
    trunk(robot, &mut lines);
    let kinds = kinds(robot, &scale);
    for (kind, leg) in &kinds {
        let leg = leg.text.replace("@KIND@", kind);
        lines.raw(leg.trim_end());
    }
    for (_, leg) in &kinds {
        lines.read += leg.read;
        lines.assumed += leg.assumed;
    }
    lines.raw("\n# Coordinates in the trunk frame: origin at its centre of mass, x forward, y left, z up.");
    for (index, leg) in robot.legs.iter().enumerate() {
        let own = leg_lines(leg, &scale).text;
        let kind = kinds.iter().find(|(_, kind)| kind.text == own);
        let kind = kind.map_or("aslp", |(kind, _)| kind.as_str());
        let [x, y, z] = [leg.hip.x, leg.hip.y, leg.hip.z].map(|at| quantity(at, Unit::Meter));
        let gap = if index == 0 { "" } else { "\n" };
        lines.raw(&format!(
            "{gap}[[mount]]\nname = \"{}\"\nleg = \"{kind}\"",
            leg.name
        ));
        lines.entry("hip", &format!("[{x}, {y}, {z}]"), Origin::File, "");
    }
    drives(robot, &scale, &mut lines);
    lines.raw("\n[ground]");
    lines.entry(
        "friction",
        "0.6",
        Origin::Assumed,
        "between foot and ground",
    );
    contact(&scale, &mut lines);
    Ok(Imported {
        text: lines.text,
        read: lines.read,
        assumed: lines.assumed,
        notes: robot.notes.clone(),
    })
}

/// Writes the contact of trunk, knees and ankles.
fn contact(scale: &Scale, lines: &mut Lines) {
    let Some(contact) = scale.contact() else {
        return;
    };
    lines.raw("\n[contact]");
    for (key, value, unit) in [
        ("stiffness", contact.stiffness, Unit::NewtonPerMeter),
        ("damping", contact.damping, Unit::NewtonSecondPerMeter),
        ("toe_region", contact.toe_region, Unit::Meter),
        ("slip_deflection", contact.slip_deflection, Unit::Meter),
    ] {
        lines.entry(key, &assumed(value, unit), Origin::Assumed, "");
    }
}

fn head(name: &str, file: &str, robot: &Quadruped, lines: &mut Lines) {
    let file: String = file
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    lines.raw(&format!(
        "# Made from {file} by `twin import`. Sources of the values:\n\
         #   FILE     follows from that file\n\
         #   ASSUMED  is not in it: Cheetah-cub's value (robots/cheetah-cub.toml of Twinrig), scaled by mass\n\
         #            and length of leg so that springs give alike. Replace it by yours"
    ));
    for note in &robot.notes {
        lines.raw(&format!("#\n# Note: {note}."));
    }
    let name: String = name.chars().filter(|c| !c.is_control()).collect();
    let name = name.replace('\\', "\\\\").replace('"', "\\\"");
    lines.raw(&format!("\nname = \"{name}\""));
}

fn trunk(robot: &Quadruped, lines: &mut Lines) {
    lines.raw("\n[trunk]");
    let mass = robot.trunk.mass;
    lines.entry(
        "mass",
        &quantity(mass, Unit::Kilogram),
        Origin::File,
        "without legs",
    );
    let hips = |axis: usize| {
        let at = robot.legs.iter().map(|leg| leg.hip[axis]);
        at.clone().fold(f64::MIN, f64::max) - at.fold(f64::MAX, f64::min)
    };
    let (size, from) = match robot.size {
        Some(size) => (size, Origin::File),
        None => ([hips(0), hips(1), 0.5 * hips(1)], Origin::Assumed),
    };
    let own = [0, 1, 2].map(|axis| robot.trunk.inertia[(axis, axis)]);
    let (inertia, of_box) = if own.iter().all(|moment| *moment > 0.0) {
        (own, Origin::File)
    } else {
        let [l, w, h] = size.map(|edge| edge * edge * mass / 12.0);
        ([w + h, l + h, l + w], Origin::Assumed)
    };
    let inertia = inertia.map(|moment| quantity(moment, Unit::KilogramSquareMeter));
    let note = if of_box == Origin::Assumed {
        "a uniform box"
    } else {
        ""
    };
    lines.entry(
        "inertia",
        &format!("[{}]", inertia.join(", ")),
        of_box,
        note,
    );
    let size = size.map(|edge| quantity(edge, Unit::Meter)).join(", ");
    lines.entry(
        "size",
        &format!("[{size}]"),
        from,
        "length, width, height; for pictures",
    );
}

/// Returns the different kinds of legs, with their names.
fn kinds(robot: &Quadruped, scale: &Scale) -> Vec<(String, Lines)> {
    let mut kinds: Vec<(String, Lines)> = Vec::new();
    for leg in &robot.legs {
        let lines = leg_lines(leg, scale);
        if !kinds.iter().any(|(_, kind)| kind.text == lines.text) {
            kinds.push((leg.name.to_lowercase(), lines));
        }
    }
    if let [(name, _)] = &mut kinds[..] {
        "aslp".clone_into(name);
    }
    kinds
}

fn drives(robot: &Quadruped, scale: &Scale, lines: &mut Lines) {
    type Of = fn(&Leg) -> Option<f64>;
    let joints: [(&str, Servo, Of, Of); 3] = [
        (
            "hip",
            scale.servo(0),
            |leg| leg.torque[0],
            |leg| leg.speed[0],
        ),
        (
            "knee",
            scale.servo(1),
            |leg| leg.torque[1],
            |leg| leg.speed[1],
        ),
        (
            "abduction",
            scale.servo(0),
            |leg| leg.abduction.as_ref()?.torque,
            |leg| leg.abduction.as_ref()?.speed,
        ),
    ];
    let abducts = robot.legs.iter().any(|leg| leg.abduction.is_some());
    for (joint, servo, torque, speed) in joints {
        if joint == "abduction" && !abducts {
            continue;
        }
        // Drives of all legs are equal in a robot file: the weakest is taken.
        let least = |of: Of| robot.legs.iter().filter_map(of).min_by(f64::total_cmp);
        lines.raw(&format!("\n[actuator.{joint}]"));
        let (torque, speed) = (least(torque), least(speed));
        lines.either("torque", torque, servo.torque, Unit::NewtonMeter);
        lines.either("speed", speed, servo.speed, Unit::RadianPerSecond);
        lines.either("lag", None, servo.lag, Unit::Second);
        lines.either("dead_band", None, servo.dead_band, Unit::Radian);
        lines.either("inertia", None, servo.inertia, Unit::KilogramSquareMeter);
    }
}
