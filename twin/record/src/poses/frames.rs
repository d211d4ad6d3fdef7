//! Coordinate frames of trunk and leg segments, as a `tf2_msgs/TFMessage`.

use super::signals::Signals;
use crate::cdr::{CdrReader, CdrWriter, Template};
use twinrig_kernel::signal;

/// Fixed frame.
pub(super) const WORLD: &str = "world";
/// Frame of the trunk.
pub(super) const TRUNK: &str = "trunk";
/// Last parts of the names of the frames that abduct, and of the upper segments.
pub(super) const ABDUCTOR: &str = "abductor";
pub(super) const UPPER: &str = "upper";

/// Geometry of a robot for display: hip positions and segment lengths.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skeleton {
    /// Legs of the robot.
    pub legs: Vec<SkeletonLeg>,
}

/// A leg of a [`Skeleton`].
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonLeg {
    /// Name of the leg, as in its signals: `LF` for `leg/LF/angles`.
    pub name: String,
    /// Position of the hip in the trunk frame: x forward, y left, z up \[m\].
    pub hip: [f64; 3],
    /// Lengths from hip to knee, knee to ankle, ankle to foot \[m\].
    pub segments: [f64; 3],
    /// Absolute angles of the segments in the reference pose, in which the joints are zero \[rad\].
    pub reference: [f64; 3],
    /// Joint of abduction between trunk and hip, if the leg has one.
    pub abduction: Option<SkeletonAbduction>,
}

/// Joint of abduction of a leg, about the x axis of the trunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkeletonAbduction {
    /// Point of its axis beside the hip, in the trunk frame \[m\].
    pub axis: [f64; 3],
    /// Whether it moves, as the signal `leg/X/abduction/position` says; otherwise it is at zero.
    pub is_free: bool,
}

impl SkeletonLeg {
    /// Returns the offset of the angle of abduction, if the joint moves.
    pub(super) fn abduction_in(&self, signals: &Signals<'_>) -> Option<usize> {
        self.abduction.filter(|joint| joint.is_free)?;
        signals.start(&signal::of_leg(&self.name, signal::ABDUCTION_POSITION), 1)
    }
}

const IDENTITY: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Frames world → trunk, and for each leg with recorded angles trunk → abductor, if the leg has
/// such a joint, → upper, middle and lower segment, each at its upper joint, → foot: the links of
/// the robot description, by their names.
#[derive(Debug, Clone)]
pub(super) struct Frames {
    position: Option<usize>,
    orientation: Option<usize>,
    legs: Vec<LegFrames>,
    message: Template,
    transforms: Vec<Transform>,
}

/// Frames of a leg.
#[derive(Debug, Clone, Copy)]
struct LegFrames {
    /// Offset of the angles of the segments in a sample.
    angles: usize,
    /// Index of the transform of the upper segment, which the others follow.
    upper: usize,
    /// Offset of the angle of abduction in a sample, if the joint moves. Its transform is before
    /// that of the upper segment.
    abduction: Option<usize>,
}

/// Offsets of a transform in the message.
#[derive(Debug, Clone, Copy)]
struct Transform {
    stamp: usize,
    translation: usize,
    /// x, y, z, w
    rotation: usize,
}

impl Frames {
    pub(super) fn new(skeleton: &Skeleton, signals: &Signals<'_>) -> Self {
        let mut links = vec![(WORLD.to_owned(), TRUNK.to_owned(), [0.0; 3])];
        let mut legs = Vec::new();
        for leg in &skeleton.legs {
            let name = &leg.name;
            let Some(angles) = signals.start(&signal::of_leg(name, signal::ANGLES), 3) else {
                continue;
            };
            let mut parent = TRUNK.to_owned();
            let mut hip = leg.hip;
            if let Some(SkeletonAbduction { axis, .. }) = leg.abduction {
                let child = format!("{name}_{ABDUCTOR}");
                links.push((parent, child.clone(), axis));
                parent = child;
                hip = [0, 1, 2].map(|n| hip[n] - axis[n]);
            }
            legs.push(LegFrames {
                angles,
                upper: links.len(),
                abduction: leg.abduction_in(signals),
            });
            let [upper, middle, lower] = leg.segments.map(|length| [0.0, 0.0, -length]);
            for (link, at) in [
                (UPPER, hip),
                ("middle", upper),
                ("lower", middle),
                ("foot", lower),
            ] {
                let child = format!("{name}_{link}");
                links.push((parent, child.clone(), at));
                parent = child;
            }
        }
        let mut message = Template::default();
        let mut to = CdrWriter::new(&mut message.bytes);
        to.count(links.len());
        let transform = |(parent, child, at): (String, String, [f64; 3])| {
            let stamp = to.stamp([0; 8]);
            to.text(&parent);
            to.text(&child);
            let translation = to.align(8);
            to.f64s(&at);
            let rotation = to.align(8);
            to.f64s(&IDENTITY);
            Transform {
                stamp,
                translation,
                rotation,
            }
        };
        let transforms = links.into_iter().map(transform).collect();
        Self {
            position: signals.start(signal::BODY_POSITION, 3),
            orientation: signals.start(signal::BODY_ORIENTATION, 4),
            legs,
            message,
            transforms,
        }
    }

    /// Returns the frames of a sample of the plant.
    pub(super) fn at(&mut self, stamp: [u8; 8], values: &[f64]) -> &[u8] {
        let message = &mut self.message;
        for transform in &self.transforms {
            message.put_stamp(transform.stamp, stamp);
        }
        let body = self.transforms[0];
        if let Some(start) = self.position {
            message.put_all(body.translation, &values[start..start + 3]);
        }
        if let Some(start) = self.orientation {
            let [w, x, y, z] = [0, 1, 2, 3].map(|n| values[start + n]);
            message.put_all(body.rotation, &[x, y, z, w]);
        }
        for leg in &self.legs {
            if let Some(abduction) = leg.abduction {
                let (sin, cos) = libm::sincos(0.5 * values[abduction]);
                let rotation = self.transforms[leg.upper - 1].rotation;
                message.put_all(rotation, &[sin, 0.0, 0.0, cos]);
            }
            // The angles are absolute; the rotation of a child frame is relative to its parent.
            let mut parent = 0.0;
            for joint in 0..3 {
                let angle = values[leg.angles + joint];
                let rotation = self.transforms[leg.upper + joint].rotation;
                message.put_all(rotation, &segment_rotation(angle - parent));
                parent = angle;
            }
        }
        &message.bytes
    }
}

/// Returns the rotation of a segment that hangs vertically at 0 and forward at positive `angle`
/// \[rad\]: a rotation by −angle about y, which points left.
fn segment_rotation(angle: f64) -> [f64; 4] {
    let (sin, cos) = libm::sincos(-0.5 * angle);
    [0.0, sin, 0.0, cos]
}

/// A transform of a message.
pub(super) struct ReadTransform {
    /// Names of parent and child.
    pub(super) link: [String; 2],
    /// Position x, y, z and orientation x, y, z, w of the child in its parent.
    pub(super) numbers: [f64; 7],
}

/// Decodes a message; `None` if it is invalid.
pub(super) fn transforms(message: &[u8]) -> Option<Vec<ReadTransform>> {
    let mut from = CdrReader::new(message)?;
    let transforms = from.each(|from| {
        from.time()?;
        Some(ReadTransform {
            link: [from.text()?, from.text()?],
            numbers: from.f64s()?,
        })
    })?;
    from.is_at_end().then_some(transforms)
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Direction, Layout, Port, Unit};

    use super::*;

    fn leg() -> Skeleton {
        let leg = SkeletonLeg {
            name: "LF".to_owned(),
            hip: [0.1, 0.05, 0.0],
            segments: [0.044, 0.071, 0.039],
            reference: [0.0; 3],
            abduction: None,
        };
        Skeleton { legs: vec![leg] }
    }

    fn frames(layout: &Layout) -> Frames {
        frames_of(&leg(), layout)
    }

    fn frames_of(skeleton: &Skeleton, layout: &Layout) -> Frames {
        let keep = |_: &str| false;
        Frames::new(
            skeleton,
            &Signals {
                layout,
                keep: &keep,
            },
        )
    }

    /// Parent, child, translation and rotation of each transform.
    type Links = Vec<(String, String, [f64; 3], [f64; 4])>;

    fn read(message: &[u8]) -> (Vec<[u32; 2]>, Links) {
        let links = transforms(message).unwrap().into_iter().map(|transform| {
            let ([parent, child], [x, y, z, rotation @ ..]) = (transform.link, transform.numbers);
            (parent, child, [x, y, z], rotation)
        });
        let mut from = CdrReader::new(message).unwrap();
        let mut times = from.each(|from| {
            let time = from.time();
            let _ = (from.text()?, from.text()?, from.f64s::<7>()?);
            time
        });
        let times = times.as_mut().unwrap();
        times.dedup();
        (std::mem::take(times), links.collect())
    }

    /// Position of the foot by forward kinematics through the frames.
    fn foot(links: &Links) -> [f64; 3] {
        let mut point = [0.0; 3];
        for (_, _, at, [x, y, z, w]) in links.iter().rev() {
            let cross = |b: [f64; 3]| {
                [
                    y * b[2] - z * b[1],
                    z * b[0] - x * b[2],
                    x * b[1] - y * b[0],
                ]
            };
            let once = cross(point);
            let twice = cross(once);
            point = [0, 1, 2].map(|n| at[n] + point[n] + 2.0 * (w * once[n] + twice[n]));
        }
        point
    }

    #[test]
    fn frames_end_at_the_foot() {
        let ports = [
            Port::output("body/position", Unit::Meter, 3),
            Port::output("body/orientation", Unit::One, 4),
            Port::output("leg/LF/angles", Unit::Radian, 3),
        ];
        let mut frames = frames(&Layout::of(&ports, Direction::Output));
        let angles = [0.6, -0.4, 0.5_f64];
        let (sin, cos) = libm::sincos(0.3); // yawed by 0.6 rad
        let mut values = vec![1.0, 2.0, 0.14, cos, 0.0, 0.0, sin];
        values.extend(angles);
        let (time, links) = read(frames.at([2, 0, 0, 0, 9, 0, 0, 0], &values));
        let (mut x, mut z) = (0.1, 0.14);
        for (angle, length) in angles.into_iter().zip([0.044, 0.071, 0.039]) {
            x += length * libm::sin(angle);
            z -= length * libm::cos(angle);
        }
        let (turn_sin, turn_cos) = libm::sincos(0.6);
        let expected = [
            1.0 + turn_cos * x - turn_sin * 0.05,
            2.0 + turn_sin * x + turn_cos * 0.05,
            z,
        ];
        for (actual, expected) in foot(&links).into_iter().zip(expected) {
            assert!((actual - expected).abs() < 1e-14, "{actual} for {expected}");
        }
        assert_eq!(time, [[2, 9]]);
        assert_eq!(
            (links[4].0.as_str(), links[4].1.as_str()),
            ("LF_lower", "LF_foot")
        );
    }

    /// The foot of a leg that abducts, with a straight leg: on a circle about the axis, at the end
    /// of a joint that moves.
    #[test]
    fn frames_of_a_leg_that_abducts_turn_about_its_axis() {
        let ports = [
            Port::output("leg/LF/angles", Unit::Radian, 3),
            Port::output("leg/LF/abduction/position", Unit::Radian, 1),
        ];
        let layout = Layout::of(&ports, Direction::Output);
        let foot_at = |is_free, angle: f64| {
            let mut skeleton = leg();
            skeleton.legs[0].abduction = Some(SkeletonAbduction {
                axis: [0.1, 0.03, 0.01],
                is_free,
            });
            let mut frames = frames_of(&skeleton, &layout);
            let (_, links) = read(frames.at([0; 8], &[0.0, 0.0, 0.0, angle]));
            let names = links[1..3].iter().map(|link| [&*link.0, &*link.1]);
            let expected = [["trunk", "LF_abductor"], ["LF_abductor", "LF_upper"]];
            assert!(names.eq(expected), "{links:?}");
            foot(&links)
        };
        let length = 0.044 + 0.071 + 0.039;
        let (sin, cos) = libm::sincos(0.3);
        let [side, down] = [0.05 - 0.03, 0.01 + length];
        let moved = [
            0.1,
            0.03 + side * cos + down * sin,
            0.01 + side * sin - down * cos,
        ];
        for (found, expected) in [
            (foot_at(true, 0.3), moved),
            (foot_at(true, 0.0), [0.1, 0.05, -length]),
            (foot_at(false, 0.3), [0.1, 0.05, -length]),
        ] {
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-15, "{found} for {expected}");
            }
        }
    }

    #[test]
    fn a_leg_without_angles_has_no_frames() {
        let ports = [Port::output("body/position", Unit::Meter, 3)];
        let mut frames = frames(&Layout::of(&ports, Direction::Output));
        assert_eq!(read(frames.at([0; 8], &[0.0; 3])).1.len(), 1);
    }
}
