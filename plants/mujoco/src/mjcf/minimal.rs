//! A leg as a chain of hinges.
//!
//! Its hinges are the thesis' q1, q2 and q3, zero in the reference pose. The diagonal's length depends on q2 alone, so its stops
//! are limits of that joint. The closed pantograph is a limit of q2 + q3; the open one a limit of the parallel rod.

use core::fmt::Write;

use twinrig_leg::Joints;

use super::shape::{SEGMENTS, Turned, write as shape};
use super::{LegModel, Sections, line, springs, triple};
use crate::model::Model;

/// What no stop is reached at: a limit for the side that has none \[rad\].
const NEVER: f64 = 10.0;

/// Writes the leg into its trunk, which is open.
pub(super) fn write(leg: &LegModel, model: &Model, to: &mut Sections) {
    let tag = &leg.tag;
    let reference = leg.pantograph.angles(0.0, Joints { q2: 0.0, q3: 0.0 });
    let mut before = 0.0;
    let mut place = leg.hip;
    for (which, (name, joint)) in SEGMENTS.iter().zip(["hip", "knee", "ankle"]).enumerate() {
        let half = 0.5 * (reference[which] - before);
        let quaternion = triple(&[libm::cos(half), 0.0, -libm::sin(half), 0.0]);
        line!(
            to.world,
            "        <body name=\"{tag}_{name}\" pos=\"{}\" quat=\"{quaternion}\">",
            triple(&place)
        );
        let damping = leg.friction[which];
        let range = match (which, model.unbounded) {
            (1, false) => format!(" range=\"{} 0\"", leg.knee_min),
            _ => String::new(),
        };
        let armature = match (which, model.drives) {
            (0, Some(drives)) => format!(" armature=\"{}\"", drives.inertias()[0]),
            _ => String::new(),
        };
        line!(
            to.world,
            "        <joint name=\"{tag}_{joint}\" axis=\"0 -1 0\" damping=\"{damping}\"{range}{armature}/>"
        );
        let upright = Turned {
            top: 0.0,
            angle: 0.0,
        };
        shape(leg, which, upright, to);
        before = reference[which];
        place = [0.0, 0.0, -leg.segments[which].length];
    }
    line!(to.world, "        </body></body></body>");
    let open = format!(" range=\"0 {}\"", leg.parallel_max);
    springs(leg, "", if model.unbounded { "" } else { &open }, to);
    if !model.unbounded {
        line!(
            to.tendons,
            "    <fixed name=\"{tag}_closed\" range=\"0 {NEVER}\">\n      <joint joint=\"{tag}_knee\" coef=\"1\"/><joint joint=\"{tag}_ankle\" coef=\"1\"/>\n    </fixed>"
        );
    }
}
