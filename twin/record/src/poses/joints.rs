//! Joints of the legs, as a `sensor_msgs/JointState`: those of the robot description, by name.

use twinrig_kernel::signal;

use super::Skeleton;
use super::signals::Signals;
use crate::cdr::{CdrWriter, Template};

#[derive(Debug, Clone)]
pub(super) struct Joints {
    legs: Vec<Leg>,
    message: Template,
    stamp: usize,
    /// Offset of the positions in the message.
    positions: usize,
}

/// Offsets of the angles of a leg in a sample, and the angles in the reference pose.
#[derive(Debug, Clone)]
struct Leg {
    angles: usize,
    reference: [f64; 3],
    /// Offset of the angle of abduction, if that joint moves.
    abduction: Option<usize>,
    /// Number of joints.
    joints: usize,
}

impl Joints {
    /// Creates the message of the legs whose angles are computed; `None` if there are none.
    pub(super) fn new(skeleton: &Skeleton, signals: &Signals<'_>) -> Option<Self> {
        let mut names = Vec::new();
        let mut legs = Vec::new();
        for leg in &skeleton.legs {
            let name = &leg.name;
            if let Some(angles) = signals.start(&signal::of_leg(name, signal::ANGLES), 3) {
                names.extend(leg.abduction.map(|_| format!("{name}_abduction")));
                legs.push(Leg {
                    angles,
                    reference: leg.reference,
                    abduction: leg.abduction_in(signals),
                    joints: 3 + usize::from(leg.abduction.is_some()),
                });
                names.extend(["hip", "knee", "ankle"].map(|joint| format!("{name}_{joint}")));
            }
        }
        if legs.is_empty() {
            return None;
        }
        let mut message = Template::default();
        let mut to = CdrWriter::new(&mut message.bytes);
        let stamp = to.stamp([0; 8]);
        to.text(""); // joints have no frame
        to.count(names.len());
        for name in &names {
            to.text(name);
        }
        to.count(names.len());
        let positions = to.align(8);
        to.f64s(&vec![0.0; names.len()]);
        // Neither velocities nor efforts: those of the drives are on a topic of their own.
        to.count(0);
        to.count(0);
        Some(Self {
            legs,
            message,
            stamp,
            positions,
        })
    }

    pub(super) fn at(&mut self, stamp: [u8; 8], values: &[f64]) -> &[u8] {
        self.message.put_stamp(self.stamp, stamp);
        let mut at = self.positions;
        for leg in &self.legs {
            let abduction = leg.abduction.map_or(0.0, |offset| values[offset]);
            // The angles are absolute, those of a joint relative to its parent.
            let mut parent = 0.0;
            let angles = [0, 1, 2].map(|joint| {
                let angle = values[leg.angles + joint] - leg.reference[joint];
                angle - std::mem::replace(&mut parent, angle)
            });
            let all = [abduction, angles[0], angles[1], angles[2]];
            self.message.put_all(at, &all[4 - leg.joints..]);
            at += 8 * leg.joints;
        }
        &self.message.bytes
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Direction, Layout, Port, Unit};

    use super::*;
    use crate::cdr::CdrReader;
    use crate::{SkeletonAbduction, SkeletonLeg};

    #[test]
    fn joints_are_relative_to_the_reference_pose() {
        let ports = [
            Port::output("leg/LF/hip/position", Unit::Radian, 1),
            Port::output("leg/LF/angles", Unit::Radian, 3),
            Port::output("leg/LH/abduction/position", Unit::Radian, 1),
            Port::output("leg/LH/angles", Unit::Radian, 3),
            Port::output("leg/RH/abduction/position", Unit::Radian, 1),
            Port::output("leg/RH/angles", Unit::Radian, 3),
        ];
        let layout = Layout::of(&ports, Direction::Output);
        let signals = Signals {
            layout: &layout,
            keep: &|_| false,
        };
        let leg = |name: &str| SkeletonLeg {
            name: name.to_owned(),
            hip: [0.0; 3],
            segments: [0.1; 3],
            reference: [0.25, -0.5, 0.25],
            abduction: None,
        };
        let abducting = |name: &str, is_free| SkeletonLeg {
            abduction: Some(SkeletonAbduction {
                axis: [0.0; 3],
                is_free,
            }),
            ..leg(name)
        };
        let legs = vec![
            leg("LF"),
            leg("RF"),
            abducting("LH", true),
            abducting("RH", false),
        ];
        let mut joints = Joints::new(&Skeleton { legs }, &signals).unwrap();
        let values = [
            9.0, 0.75, -0.5, 1.0, 0.25, 0.5, -0.5, 0.25, 0.125, 0.25, -0.5, 0.25,
        ];
        let mut from = CdrReader::new(joints.at([1, 0, 0, 0, 2, 0, 0, 0], &values)).unwrap();
        assert_eq!(
            (from.time(), from.text().as_deref()),
            (Some([1, 2]), Some(""))
        );
        let names = from.each(CdrReader::text).unwrap();
        let of = |leg: &str| ["abduction", "hip", "knee", "ankle"].map(|it| format!("{leg}_{it}"));
        assert_eq!(names, [&of("LF")[1..], &of("LH"), &of("RH")].concat());
        let mut column = || from.each(CdrReader::f64).unwrap();
        assert_eq!(
            column(),
            [0.5, -0.5, 0.75, 0.25, 0.25, -0.25, 0.0, 0.0, 0.0, 0.0, 0.0]
        );
        assert_eq!((column(), column()), (vec![], vec![]));
        assert!(from.is_at_end());
        assert!(Joints::new(&Skeleton::default(), &signals).is_none());
    }
}
