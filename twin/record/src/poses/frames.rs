//! Coordinate frames of trunk and leg segments, as a `tf2_msgs/TFMessage`.

use super::signals::Signals;
use crate::cdr::{CdrReader, CdrWriter, Template};
use twinrig_kernel::signal;

/// Fixed frame.
pub(super) const WORLD: &str = "world";
/// Frame of the trunk.
pub(super) const TRUNK: &str = "trunk";

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
}

const IDENTITY: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Frames world → trunk, and for each leg with recorded angles trunk → upper, middle and lower
/// segment, each at its upper joint, → foot: the links of the robot description, by their names.
#[derive(Debug, Clone)]
pub(super) struct Frames {
    position: Option<usize>,
    orientation: Option<usize>,
    /// Offset of each leg's angles in a sample, in the order of the transforms.
    angles: Vec<usize>,
    message: Template,
    transforms: Vec<Transform>,
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
        let mut angles = Vec::new();
        for SkeletonLeg {
            name,
            hip,
            segments,
            ..
        } in &skeleton.legs
        {
            let Some(start) = signals.start(&signal::of_leg(name, signal::ANGLES), 3) else {
                continue;
            };
            angles.push(start);
            let mut parent = TRUNK.to_owned();
            let [upper, middle, lower] = segments.map(|length| [0.0, 0.0, -length]);
            for (link, at) in [
                ("upper", *hip),
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
            angles,
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
        for (leg, &start) in self.angles.iter().enumerate() {
            // The angles are absolute; the rotation of a child frame is relative to its parent.
            let mut parent = 0.0;
            for joint in 0..3 {
                let angle = values[start + joint];
                let rotation = self.transforms[1 + 4 * leg + joint].rotation;
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
        };
        Skeleton { legs: vec![leg] }
    }

    fn frames(layout: &Layout) -> Frames {
        let keep = |_: &str| false;
        Frames::new(
            &leg(),
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

    #[test]
    fn a_leg_without_angles_has_no_frames() {
        let ports = [Port::output("body/position", Unit::Meter, 3)];
        let mut frames = frames(&Layout::of(&ports, Direction::Output));
        assert_eq!(read(frames.at([0; 8], &[0.0; 3])).1.len(), 1);
    }
}
