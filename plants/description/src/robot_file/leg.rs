//! Tables of a leg.

use twinrig_kernel::Unit;

use super::lines::{Lines, Origin, assumed, quantity};
use super::scaled::Scale;
use crate::quadruped::Leg;

/// Returns the tables of a leg, whose name is `@KIND@`.
pub(super) fn leg_lines(leg: &Leg, scale: &Scale) -> Lines {
    let mut lines = Lines::default();
    let from = |is_assumed: bool| {
        if is_assumed {
            Origin::Assumed
        } else {
            Origin::File
        }
    };
    let metre = |length: f64| quantity(length, Unit::Meter);
    let [l1, l2, b] = leg.lengths;
    let half = if leg.is_divided {
        "half of the first segment"
    } else {
        ""
    };
    let named = |own: &str| format!("{own}{}{half}", if half.is_empty() { "" } else { ", " });
    lines.raw("\n[leg.@KIND@]");
    let divided = from(leg.is_divided);
    lines.entry("l1", &metre(l1), divided, &named("hip to knee"));
    lines.entry("l2", &metre(l2), Origin::File, "knee to ankle");
    let offset = from(leg.is_l_delta_assumed);
    lines.entry(
        "l3",
        &metre(leg.l_delta + b),
        offset,
        &named("l_delta + ankle to foot"),
    );
    lines.entry(
        "l_delta",
        &metre(leg.l_delta),
        offset,
        "rod to knee, and rod to ankle",
    );
    let bend = &leg.bend;
    let stretched = quantity(bend.stretched, Unit::Radian);
    lines.entry(
        "q2_ref",
        &stretched,
        from(bend.is_stretched_assumed),
        "of the stretched leg",
    );
    let springs = scale.springs(leg);
    for (key, spring) in [
        ("diagonal", springs.diagonal),
        ("parallel", springs.parallel),
    ] {
        let stiffness = assumed(spring.stiffness, Unit::NewtonPerMeter);
        let preload = assumed(spring.preload, Unit::Meter);
        let value = format!("{{ stiffness = {stiffness}, preload = {preload} }}");
        lines.entry(key, &value, Origin::Assumed, "");
    }
    let travel = assumed(springs.parallel_travel, Unit::Meter);
    lines.entry(
        "parallel_travel",
        &travel,
        Origin::Assumed,
        "greatest opening of the rod",
    );
    let folded = from(bend.is_bottomed_assumed || leg.is_l_delta_assumed);
    let note = format!("where the knee is at {:.1}°", bend.bottomed.to_degrees());
    lines.entry("diagonal_min", &metre(springs.diagonal_min), folded, &note);
    let pulley = assumed(scale.length(scale.base.pulley_radius), Unit::Meter);
    lines.entry("pulley_radius", &pulley, Origin::Assumed, "");
    friction(leg, scale, &mut lines);
    abduction(leg, scale, &mut lines);
    masses(leg, scale, &mut lines);
    compliance(scale, &mut lines);
    lines
}

fn friction(leg: &Leg, scale: &Scale, lines: &mut Lines) {
    lines.raw("\n[leg.@KIND@.joint_friction]");
    let friction = scale.friction();
    let joints = ["hip", "knee", "ankle"]
        .into_iter()
        .zip(leg.damping)
        .zip(friction);
    for ((joint, damping), scaled) in joints {
        lines.either(joint, damping, scaled, Unit::NewtonMeterSecondPerRadian);
    }
    lines.either("toe", None, friction[2], Unit::NewtonMeterSecondPerRadian);
}

fn abduction(leg: &Leg, scale: &Scale, lines: &mut Lines) {
    let Some(joint) = &leg.abduction else {
        return;
    };
    lines.raw("\n[leg.@KIND@.abduction]");
    for (key, value, unit, note) in [
        (
            "offset",
            joint.offset,
            Unit::Meter,
            "of the axis, inwards of the hip",
        ),
        (
            "height",
            joint.height,
            Unit::Meter,
            "of the axis above the hip",
        ),
        ("abduction_max", joint.outwards, Unit::Radian, "outwards"),
        ("adduction_max", joint.inwards, Unit::Radian, "inwards"),
    ] {
        lines.entry(key, &quantity(value, unit), Origin::File, note);
    }
    let [of_hip, ..] = scale.friction();
    let unit = Unit::NewtonMeterSecondPerRadian;
    lines.either("friction", joint.friction, of_hip, unit);
}

fn masses(leg: &Leg, scale: &Scale, lines: &mut Lines) {
    let base = scale.base.mass;
    lines.raw("\n[leg.@KIND@.mass]");
    let [first, second, third] = leg.masses;
    // Of a segment whose centre of mass says nothing of a foot, as much as of Cheetah-cub's.
    let share = base.foot / (base.foot + base.l3);
    let last = if leg.is_divided { second } else { third };
    let (foot, foot_from) = match leg.foot {
        Some(foot) => (foot, Origin::File),
        None => (share * last, Origin::Assumed),
    };
    let less = if leg.foot.is_some() { 0.0 } else { foot };
    let (second, third) = if leg.is_divided {
        (second - less, third)
    } else {
        (second, third - less)
    };
    let halves = if leg.is_divided {
        Origin::Assumed
    } else {
        Origin::File
    };
    let gram = |mass: f64| quantity(mass, Unit::Kilogram);
    lines.entry("l1", &gram(first), halves, "");
    let (of_second, of_third) = if leg.is_divided {
        (foot_from, Origin::Assumed)
    } else {
        (Origin::File, foot_from)
    };
    lines.entry("l2", &gram(second), of_second, "");
    lines.entry("l3", &gram(third), of_third, "");
    let note = "from the centre of mass of the last segment";
    let note = if foot_from == Origin::File { note } else { "" };
    lines.entry("foot", &gram(foot), foot_from, note);
    let lumped = base.lumped_foot / base.total() * (first + second + third + foot);
    lines.entry(
        "lumped_foot",
        &assumed(lumped, Unit::Kilogram),
        Origin::Assumed,
        "foot of a massless leg",
    );
}

fn compliance(scale: &Scale, lines: &mut Lines) {
    let Some(compliance) = scale.compliance() else {
        return;
    };
    lines.raw("\n[leg.@KIND@.compliance]");
    for (key, side) in [
        ("stops", compliance.stops),
        ("cable", compliance.cable),
        ("sole", compliance.sole),
    ] {
        let stiffness = assumed(side.stiffness, Unit::NewtonPerMeter);
        let damping = assumed(side.damping, Unit::NewtonSecondPerMeter);
        let depth = assumed(side.toe_region, Unit::Meter);
        let value =
            format!("{{ stiffness = {stiffness}, damping = {damping}, toe_region = {depth} }}");
        lines.entry(key, &value, Origin::Assumed, "");
    }
    let slip = assumed(compliance.slip_deflection, Unit::Meter);
    lines.entry("slip_deflection", &slip, Origin::Assumed, "");
}
