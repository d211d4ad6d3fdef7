//! Segments: inertia, shape and sites, in the frame of their body.

use core::fmt::Write;

use twinrig_legged::Segment;

use super::sections::{Sections, line, triple};
use crate::model::{FOOT_RADIUS, LegModel};

/// The three segments from the hip down.
pub(super) const SEGMENTS: [&str; 3] = ["upper", "middle", "lower"];

/// Axial moment of inertia: a thin rod has none, but MuJoCo requires a positive one \[kg·m²\].
const AXIAL_MOMENT: f64 = 1e-14;

/// Writes inertia, shape and sites of a segment.
pub(super) fn write(leg: &LegModel, index: usize, placement: SegmentPlacement, to: &mut Sections) {
    let Segment {
        length,
        above,
        mass,
        centre,
        moment,
    } = leg.segments[index];
    let tag = &leg.tag;
    let at = |along: f64| triple(&placement.at(along));
    line!(
        to.world,
        "        <inertial pos=\"{}\" quat=\"{}\" mass=\"{mass}\" diaginertia=\"{moment} {moment} {AXIAL_MOMENT}\"/>",
        at(centre),
        placement.quaternion()
    );
    line!(
        to.world,
        "        <geom type=\"capsule\" fromto=\"{} {}\" size=\"0.003\" mass=\"0\" contype=\"0\" conaffinity=\"0\" group=\"1\"/>",
        at(-above),
        at(length)
    );
    let sites: &[(&str, f64)] = &match index {
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
    if index == 0 {
        line!(
            to.world,
            "        <site name=\"{tag}_hip_below\" pos=\"{}\"/>",
            at(0.0)
        );
    }
    if let (Some(friction), true, Some(joint)) = (
        leg.friction_on_ground,
        leg.has_segment_contact,
        ["knee", "ankle"].get(index),
    ) {
        let point = contact_point(&format!("{tag}_{joint}"), &placement.at(length), friction);
        to.world.push_str(&point);
    }
    if index == 2 {
        line!(
            to.world,
            "        <site name=\"{tag}_foot\" pos=\"{}\"/>",
            at(length)
        );
        if let Some(friction) = leg.friction_on_ground {
            let point = contact_point(&format!("{tag}_foot"), &placement.at(length), friction);
            to.world.push_str(&point);
        }
    }
}

/// Returns the geom of a contact point.
pub(super) fn contact_point(name: &str, place: &[f64], friction: f64) -> String {
    let place = triple(place);
    format!(
        "        <geom name=\"{name}\" type=\"sphere\" pos=\"{place}\" size=\"{FOOT_RADIUS}\" mass=\"0\" \
         friction=\"{friction} 0 0\" contype=\"1\" conaffinity=\"0\"/>\n"
    )
}

/// Placement of a segment in the frame of its body.
#[derive(Clone, Copy)]
pub(super) struct SegmentPlacement {
    /// Distance along the segment from the frame's origin to the joint above \[m\].
    pub(super) top: f64,
    /// Angle of the segment in the frame \[rad\].
    pub(super) angle: f64,
}

impl SegmentPlacement {
    /// Returns the point at a distance along the segment from the joint above it.
    fn at(self, along: f64) -> [f64; 3] {
        let distance = self.top + along;
        [
            distance * libm::sin(self.angle),
            0.0,
            -distance * libm::cos(self.angle),
        ]
    }

    /// Returns the rotation about −y.
    fn quaternion(self) -> String {
        let half = 0.5 * self.angle;
        triple(&[libm::cos(half), 0.0, -libm::sin(half), 0.0])
    }
}
