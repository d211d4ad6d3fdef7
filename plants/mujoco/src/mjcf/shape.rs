//! What a segment is, however it is hung up.

use core::fmt::Write;

use twinrig_legged::Segment;

use super::{LegModel, Sections, line, triple};
use crate::model::FOOT_RADIUS;

/// The three segments from the hip down.
pub(super) const SEGMENTS: [&str; 3] = ["upper", "middle", "lower"];

/// A rod has no inertia about itself, and MuJoCo no body without: this much is none \[kg·m²\].
const NEXT_TO_NOTHING: f64 = 1e-14;

/// Inertia, looks and sites of a segment, in a frame whose z points up the segment and in which the joint above it is at
/// `top`.
pub(super) fn write(leg: &LegModel, which: usize, turned: Turned, to: &mut Sections) {
    let Segment {
        length,
        above,
        mass,
        centre,
        moment,
    } = leg.segments[which];
    let tag = &leg.tag;
    let at = |along: f64| triple(&turned.at(along));
    line!(
        to.world,
        "        <inertial pos=\"{}\" quat=\"{}\" mass=\"{mass}\" diaginertia=\"{moment} {moment} {NEXT_TO_NOTHING}\"/>",
        at(centre),
        turned.quaternion()
    );
    line!(
        to.world,
        "        <geom type=\"capsule\" fromto=\"{} {}\" size=\"0.003\" mass=\"0\" contype=\"0\" conaffinity=\"0\" group=\"1\"/>",
        at(-above),
        at(length)
    );
    let sites: &[(&str, f64)] = &match which {
        0 => [("inner", length - leg.l_delta), ("knee", length)],
        1 => [("knee_below", 0.0), ("ankle", length)],
        _ => [("ankle_below", 0.0), ("outer", -above)],
    };
    for (name, along) in sites {
        line!(
            to.world,
            "        <site name=\"{tag}_{name}\" pos=\"{}\"/>",
            at(*along)
        );
    }
    if which == 0 {
        line!(
            to.world,
            "        <site name=\"{tag}_hip_below\" pos=\"{}\"/>",
            at(0.0)
        );
    }
    if which == 2 {
        line!(
            to.world,
            "        <site name=\"{tag}_foot\" pos=\"{}\"/>",
            at(length)
        );
        if let Some(friction) = leg.friction_on_ground {
            line!(
                to.world,
                "        <geom name=\"{tag}_foot\" type=\"sphere\" pos=\"{}\" size=\"{FOOT_RADIUS}\" mass=\"0\" \
                 friction=\"{friction} 0 0\" contype=\"1\" conaffinity=\"0\"/>",
                at(length)
            );
        }
    }
}

/// A segment as it is drawn in its body's frame: where the joint above it is, seen from the frame's origin along the segment,
/// and the segment's angle in the frame.
#[derive(Clone, Copy)]
pub(super) struct Turned {
    /// Along the segment from the frame's origin to the joint above \[m\].
    pub(super) top: f64,
    /// Of the segment in the frame \[rad\].
    pub(super) angle: f64,
}

impl Turned {
    /// The point that is so far along the segment from the joint above it.
    fn at(self, along: f64) -> [f64; 3] {
        let far = self.top + along;
        [
            far * libm::sin(self.angle),
            0.0,
            -far * libm::cos(self.angle),
        ]
    }

    /// About −y.
    fn quaternion(self) -> String {
        let half = 0.5 * self.angle;
        triple(&[libm::cos(half), 0.0, -libm::sin(half), 0.0])
    }
}
