//! A leg as three bodies connected by pins.
//!
//! A thin rod has no axial inertia, so that a body of six degrees of freedom would be singular. A
//! leg moves in a plane of its trunk: each segment is a free body in that plane, with two slides
//! and a hinge from the trunk. Three coordinates for each of twelve segments make 36 on a fixed
//! trunk. The rods of the pantograph are massless springs, whose stops are limits of their length.

use core::fmt::Write;

use twinrig_robot::leg::Joints;

use super::sections::{Sections, line, triple};
use super::shape::{SEGMENTS, SegmentPlacement, write as shape};
use super::springs::springs;
use crate::model::{LegModel, Model};

/// Writes the leg into the body element of its trunk.
pub(super) fn write(leg: &LegModel, model: &Model, to: &mut Sections) {
    let tag = &leg.tag;
    let reference = leg.pantograph.angles(0.0, Joints { q2: 0.0, q3: 0.0 });
    let mut joint = [leg.hip[0], leg.hip[2]];
    for (index, name) in SEGMENTS.iter().enumerate() {
        let angle = reference[index];
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let segment = leg.segments[index];
        let centre = [
            joint[0] + segment.centre * sine,
            joint[1] - segment.centre * cosine,
        ];
        let position = triple(&[centre[0], leg.hip[1], centre[1]]);
        // The body's frame has the trunk's orientation, so that slides and hinge have the trunk's
        // axes.
        line!(
            to.world,
            "      <body name=\"{tag}_{name}\" pos=\"{position}\">"
        );
        for (axis, along, from) in [("x", "1 0 0", centre[0]), ("z", "0 0 1", centre[1])] {
            line!(
                to.world,
                "        <joint name=\"{tag}_{name}_{axis}\" type=\"slide\" axis=\"{along}\" ref=\"{from}\"/>"
            );
        }
        let (damping, armature) = match (index, model.drives) {
            (0, Some(drives)) => (leg.friction[0], drives.inertias()[0]),
            (0, None) => (leg.friction[0], 0.0),
            _ => (0.0, 0.0),
        };
        line!(
            to.world,
            "        <joint name=\"{tag}_{name}_turn\" axis=\"0 -1 0\" ref=\"{angle}\" damping=\"{damping}\" armature=\"{armature}\"/>"
        );
        let placement = SegmentPlacement {
            top: -segment.centre,
            angle,
        };
        shape(leg, index, placement, to);
        line!(to.world, "      </body>");
        joint[0] += segment.length * sine;
        joint[1] -= segment.length * cosine;
    }
    pins(leg, to);
    let range = |minimum: f64, maximum: f64| format!(" range=\"{minimum} {maximum}\"");
    let (diagonal, parallel) = if model.without_stops {
        (String::new(), String::new())
    } else {
        (
            range(leg.diagonal_min, leg.diagonal_max),
            range(leg.parallel_min, leg.parallel_max),
        )
    };
    springs(leg, &diagonal, &parallel, to);
    for (index, joint) in [(1, "knee"), (2, "ankle")] {
        let (above, below) = (SEGMENTS[index - 1], SEGMENTS[index]);
        line!(
            to.tendons,
            "    <fixed name=\"{tag}_{joint}_friction\" damping=\"{}\">\n      <joint joint=\"{tag}_{below}_turn\" coef=\"1\"/><joint joint=\"{tag}_{above}_turn\" coef=\"-1\"/>\n    </fixed>",
            leg.friction[index]
        );
    }
}

fn pins(leg: &LegModel, to: &mut Sections) {
    let tag = &leg.tag;
    for joint in ["hip", "knee", "ankle"] {
        line!(
            to.equalities,
            "    <connect name=\"{tag}_{joint}_pin\" site1=\"{tag}_{joint}\" site2=\"{tag}_{joint}_below\"/>"
        );
    }
}
