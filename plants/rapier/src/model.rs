//! What the robot is made of, as bodies and points on them.

use rapier3d_f64::math::Vector;
use twinrig_contact::Ground;
use twinrig_leg::Pantograph;
use twinrig_legged::{Base, Fitted, Segment, positive};
use twinrig_robot::{LegMount, Robot};

use crate::options::{Options, RapierError};

/// The trunk, where a body of a leg is asked for.
pub(crate) const TRUNK: usize = 3;

/// A point of a body, from its centre of mass in its own axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    /// A segment of the leg, or [`TRUNK`].
    pub(crate) body: usize,
    pub(crate) at: Vector,
}

/// A spring between two points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spring {
    pub(crate) ends: [Point; 2],
    /// \[N/m\]
    pub(crate) stiffness: f64,
    /// Unloaded \[m\].
    pub(crate) rest: f64,
}

/// A rope: two points are no farther apart than it is long. That between the points of which the engine finds the pull in
/// the fewest sweeps is not the shortest: a rope of little leverage has to find how little its light ends may move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rope {
    pub(crate) ends: [Point; 2],
    /// \[m\]; of a cable, with the pulley at zero.
    pub(crate) length: f64,
}

/// The ropes of a leg, by their place.
pub(crate) const ROPES: usize = 5;
pub(crate) const CABLE: usize = 4;

/// How far apart, seen from the knee, the ends of a rope are that stops it: so far that the knee can turn by as much without
/// stretching it the other way, and little enough for it to pull across \[rad\].
const WIDEST: f64 = 1.8;

/// A leg.
#[derive(Debug, Clone)]
pub(crate) struct Leg {
    pub(crate) name: String,
    pub(crate) pantograph: Pantograph,
    /// Hip on the trunk.
    pub(crate) hip: Vector,
    pub(crate) segments: [Segment; 3],
    /// Of hip, knee and ankle \[N·m·s/rad\].
    pub(crate) friction: [f64; 3],
    /// Diagonal and parallel.
    pub(crate) springs: [Spring; 2],
    /// Stops: closed, open, extended, bottomed; then what stands for the cable.
    pub(crate) ropes: [Rope; ROPES],
    pub(crate) foot: Point,
    /// First and second segment \[m\], and the knee's angle in the reference pose \[rad\].
    lengths: [f64; 2],
    bend: f64,
    /// Of the pulley \[m\].
    pub(crate) radius: f64,
    /// Offset of the pantograph, its greatest parallel rod and its least diagonal \[m\].
    pub(crate) l_delta: f64,
    pub(crate) parallel_max: f64,
    pub(crate) diagonal_min: f64,
}

/// The robot.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) base: Base,
    pub(crate) mass: f64,
    pub(crate) inertia: Vector,
    pub(crate) legs: Vec<Leg>,
    pub(crate) drives: Option<Fitted>,
    pub(crate) ground: Option<Ground>,
}

impl Model {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, RapierError> {
        options.check()?;
        let setup = &options.setup;
        let mut legs = Vec::new();
        for mount in setup.chosen(robot)? {
            legs.push(Leg::new(mount)?);
        }
        if setup.base != Base::Fixed {
            positive("mass of the trunk", robot.trunk.mass)?;
            for (moment, axis) in robot.trunk.inertia.iter().zip(["roll", "pitch", "yaw"]) {
                positive(&format!("trunk's moment of inertia in {axis}"), *moment)?;
            }
        }
        Ok(Self {
            base: setup.base,
            mass: robot.trunk.mass,
            inertia: Vector::from_array(robot.trunk.inertia),
            legs,
            drives: setup.fitted(robot)?,
            ground: setup.ground.clone(),
        })
    }
}

impl Leg {
    fn new(mount: &LegMount) -> Result<Self, RapierError> {
        let leg = &mount.leg;
        let pantograph =
            Pantograph::new(leg).map_err(twinrig_legged::LeggedError::of_leg(&mount.name))?;
        let segments = Segment::of(leg);
        for (segment, what) in segments.iter().zip(["first", "second", "third"]) {
            let what = format!("{what} segment of leg {}", mount.name);
            positive(&format!("mass of the {what}"), segment.mass)?;
            positive(&format!("moment of inertia of the {what}"), segment.moment)?;
        }
        let hip = Vector::from_array(mount.hip);
        // Along its link from the joint above.
        let on = |body: usize, along: f64| Point {
            body,
            at: Vector::new(0.0, 0.0, segments[body].centre - along),
        };
        let ld = leg.l_delta;
        let inner = on(0, leg.l1 - ld);
        let ankle = on(1, leg.l2);
        let outer = on(2, -ld);
        let rope = |from: Point, to: Point, length: f64| Rope {
            ends: [from, to],
            length,
        };
        // Between points that a circle around the knee carries: from first to second segment they are the knee's angle
        // and a constant apart, so that the chord is longest where the knee stops.
        let around = |body: usize, joint: f64, angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            let arm = Vector::new(sin, 0.0, -cos) * leg.l2;
            Point {
                body,
                at: on(body, joint).at + arm,
            }
        };
        let chord = |apart: f64| {
            rope(
                around(0, leg.l1, 0.5 * apart),
                around(1, 0.0, -0.5 * apart),
                2.0 * leg.l2 * libm::sin(0.5 * WIDEST),
            )
        };
        let most_bent =
            (leg.diagonal_min * leg.diagonal_min - leg.l2 * leg.l2 - ld * ld) / (2.0 * leg.l2 * ld);
        // Which are parallel where the pantograph is closed, and nearer to each other where it is open.
        let beyond = 0.5 * leg.l2;
        let closed = rope(on(0, leg.l1 + beyond), on(2, beyond), leg.l2);
        Ok(Self {
            name: mount.name.clone(),
            hip,
            segments,
            friction: [
                leg.joint_friction.hip,
                leg.joint_friction.knee,
                leg.joint_friction.ankle,
            ],
            springs: [
                Spring {
                    ends: [inner, ankle],
                    stiffness: leg.diagonal.stiffness,
                    rest: pantograph.diagonal_max() + leg.diagonal.preload,
                },
                Spring {
                    ends: [inner, outer],
                    stiffness: leg.parallel.stiffness,
                    rest: leg.l2 - leg.parallel.preload,
                },
            ],
            ropes: [
                closed,
                rope(inner, outer, leg.l2 + leg.parallel_travel),
                chord(-WIDEST - leg.q2_ref),
                chord(WIDEST - libm::acos(most_bent)),
                chord(-WIDEST - leg.q2_ref),
            ],
            foot: on(2, segments[2].length),
            lengths: [leg.l1, leg.l2],
            bend: leg.q2_ref,
            radius: leg.pulley_radius,
            l_delta: ld,
            parallel_max: leg.l2 + leg.parallel_travel,
            diagonal_min: leg.diagonal_min,
            pantograph,
        })
    }
}

impl Leg {
    /// How wide, seen from the knee, a rope that stops the knee's stretching is with the knee so bent \[rad\].
    fn width(&self, bent: f64) -> f64 {
        WIDEST + self.bend - bent
    }

    /// The length of the rope that stands for the cable, where the cable has this length \[m\]. The cable runs from hip to
    /// ankle, and its length is a matter of the knee's angle alone; so is that of a rope around the knee.
    pub(crate) fn chord_of_cable(&self, cable: f64) -> f64 {
        /// A cable that is wound farther than any knee can bend holds the knee as bent as it can be \[rad\].
        const NARROWEST: f64 = 0.01;
        let [l1, l2] = self.lengths;
        let cosine = (cable.max(0.0) * cable.max(0.0) - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
        let bent = libm::acos(cosine.clamp(-1.0, 1.0));
        let width = self.width(bent).clamp(NARROWEST, core::f64::consts::PI);
        2.0 * l2 * libm::sin(0.5 * width)
    }

    /// How much faster the cable's length grows than that of the rope that stands for it: what a pull of the rope is over
    /// the cable's tension.
    pub(crate) fn leverage(&self, angles: [f64; 3]) -> f64 {
        let [l1, l2] = self.lengths;
        let bent = angles[0] - angles[1];
        let cable = libm::sqrt(l1 * l1 + l2 * l2 + 2.0 * l1 * l2 * libm::cos(bent));
        l1 * libm::sin(bent) / (cable * libm::cos(0.5 * self.width(bent)))
    }

    /// The length of the taut cable at these angles \[m\].
    pub(crate) fn cable(&self, angles: [f64; 3]) -> f64 {
        self.pantograph
            .cable_of_knee(self.pantograph.joints(angles).q2)
    }
}
