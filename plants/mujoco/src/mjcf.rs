//! The robot as MJCF, MuJoCo's modelling language, to compile here or to export.

mod drives;
mod ground;
mod maximal;
mod minimal;
mod sections;
mod shape;
mod springs;

use core::fmt::Write;

use twinrig_legged::{Base, Posture};
use twinrig_robot::{AbductionAxis, GRAVITY, Robot};

use self::sections::{Sections, line, triple};
use self::shape::contact_point;
use crate::addresses::corner_name;
use crate::model::{LegModel, Model, escaped};
use crate::options::{Coordinates, MujocoError, Numerics, Options, TimeConstant};

/// Returns the robot as a readable MJCF model in one file, as the plant [`Mujoco`](crate::Mujoco)
/// compiles it. SI units and radians; names of the bodies and joints of the leg `LF` begin with
/// `LF_`.
///
/// # Errors
/// [`MujocoError`] if robot and options do not fit together.
pub fn mjcf(robot: &Robot, options: &Options) -> Result<String, MujocoError> {
    Ok(write_model(robot, &Model::new(robot, options)?))
}

/// Impedance of clutches, MuJoCo's maximum \[1\].
const CLUTCH_IMPEDANCE: f64 = 0.9999;

pub(crate) fn write_model(robot: &Robot, model: &Model) -> String {
    let mut to = Sections::default();
    if let Some(ground) = &model.ground {
        ground::write(ground, &mut to);
    }
    trunk(robot, model, &mut to);
    for leg in &model.legs {
        drives::write(leg, model, &mut to);
    }
    let mut text = String::new();
    line!(text, "<mujoco model=\"{}\">", escaped(&robot.name));
    line!(
        text,
        "  <!-- SI units. A leg's angles are zero where a segment points straight down, positive forward. -->"
    );
    line!(text, "  <compiler angle=\"radian\" autolimits=\"true\"/>");
    text.push_str(&options(&model.numerics, model.step_s));
    for (name, section) in [
        ("asset", &to.assets),
        ("worldbody", &to.world),
        ("equality", &to.equalities),
        ("tendon", &to.tendons),
        ("actuator", &to.actuators),
    ] {
        if !section.is_empty() {
            line!(text, "  <{name}>\n{section}  </{name}>");
        }
    }
    text.push_str("</mujoco>\n");
    text
}

/// Returns the integrator, the solver and the softness of constraints.
fn options(numerics: &Numerics, step_s: f64) -> String {
    let Numerics {
        integrator,
        solver,
        iterations,
        tolerance,
        cone,
        impratio,
        ..
    } = numerics;
    let (integrator, solver, cone) = (integrator.keyword(), solver.keyword(), cone.name());
    let jacobian = if numerics.sparse { "sparse" } else { "dense" };
    let mut text = String::new();
    line!(
        text,
        "  <option timestep=\"{step_s}\" gravity=\"0 0 -{GRAVITY}\" integrator=\"{integrator}\" solver=\"{solver}\" \
         iterations=\"{iterations}\" ls_iterations=\"50\" tolerance=\"{tolerance}\" cone=\"{cone}\" impratio=\"{impratio}\" \
         jacobian=\"{jacobian}\">"
    );
    let refsafe = if numerics.refsafe {
        "enable"
    } else {
        "disable"
    };
    let island = if numerics.islands {
        ""
    } else {
        " island=\"disable\""
    };
    line!(
        text,
        "    <flag refsafe=\"{refsafe}\" autoreset=\"disable\"{island}/>"
    );
    line!(text, "  </option>");
    let seconds = match numerics.closing {
        TimeConstant::Steps(steps) => steps * step_s,
        TimeConstant::Seconds(seconds) => seconds,
    };
    let [first, last] = numerics.impedance;
    let reference = format!("{seconds} {}", numerics.damping);
    let impedance = format!("{first} {last} {}", numerics.width);
    let both = |kind: &str| format!("solref{kind}=\"{reference}\" solimp{kind}=\"{impedance}\"");
    let contact = numerics.contact_damping;
    let [contact_first, contact_last] = numerics.contact_impedance;
    line!(text, "  <default>");
    line!(text, "    <joint {}/>", both("limit"));
    // Clutches do not creep: in the dead band of a servo the creep would not be corrected.
    line!(
        text,
        "    <tendon {} solreffriction=\"{reference}\" solimpfriction=\"{CLUTCH_IMPEDANCE} {CLUTCH_IMPEDANCE} {}\"/>",
        both("limit"),
        numerics.width
    );
    line!(
        text,
        "    <equality solref=\"{seconds} {}\" solimp=\"{impedance}\"/>",
        numerics.pin_damping
    );
    line!(
        text,
        "    <geom solref=\"{seconds} {contact}\" solimp=\"{contact_first} {contact_last} {}\" condim=\"3\"/>",
        numerics.width
    );
    line!(text, "  </default>");
    text
}

/// Writes the trunk with its legs.
fn trunk(robot: &Robot, model: &Model, to: &mut Sections) {
    let Posture { position, .. } = &model.start;
    line!(
        to.world,
        "    <body name=\"trunk\" pos=\"{}\">",
        triple(position.as_slice())
    );
    match model.base {
        Base::Free => {
            line!(to.world, "      <freejoint name=\"trunk\"/>");
        }
        Base::Planar => {
            for (name, kind, axis) in [
                ("trunk_x", "slide", "1 0 0"),
                ("trunk_z", "slide", "0 0 1"),
                ("trunk_pitch", "hinge", "0 1 0"),
            ] {
                line!(
                    to.world,
                    "      <joint name=\"{name}\" type=\"{kind}\" axis=\"{axis}\"/>"
                );
            }
        }
        Base::Fixed => {}
    }
    let trunk = &robot.trunk;
    if model.base != Base::Fixed {
        line!(to.world, "      <inertial {}/>", inertial(model));
    }
    let half = trunk.size.map(|size| 0.5 * size);
    if half.iter().all(|half| *half > 0.0) {
        line!(
            to.world,
            "      <geom name=\"trunk\" type=\"box\" size=\"{}\" mass=\"0\" contype=\"0\" conaffinity=\"0\" group=\"1\"/>",
            triple(&half)
        );
    }
    let friction = model.ground.as_ref().map(|ground| ground.ground.friction);
    for (index, corner) in model.corners.iter().enumerate() {
        let (name, friction) = (corner_name(index), friction.unwrap_or_default());
        to.world.push_str(&contact_point(&name, corner, friction));
    }
    for leg in &model.legs {
        if let Some(axis) = &leg.abduction {
            begin_carrier(leg, axis, model, to);
        }
        line!(
            to.world,
            "      <site name=\"{}_hip\" pos=\"{}\"/>",
            leg.tag,
            triple(&leg.hip)
        );
        match model.coordinates {
            Coordinates::Minimal => minimal::write(leg, model, to),
            Coordinates::Maximal => maximal::write(leg, model, to),
        }
        if leg.abduction.is_some() {
            line!(to.world, "      </body>");
        }
    }
    line!(to.world, "    </body>");
}

/// Begins the body that carries a leg that abducts. It has no mass, of which MuJoCo requires some.
fn begin_carrier(leg: &LegModel, axis: &AbductionAxis, model: &Model, to: &mut Sections) {
    const MASS: f64 = 1e-14;
    let (tag, [left, up], [least, greatest]) = (&leg.tag, axis.place, axis.range);
    let [.., inertia] = model.drive_inertias();
    let range = if model.without_stops {
        String::new()
    } else {
        format!(" range=\"{least} {greatest}\"")
    };
    line!(
        to.world,
        "      <body name=\"{tag}_abduction\" pos=\"0 {left} {up}\">\n        \
         <joint name=\"{tag}_abduction\" axis=\"1 0 0\" damping=\"{}\" armature=\"{inertia}\"{range}/>\n        \
         <inertial pos=\"0 0 0\" mass=\"{MASS}\" diaginertia=\"{MASS} {MASS} {MASS}\"/>",
        axis.friction
    );
}

/// Returns mass, centre of mass and inertia of the trunk with its payloads.
fn inertial(model: &Model) -> String {
    let (mass, inertia) = (model.trunk_mass, model.trunk_inertia);
    let Some(payload) = &model.payload else {
        return format!(
            "pos=\"0 0 0\" mass=\"{mass}\" diaginertia=\"{}\"",
            triple(&inertia)
        );
    };
    let total = mass + payload.mass;
    let centre = payload.moment.map(|moment| moment / total);
    let [x, y, z] = centre;
    let square = x * x + y * y + z * z;
    let added = payload.inertia();
    let about = |i: usize, j: usize| {
        let (own, shift) = if i == j {
            (inertia[i], square)
        } else {
            (0.0, 0.0)
        };
        own + added[i][j] - total * (shift - centre[i] * centre[j])
    };
    let entries = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(i, j)| about(i, j));
    format!(
        "pos=\"{}\" mass=\"{total}\" fullinertia=\"{}\"",
        triple(&centre),
        triple(&entries)
    )
}
