//! A leg as three bodies that pins hold together.
//!
//! A thin rod has no inertia about itself, so a body of six degrees of freedom would be singular. A leg moves in a plane of its
//! trunk: each segment is a body that moves freely in that plane, by two slides and a hinge from the trunk. Three coordinates
//! for each of twelve segments make 36 on a trunk that is held. The rods of the pantograph are springs without mass, whose
//! stops are limits of their length.

use core::fmt::Write;

use twinrig_leg::Joints;

use super::shape::{SEGMENTS, Turned, write as shape};
use super::{LegModel, Sections, line, springs, triple};
use crate::model::Model;

/// Writes the leg into its trunk, which is open.
pub(super) fn write(leg: &LegModel, model: &Model, to: &mut Sections) {
    let tag = &leg.tag;
    let reference = leg.pantograph.angles(0.0, Joints { q2: 0.0, q3: 0.0 });
    let mut joint = [leg.hip[0], leg.hip[2]];
    for (which, name) in SEGMENTS.iter().enumerate() {
        let angle = reference[which];
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let segment = leg.segments[which];
        let centre = [
            joint[0] + segment.centre * sine,
            joint[1] - segment.centre * cosine,
        ];
        let place = triple(&[centre[0], leg.hip[1], centre[1]]);
        // The frame stands upright in the trunk, so that slides and hinge have the trunk's axes.
        line!(
            to.world,
            "      <body name=\"{tag}_{name}\" pos=\"{place}\">"
        );
        for (axis, along, from) in [("x", "1 0 0", centre[0]), ("z", "0 0 1", centre[1])] {
            line!(
                to.world,
                "        <joint name=\"{tag}_{name}_{axis}\" type=\"slide\" axis=\"{along}\" ref=\"{from}\"/>"
            );
        }
        let (damping, armature) = match (which, model.drives) {
            (0, Some(drives)) => (leg.friction[0], drives.inertias()[0]),
            (0, None) => (leg.friction[0], 0.0),
            _ => (0.0, 0.0),
        };
        line!(
            to.world,
            "        <joint name=\"{tag}_{name}_turn\" axis=\"0 -1 0\" ref=\"{angle}\" damping=\"{damping}\" armature=\"{armature}\"/>"
        );
        let centred = Turned {
            top: -segment.centre,
            angle,
        };
        shape(leg, which, centred, to);
        line!(to.world, "      </body>");
        joint[0] += segment.length * sine;
        joint[1] -= segment.length * cosine;
    }
    pins(leg, to);
    let between = |least: f64, most: f64| format!(" range=\"{least} {most}\"");
    let (diagonal, parallel) = if model.unbounded {
        (String::new(), String::new())
    } else {
        (
            between(leg.diagonal_min, leg.diagonal_max),
            between(leg.parallel_min, leg.parallel_max),
        )
    };
    springs(leg, &diagonal, &parallel, to);
    for (which, joint) in [(1, "knee"), (2, "ankle")] {
        let (above, below) = (SEGMENTS[which - 1], SEGMENTS[which]);
        line!(
            to.tendons,
            "    <fixed name=\"{tag}_{joint}_friction\" damping=\"{}\">\n      <joint joint=\"{tag}_{below}_turn\" coef=\"1\"/><joint joint=\"{tag}_{above}_turn\" coef=\"-1\"/>\n    </fixed>",
            leg.friction[which]
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
