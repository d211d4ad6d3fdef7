//! A leg as a chain of hinges.
//!
//! Its hinges are the thesis' q1, q2 and q3, zero in the reference pose. The diagonal's length
//! depends on q2 alone, so its stops are limits of that joint. The stop of the closed pantograph is
//! a limit of q2 + q3; that of the open one is a limit of the parallel rod.

use core::fmt::Write;

use twinrig_robot::leg::Joints;

use super::sections::{Sections, line, triple};
use super::shape::{SEGMENTS, SegmentPlacement, write as shape};
use super::springs::springs;
use crate::model::{LegModel, Model};

/// Limit for the side without a stop, never reached \[rad\].
const UNREACHED: f64 = 10.0;

/// Writes the leg into the body element of its trunk.
pub(super) fn write(leg: &LegModel, model: &Model, to: &mut Sections) {
    let tag = &leg.tag;
    let reference = leg.pantograph.angles(0.0, Joints { q2: 0.0, q3: 0.0 });
    let mut previous = 0.0;
    let mut position = leg.hip;
    for (index, (name, joint)) in SEGMENTS.iter().zip(["hip", "knee", "ankle"]).enumerate() {
        let half = 0.5 * (reference[index] - previous);
        let quaternion = triple(&[libm::cos(half), 0.0, -libm::sin(half), 0.0]);
        line!(
            to.world,
            "        <body name=\"{tag}_{name}\" pos=\"{}\" quat=\"{quaternion}\">",
            triple(&position)
        );
        let damping = leg.friction[index];
        let range = match (index, model.without_stops) {
            (1, false) => format!(" range=\"{} 0\"", leg.knee_min),
            _ => String::new(),
        };
        let armature = match (index, model.drives) {
            (0, Some(drives)) => format!(" armature=\"{}\"", drives.inertias()[0]),
            _ => String::new(),
        };
        line!(
            to.world,
            "        <joint name=\"{tag}_{joint}\" axis=\"0 -1 0\" damping=\"{damping}\"{range}{armature}/>"
        );
        let placement = SegmentPlacement {
            top: 0.0,
            angle: 0.0,
        };
        shape(leg, index, placement, to);
        previous = reference[index];
        position = [0.0, 0.0, -leg.segments[index].length];
    }
    line!(to.world, "        </body></body></body>");
    let open = format!(" range=\"0 {}\"", leg.parallel_max);
    springs(leg, "", if model.without_stops { "" } else { &open }, to);
    if !model.without_stops {
        line!(
            to.tendons,
            "    <fixed name=\"{tag}_closed\" range=\"0 {UNREACHED}\">\n      <joint joint=\"{tag}_knee\" coef=\"1\"/><joint joint=\"{tag}_ankle\" coef=\"1\"/>\n    </fixed>"
        );
    }
}
