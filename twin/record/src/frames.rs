//! Coordinate frames, so that a viewer shows the robot.

use std::ops::Range;

use serde::Serialize;
use twinrig_kernel::{Layout, SimTime};

use crate::EPOCH;

/// What of a robot a viewer shows: where its legs hang and how long their segments are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skeleton {
    /// The legs.
    pub legs: Vec<SkeletonLeg>,
}

/// A leg of a [`Skeleton`].
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonLeg {
    /// Name of the leg, as in its signals: `LF` for `leg/LF/angles`.
    pub name: String,
    /// The hip in the trunk frame: x forward, y left, z up \[m\].
    pub hip: [f64; 3],
    /// Hip to knee, knee to ankle, ankle to foot \[m\].
    pub segments: [f64; 3],
}

#[derive(Debug, Clone, Serialize)]
struct Message {
    transforms: Vec<Transform>,
}

#[derive(Debug, Clone, Serialize)]
struct Transform {
    timestamp: Timestamp,
    parent_frame_id: String,
    child_frame_id: String,
    translation: Translation,
    rotation: Rotation,
}

#[derive(Debug, Clone, Copy, Default, Serialize)]
struct Timestamp {
    sec: u64,
    nsec: u64,
}

// Single precision is more than a viewer shows, and half the text.
#[derive(Debug, Clone, Copy, Default, Serialize)]
struct Translation {
    x: f32,
    y: f32,
    z: f32,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Rotation {
    x: f32,
    y: f32,
    z: f32,
    w: f32,
}

const UNTURNED: Rotation = Rotation {
    x: 0.0,
    y: 0.0,
    z: 0.0,
    w: 1.0,
};

/// Turns samples of the plant into frame messages: world → body, and for every leg whose angles are
/// among the signals body → hip → knee → ankle → foot.
#[derive(Debug, Clone)]
pub(crate) struct Frames {
    position: Option<usize>,
    orientation: Option<usize>,
    /// Where the angles of each leg are, in the order of the transforms.
    angles: Vec<usize>,
    message: Message,
}

impl Frames {
    pub(crate) fn new(skeleton: &Skeleton, layout: &Layout) -> Self {
        let start = |name: &str, size: usize| -> Option<usize> {
            let range: Range<usize> = layout.find(name)?;
            (range.len() == size).then_some(range.start)
        };
        let mut transforms = vec![transform("world", "body", [0.0; 3])];
        let mut angles = Vec::new();
        for SkeletonLeg {
            name,
            hip,
            segments,
        } in &skeleton.legs
        {
            let Some(start) = start(&format!("leg/{name}/angles"), 3) else {
                continue;
            };
            angles.push(start);
            let mut parent = "body".to_owned();
            let [thigh, shank, shin] = segments.map(|length| [0.0, 0.0, -length]);
            for (joint, at) in [
                ("hip", *hip),
                ("knee", thigh),
                ("ankle", shank),
                ("foot", shin),
            ] {
                let child = format!("{name}/{joint}");
                transforms.push(transform(&parent, &child, at));
                parent = child;
            }
        }
        Self {
            position: start("body/position", 3),
            orientation: start("body/orientation", 4),
            angles,
            message: Message { transforms },
        }
    }

    /// The frames at `now`, from a sample of the plant.
    pub(crate) fn at(&mut self, now: SimTime, values: &[f64]) -> &impl Serialize {
        let nanos = now.as_nanos().saturating_add(EPOCH.as_nanos());
        let timestamp = Timestamp {
            sec: nanos / 1_000_000_000,
            nsec: nanos % 1_000_000_000,
        };
        let transforms = &mut self.message.transforms;
        for transform in transforms.iter_mut() {
            transform.timestamp = timestamp;
        }
        if let Some(start) = self.position {
            transforms[0].translation =
                translation([values[start], values[start + 1], values[start + 2]]);
        }
        if let Some(start) = self.orientation {
            let [w, x, y, z] = [0, 1, 2, 3].map(|n| single(values[start + n]));
            transforms[0].rotation = Rotation { x, y, z, w };
        }
        for (leg, &start) in self.angles.iter().enumerate() {
            // The angles are absolute, a child frame turns against its parent.
            let mut parent = 0.0;
            for joint in 0..3 {
                let angle = values[start + joint];
                transforms[1 + 4 * leg + joint].rotation = swung(angle - parent);
                parent = angle;
            }
        }
        &self.message
    }
}

fn transform(parent: &str, child: &str, at: [f64; 3]) -> Transform {
    Transform {
        timestamp: Timestamp::default(),
        parent_frame_id: parent.to_owned(),
        child_frame_id: child.to_owned(),
        translation: translation(at),
        rotation: UNTURNED,
    }
}

fn translation([x, y, z]: [f64; 3]) -> Translation {
    Translation {
        x: single(x),
        y: single(y),
        z: single(z),
    }
}

#[expect(clippy::cast_possible_truncation, reason = "single precision is meant")]
fn single(value: f64) -> f32 {
    value as f32
}

/// A segment that hangs straight down, swung forward by `angle` \[rad\]: that is a turn by
/// −angle about y, which points left.
fn swung(angle: f64) -> Rotation {
    let (sin, cos) = libm::sincos(-0.5 * angle);
    Rotation {
        y: single(sin),
        w: single(cos),
        ..UNTURNED
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Direction, Port, Unit};

    use super::*;

    fn leg() -> Skeleton {
        let leg = SkeletonLeg {
            name: "LF".to_owned(),
            hip: [0.1, 0.05, 0.0],
            segments: [0.044, 0.071, 0.039],
        };
        Skeleton { legs: vec![leg] }
    }

    /// Where the foot is according to the chain of frames.
    fn foot(frames: &Frames) -> [f64; 3] {
        let mut point = [0.0; 3];
        for Transform {
            translation: t,
            rotation: r,
            ..
        } in frames.message.transforms.iter().rev()
        {
            let [x, y, z, w] = [r.x, r.y, r.z, r.w].map(f64::from);
            let cross = |a: [f64; 3], b: [f64; 3]| {
                [
                    a[1] * b[2] - a[2] * b[1],
                    a[2] * b[0] - a[0] * b[2],
                    a[0] * b[1] - a[1] * b[0],
                ]
            };
            let once = cross([x, y, z], point);
            let twice = cross([x, y, z], once);
            let at = [t.x, t.y, t.z].map(f64::from);
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
        let mut frames = Frames::new(&leg(), &Layout::of(&ports, Direction::Output));
        let angles = [0.6, -0.4, 0.5_f64];
        let (sin, cos) = libm::sincos(0.3); // yawed by 0.6 rad
        let mut values = vec![1.0, 2.0, 0.14, cos, 0.0, 0.0, sin];
        values.extend(angles);
        let _ = frames.at(SimTime::from_nanos(1_500_000_000), &values);
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
        for (seen, expected) in foot(&frames).into_iter().zip(expected) {
            assert!((seen - expected).abs() < 1e-6, "{seen} for {expected}");
        }
        assert_eq!(frames.message.transforms[3].timestamp.sec, 2);
        assert_eq!(frames.message.transforms[3].timestamp.nsec, 500_000_000);
    }

    #[test]
    fn a_leg_without_angles_has_no_frames() {
        let ports = [Port::output("body/position", Unit::Meter, 3)];
        let frames = Frames::new(&leg(), &Layout::of(&ports, Direction::Output));
        assert_eq!(frames.message.transforms.len(), 1);
    }
}
