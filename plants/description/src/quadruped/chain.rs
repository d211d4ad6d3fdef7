//! Chains of hinges that hang on a trunk.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector3};
use twinrig_document::Problem;

use super::{Abduction, Bend, Leg};
use crate::tree::{Frame, Freedom, Inertial, Joint, Tree};

/// Greatest sine of the angle between an axis and the direction that it should have.
const ASKEW_MAX: f64 = 0.05;

/// Least length of a segment \[m\].
const LENGTH_MIN: f64 = 1e-4;

/// Least mass of a foot, of the segment above it, or of parts above a hip \[kg\].
const MASS_MIN: f64 = 1e-6;

/// Offset of the rod as a share of the shorter of the first two segments, if it is not known.
const OFFSET: f64 = 0.3;

/// Words in the names of contact points.
const FEET: [&str; 4] = ["foot", "toe", "tip", "sole"];

/// Words in the names of the ends of the rod, as this program writes them.
const ROD: [&str; 2] = ["inner", "outer"];

/// A chain of hinges, in the frame of the trunk where all joints are zero.
pub(super) struct Chain {
    /// First hinge about y \[m\].
    pub(super) hip: Vector3<f64>,
    /// Bodies between trunk and hip.
    pub(super) abducting: Inertial,
    /// Hinges along the trunk, in its frame.
    pub(super) abductions: Vec<Hinge>,
    /// Displacement of the foot from the hip along y \[m\].
    pub(super) sideways: f64,
    joints: Vec<Joint>,
    /// Senses of the hinges: 1 if positive angles turn forward, else −1.
    directions: Vec<f64>,
    /// From each joint to the next one, or to the foot, in the plane of the leg \[m\].
    spans: Vec<Planar>,
    bodies: Vec<Inertial>,
    /// Positions of the centres of mass along the segments, from the joint above \[m\].
    centres: Vec<f64>,
    l_delta: Option<f64>,
}

/// A hinge along the trunk.
pub(super) struct Hinge {
    /// Point of the axis \[m\].
    at: Vector3<f64>,
    /// 1 if positive angles turn to the left, else −1.
    sense: f64,
    joint: Joint,
}

/// Forward and up.
#[derive(Clone, Copy)]
struct Planar {
    x: f64,
    z: f64,
}

impl Planar {
    fn length(self) -> f64 {
        (self.x * self.x + self.z * self.z).sqrt()
    }

    /// Returns the angle, zero straight down and positive forward \[rad\].
    fn angle(self) -> f64 {
        libm::atan2(self.x, -self.z)
    }
}

/// Returns all chains of hinges below a trunk.
pub(super) fn chains(
    tree: &Tree,
    children: &[Vec<usize>],
    trunk: usize,
) -> Result<Vec<Chain>, Problem> {
    let firsts = children[trunk].iter();
    firsts
        .map(|first| Chain::new(tree, children, *first))
        .collect()
}

/// Direction of an axis.
enum Direction {
    /// Along the trunk: abduction; 1 if positive angles turn to the left, else −1.
    Along(f64),
    /// Across the trunk; 1 if positive angles turn forward, else −1.
    Across(f64),
}

fn direction(axis: Vector3<f64>, joint: &Joint) -> Result<Direction, Problem> {
    let [x, y] = [axis.x, axis.y].map(f64::abs);
    let least = axis.norm() * (1.0 - ASKEW_MAX * ASKEW_MAX).sqrt();
    if axis.norm() > 0.0 && y >= least {
        return Ok(Direction::Across(-axis.y.signum()));
    }
    if axis.norm() > 0.0 && x >= least {
        return Ok(Direction::Along(axis.x.signum()));
    }
    let message = format!(
        "the axis of `{}` is ({:.3}, {:.3}, {:.3}) in the trunk, neither along nor across it",
        joint.name, axis.x, axis.y, axis.z
    );
    let help = "legs abduct about x, then move in a plane about y; fix other parts to the trunk";
    Err(Problem::at(&joint.place, message, help))
}

impl Chain {
    fn new(tree: &Tree, children: &[Vec<usize>], first: usize) -> Result<Self, Problem> {
        let mut chain = Self {
            hip: Vector3::zeros(),
            abducting: Inertial::none(),
            abductions: Vec::new(),
            sideways: 0.0,
            joints: Vec::new(),
            directions: Vec::new(),
            spans: Vec::new(),
            bodies: Vec::new(),
            centres: Vec::new(),
            l_delta: None,
        };
        let mut frame = Frame::identity();
        let mut next = Some(first);
        while let Some(index) = next {
            let body = &tree.bodies[index];
            let Some(joint) = &body.joint else { break };
            if joint.freedom != Freedom::Hinge {
                let message = format!("`{}` is no hinge; legs have hinges only", joint.name);
                let help = "of a model of this program: twin export mjcf --coordinates minimal";
                return Err(Problem::at(&joint.place, message, help));
            }
            frame = frame.then(&joint.frame);
            next = match children[index][..] {
                [] => None,
                [only] => Some(only),
                [_, other, ..] => {
                    let message = format!("the leg branches below `{}`", body.name);
                    let help = "a leg is a chain of hinges";
                    return Err(Problem::at(&tree.bodies[other].place, message, help));
                }
            };
            match direction(frame.rotation * joint.axis, joint)? {
                Direction::Along(sense) if chain.joints.is_empty() => {
                    chain.abductions.push(Hinge {
                        at: frame.place(joint.anchor),
                        sense,
                        joint: joint.clone(),
                    });
                    chain.abducting = chain.abducting.with(&body.inertial.seen_from(&frame));
                }
                Direction::Along(_) => {
                    let message = format!("`{}` abducts below the hip", joint.name);
                    let help = "below the hip, a leg moves in one plane";
                    return Err(Problem::at(&joint.place, message, help));
                }
                Direction::Across(sense) => {
                    if chain.joints.is_empty() {
                        chain.hip = frame.place(joint.anchor);
                    }
                    chain.directions.push(sense);
                    chain.segment(tree, index, joint, next, frame.rotation)?;
                }
            }
        }
        let count = chain.joints.len();
        if !(2..=3).contains(&count) {
            let body = &tree.bodies[first];
            let message = format!("hinges about y in the leg of `{}`: {count}", body.name);
            let help = "two or three are required: hip, knee and, possibly, ankle";
            return Err(Problem::at(&body.place, message, help));
        }
        Ok(chain)
    }

    /// Adds a segment.
    fn segment(
        &mut self,
        tree: &Tree,
        index: usize,
        joint: &Joint,
        next: Option<usize>,
        rotation: Matrix3<f64>,
    ) -> Result<(), Problem> {
        let body = &tree.bodies[index];
        let place = |why: &str, help: &str| {
            let message = format!("the segment `{}` {why}", body.name);
            Problem::at(&body.place, message, help)
        };
        let end = match next.and_then(|next| tree.bodies[next].joint.as_ref()) {
            Some(below) => below.frame.place(below.anchor),
            None => foot(&body.points, joint.anchor).ok_or_else(|| {
                let help = "fix a link or a site named `foot` at its contact point";
                place("is the last one, and has no foot", help)
            })?,
        };
        let span = rotation * (end - joint.anchor);
        self.sideways += span.y;
        let span = Planar {
            x: span.x,
            z: span.z,
        };
        let length = span.length();
        if length < LENGTH_MIN {
            return Err(place("has no length", "joints and foot must be apart"));
        }
        if body.inertial.mass <= 0.0 {
            return Err(place("has no mass", "give it an <inertial>"));
        }
        let along = |point: Vector3<f64>| {
            let arm = rotation * (point - joint.anchor);
            (arm.x * span.x + arm.z * span.z) / length
        };
        // The rod begins above the knee and ends above the ankle, by as much.
        let mut points = body.points.iter();
        let rod = points.find(|(name, _)| ROD.iter().any(|word| name.ends_with(word)));
        let l_delta = match (rod, next) {
            (Some((_, point)), Some(_)) => Some(length - along(*point)),
            (Some((_, point)), None) => Some(-along(*point)),
            (None, _) => None,
        };
        self.l_delta = self.l_delta.or(l_delta.filter(|l_delta| *l_delta > 0.0));
        self.centres.push(along(body.inertial.centre));
        self.bodies.push(body.inertial);
        self.spans.push(span);
        self.joints.push(joint.clone());
        Ok(())
    }

    /// Returns the leg; the trunk has its centre of mass at `centre`.
    pub(super) fn leg(&self, name: &'static str, centre: Vector3<f64>) -> Result<Leg, Problem> {
        let lengths: Vec<f64> = self.spans.iter().map(|span| span.length()).collect();
        let angle = wrapped(self.spans[1].angle() - self.spans[0].angle());
        let bend = Bend::of(&self.joints[1], angle, self.directions[1])?;
        let last = self.bodies.len() - 1;
        let is_divided = last == 1;
        let lengths = match lengths[..] {
            [first, second] => [0.5 * first, second, 0.5 * first],
            _ => [lengths[0], lengths[1], lengths[2]],
        };
        let shorter = lengths[0].min(lengths[1]);
        let l_delta = self
            .l_delta
            .filter(|l_delta| !is_divided && *l_delta < shorter);
        let is_l_delta_assumed = l_delta.is_none();
        let l_delta = l_delta.unwrap_or(OFFSET * shorter);
        let above = if is_divided { 0.0 } else { l_delta };
        let end = self.spans[last].length();
        let total = self.bodies[last].mass;
        let rod_centre = 0.5 * (end - above);
        let foot = total * (self.centres[last] - rod_centre) / (end - rod_centre);
        let foot = Some(foot).filter(|foot| (MASS_MIN..=total - MASS_MIN).contains(foot));
        let below = total - foot.unwrap_or(0.0);
        let first = self.bodies[0].mass;
        let masses = if is_divided {
            [0.5 * first, below, 0.5 * first]
        } else {
            [first, self.bodies[1].mass, below]
        };
        let of = |what: fn(&Joint) -> Option<f64>, index: usize| {
            self.joints
                .get(index)
                .and_then(what)
                .filter(|value| *value > 0.0)
        };
        let mut hip = self.hip - centre;
        hip.y += self.sideways;
        Ok(Leg {
            name,
            hip,
            abduction: self.abduction(hip, centre),
            lengths,
            l_delta,
            is_l_delta_assumed,
            bend,
            masses,
            foot,
            is_divided,
            damping: [0, 1, 2].map(|index| of(|joint| joint.damping, index)),
            torque: [0, 1].map(|index| of(|joint| joint.torque, index)),
            speed: [0, 1].map(|index| of(|joint| joint.speed, index)),
        })
    }
}

impl Chain {
    /// Whether parts between trunk and hip have a mass, besides that of a link that must have some.
    pub(super) fn has_abducting_mass(&self) -> bool {
        self.abducting.mass >= MASS_MIN
    }

    /// Returns the joint of abduction of a leg with its hip at `hip`: the only hinge along the
    /// trunk, with a range that contains zero.
    fn abduction(&self, hip: Vector3<f64>, centre: Vector3<f64>) -> Option<Abduction> {
        let [hinge] = &self.abductions[..] else {
            return None;
        };
        let [mut least, mut greatest] = hinge.joint.range?.map(|angle| hinge.sense * angle);
        if hinge.sense < 0.0 {
            (least, greatest) = (greatest, least);
        }
        // NaN is on no side of zero.
        if !(least <= 0.0 && greatest >= 0.0 && least < greatest) {
            return None;
        }
        // A robot file has angles up to 90°.
        (least, greatest) = (least.max(-FRAC_PI_2), greatest.min(FRAC_PI_2));
        let at = hinge.at - centre;
        let (offset, [outwards, inwards]) = if hip.y < 0.0 {
            (at.y - hip.y, [-least, greatest])
        } else {
            (hip.y - at.y, [greatest, -least])
        };
        let positive = |value: Option<f64>| value.filter(|value| *value > 0.0);
        Some(Abduction {
            offset,
            height: at.z - hip.z,
            outwards,
            inwards,
            friction: positive(hinge.joint.damping),
            torque: positive(hinge.joint.torque),
            speed: positive(hinge.joint.speed),
        })
    }
}

/// Returns the contact point among the points of the last body: the farthest from its joint, of
/// those whose names say so if there are any.
fn foot(points: &[(String, Vector3<f64>)], joint: Vector3<f64>) -> Option<Vector3<f64>> {
    let is_named = |name: &str| {
        let name = name.to_lowercase();
        FEET.iter().any(|word| name.contains(word))
    };
    let any_named = points.iter().any(|(name, _)| is_named(name));
    let candidates = points
        .iter()
        .filter(|(name, _)| !any_named || is_named(name));
    let distance = |point: &Vector3<f64>| (point - joint).norm();
    let points = candidates.map(|(_, point)| *point);
    points.max_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Returns the angle in −π to π \[rad\].
fn wrapped(angle: f64) -> f64 {
    libm::atan2(libm::sin(angle), libm::cos(angle))
}
