//! Bodies of the robot and points on them.

use rapier3d_f64::math::Vector;
use twinrig_actuator::PositionServo;
use twinrig_contact::{Ground, Terrain};
use twinrig_legged::{Abduction, Base, Contacts, DriveModels, Drives, Segment, Setup, positive};
use twinrig_robot::leg::Pantograph;
use twinrig_robot::{AbductionAxis, LegMount, Robot};

use crate::options::{Joints, Options, RapierError};

/// Radius of the ball that represents a contact point; the ground is lowered by it \[m\].
pub(crate) const FOOT: f64 = 1e-4;

/// Index of the body above the segments: the trunk, or the carrier of a leg that abducts.
pub(crate) const TRUNK: usize = 3;

/// A point of a body, relative to its centre of mass, in body axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    /// A segment of the leg, or [`TRUNK`]; of a contact point without a leg it is the trunk itself.
    pub(crate) body: usize,
    pub(crate) at: Vector,
}

/// A spring between two points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spring {
    pub(crate) ends: [Point; 2],
    /// \[N/m\]
    pub(crate) stiffness: f64,
    /// Unloaded length \[m\].
    pub(crate) rest: f64,
}

/// Rope: an upper bound of the distance between two points. The engine does not need the fewest
/// sweeps for the shortest rope: at little leverage it has to resolve small motions of light ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rope {
    pub(crate) ends: [Point; 2],
    /// Length \[m\]; of a cable, with the pulley at zero.
    pub(crate) length: f64,
}

/// Number of ropes of a leg, and index of the one that represents the cable.
pub(crate) const ROPES: usize = 5;
pub(crate) const CABLE: usize = 4;

/// Indices of the ropes that are stops of the knee.
pub(crate) const KNEE_STOPS: [usize; 2] = [2, 3];

/// Angle between the ends of a rope across the knee, seen from the knee, at its stop \[rad\]: wide
/// enough for the knee to turn by as much without tightening the rope on the other side, and narrow
/// enough for leverage.
const STOP_ANGLE: f64 = 1.8;

/// A leg.
#[derive(Debug, Clone)]
pub(crate) struct Leg {
    pub(crate) name: String,
    pub(crate) pantograph: Pantograph,
    /// Position of the hip on the body above.
    pub(crate) hip: Vector,
    /// Carrier of a leg that abducts.
    pub(crate) carrier: Option<Carrier>,
    pub(crate) segments: [Segment; 3],
    /// Viscous friction of hip, knee and ankle \[N·m·s/rad\].
    pub(crate) friction: [f64; 3],
    /// Diagonal and parallel.
    pub(crate) springs: [Spring; 2],
    /// Stops: closed, open, extended, bottomed; then the rope that represents the cable.
    pub(crate) ropes: [Rope; ROPES],
    pub(crate) foot: Point,
    /// Lengths of the first and second segment \[m\], and knee angle in the reference pose \[rad\].
    lengths: [f64; 2],
    knee_reference: f64,
    /// Radius of the pulley \[m\].
    pub(crate) radius: f64,
    /// Offset of the pantograph, its longest parallel rod and its shortest diagonal \[m\].
    pub(crate) l_delta: f64,
    pub(crate) parallel_max: f64,
    pub(crate) diagonal_min: f64,
}

/// Body between the trunk and a leg that abducts, on a hinge along the trunk, with the axes of the
/// trunk at the angle zero. Its mass is a part of the trunk's.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carrier {
    pub(crate) axis: AbductionAxis,
    /// Its centre of mass, on the axis, in the trunk.
    pub(crate) place: Vector,
    /// \[kg\]
    pub(crate) mass: f64,
    /// About each axis \[kg·m²\].
    pub(crate) moment: f64,
}

impl Carrier {
    /// Shares of the trunk's mass, and of its least moment of inertia. The engine needs some of
    /// both, and the lighter the carrier the more sweeps. Both are taken from the trunk, so that
    /// only the inertia of abduction is greater, by 1.5 % in Oncilla. With a fifth of the moment, a
    /// hanging trot loses 0.5 % of the energy exchanged in place of 0.3 %.
    const SHARES: [f64; 2] = [1e-2, 5e-3];

    fn new(mount: &LegMount, robot: &Robot) -> Option<Self> {
        let axis = mount.abduction_axis()?;
        let [left, up] = axis.place;
        let [of_mass, of_inertia] = Self::SHARES;
        let least = robot
            .trunk
            .inertia
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        Some(Self {
            axis,
            place: Vector::new(mount.hip[0], left, up),
            mass: of_mass * robot.trunk.mass,
            moment: of_inertia * least,
        })
    }

    /// Returns its moments of inertia about the axes of the trunk through the trunk's centre of
    /// mass \[kg·m²\].
    fn inertia(&self) -> Vector {
        let square = self.place * self.place;
        let around = Vector::new(
            square.y + square.z,
            square.x + square.z,
            square.x + square.y,
        );
        around * self.mass + Vector::splat(self.moment)
    }
}

/// Contact point: its leg, if it is on one, and its place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyPoint {
    pub(crate) leg: Option<usize>,
    pub(crate) point: Point,
}

/// The robot.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) base: Base,
    pub(crate) mass: f64,
    pub(crate) inertia: Vector,
    pub(crate) legs: Vec<Leg>,
    /// Contact points of trunk, knees and ankles, if they have contact.
    pub(crate) body: Vec<BodyPoint>,
    pub(crate) drives: Option<DriveModels>,
    /// Servo of abduction, if there is one.
    pub(crate) abduction: Option<PositionServo>,
    pub(crate) ground: Option<Ground>,
}

impl Model {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, RapierError> {
        options.check()?;
        let setup = &options.setup;
        let is_free = options.joints == Joints::Impulse && setup.drives == Drives::None;
        if options.step_only && !is_free {
            return Err(RapierError::StepOnly);
        }
        if robot.trunk.payload().is_some() {
            return Err(RapierError::Payload);
        }
        if setup.abduction == Abduction::Serial {
            setup.check_locked("`rapier` with serial servos")?;
        }
        let abducts = setup.abduction != Abduction::Locked;
        if abducts && (options.step_only || options.joints == Joints::Multibody) {
            return Err(RapierError::Abduction);
        }
        let mut legs = Vec::new();
        for mount in setup.mounts(robot)? {
            let leg = Leg::new(mount)?;
            let carrier = Carrier::new(mount, robot).filter(|_| abducts);
            legs.push(match carrier {
                Some(carrier) => leg.carried_by(carrier),
                None => leg,
            });
        }
        if setup.base != Base::Fixed {
            positive("mass of the trunk", robot.trunk.mass)?;
            for (moment, axis) in robot.trunk.inertia.iter().zip(["roll", "pitch", "yaw"]) {
                positive(&format!("trunk's moment of inertia in {axis}"), *moment)?;
            }
        }
        let (mass, inertia) = trunk_without_carriers(robot, &legs);
        if abducts && setup.base != Base::Fixed {
            check_balance(&legs)?;
            for moment in inertia.to_array() {
                positive(
                    "trunk's moment of inertia without the carriers of its legs",
                    moment,
                )?;
            }
        }
        Ok(Self {
            base: setup.base,
            mass,
            inertia,
            body: body_points(robot, setup, &legs)?,
            legs,
            drives: setup.drive_models(robot)?,
            abduction: setup.abduction_servo(robot)?,
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
        // Point of a segment at a distance from the joint above it.
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
        // Point of a segment on a circle around the knee: from the first to the second segment the
        // angle between such points is the knee's plus a constant, so that the chord is longest at
        // the knee's stop.
        let around = |body: usize, joint: f64, angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            let arm = Vector::new(sin, 0.0, -cos) * leg.l2;
            Point {
                body,
                at: on(body, joint).at + arm,
            }
        };
        let chord = |angle: f64| {
            rope(
                around(0, leg.l1, 0.5 * angle),
                around(1, 0.0, -0.5 * angle),
                2.0 * leg.l2 * libm::sin(0.5 * STOP_ANGLE),
            )
        };
        let cos_flexed =
            (leg.diagonal_min * leg.diagonal_min - leg.l2 * leg.l2 - ld * ld) / (2.0 * leg.l2 * ld);
        // Points that are l₂ apart where the pantograph is closed, and nearer where it is open.
        let extension = 0.5 * leg.l2;
        let closed = rope(on(0, leg.l1 + extension), on(2, extension), leg.l2);
        Ok(Self {
            name: mount.name.clone(),
            hip,
            carrier: None,
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
                chord(-STOP_ANGLE - leg.q2_ref),
                chord(STOP_ANGLE - libm::acos(cos_flexed)),
                chord(-STOP_ANGLE - leg.q2_ref),
            ],
            foot: on(2, segments[2].length),
            lengths: [leg.l1, leg.l2],
            knee_reference: leg.q2_ref,
            radius: leg.pulley_radius,
            l_delta: ld,
            parallel_max: leg.l2 + leg.parallel_travel,
            diagonal_min: leg.diagonal_min,
            pantograph,
        })
    }
}

impl Leg {
    /// Returns the same leg below a carrier.
    fn carried_by(mut self, carrier: Carrier) -> Self {
        self.hip -= carrier.place;
        self.carrier = Some(carrier);
        self
    }

    /// Returns the angle between the ends of the rope of the stretch stop, seen from the knee
    /// \[rad\].
    fn stop_angle(&self, knee: f64) -> f64 {
        STOP_ANGLE + self.knee_reference - knee
    }

    /// Returns the length of the rope that represents a cable of this length \[m\]. The cable runs
    /// from hip to ankle, and its length depends on the knee angle alone, as does that of a rope
    /// around the knee.
    pub(crate) fn chord_of_cable(&self, cable: f64) -> f64 {
        /// Least angle \[rad\]: a cable that is wound beyond the range of the knee holds it at full
        /// flexion.
        const MIN_ANGLE: f64 = 0.01;
        let [l1, l2] = self.lengths;
        let cosine = (cable.max(0.0) * cable.max(0.0) - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
        let knee = libm::acos(cosine.clamp(-1.0, 1.0));
        let stop_angle = self
            .stop_angle(knee)
            .clamp(MIN_ANGLE, core::f64::consts::PI);
        2.0 * l2 * libm::sin(0.5 * stop_angle)
    }

    /// Returns least and greatest angle of the second segment relative to the first \[rad\].
    pub(crate) fn knee_range(&self) -> [f64; 2] {
        let [_, l2] = self.lengths;
        let (l_delta, shortest) = (self.l_delta, self.diagonal_min);
        let cosine = (shortest * shortest - l2 * l2 - l_delta * l_delta) / (2.0 * l2 * l_delta);
        [-libm::acos(cosine), -self.knee_reference]
    }

    /// Returns the ratio of the cable's rate to that of the rope that represents it, which equals
    /// the ratio of the rope's pull to the cable tension.
    pub(crate) fn cable_ratio(&self, angles: [f64; 3]) -> f64 {
        let [l1, l2] = self.lengths;
        let knee = angles[0] - angles[1];
        let cable = libm::sqrt(l1 * l1 + l2 * l2 + 2.0 * l1 * l2 * libm::cos(knee));
        l1 * libm::sin(knee) / (cable * libm::cos(0.5 * self.stop_angle(knee)))
    }

    /// Returns the length of the taut cable at these angles \[m\].
    pub(crate) fn cable(&self, angles: [f64; 3]) -> f64 {
        self.pantograph
            .cable_of_knee(self.pantograph.joints(angles).q2)
    }
}

/// Returns mass \[kg\] and moments of inertia \[kg·m²\] of the trunk without the carriers of its
/// legs.
fn trunk_without_carriers(robot: &Robot, legs: &[Leg]) -> (f64, Vector) {
    let whole = (robot.trunk.mass, Vector::from_array(robot.trunk.inertia));
    let carriers = legs.iter().filter_map(|leg| leg.carrier.as_ref());
    carriers.fold(whole, |(mass, inertia), carrier| {
        (mass - carrier.mass, inertia - carrier.inertia())
    })
}

/// Checks that the carriers have their common centre of mass and principal axes at those of the
/// trunk, so that the trunk without them has, too.
fn check_balance(legs: &[Leg]) -> Result<(), RapierError> {
    let places = || {
        legs.iter()
            .filter_map(|leg| leg.carrier)
            .map(|carrier| carrier.place)
    };
    let sum = |of: &dyn Fn(Vector) -> f64| places().map(of).sum::<f64>();
    let size = sum(&|p| p.length());
    let moments = [sum(&|p| p.x), sum(&|p| p.y), sum(&|p| p.z)];
    let products = [
        sum(&|p| p.x * p.y),
        sum(&|p| p.y * p.z),
        sum(&|p| p.z * p.x),
    ];
    // Of rounding.
    let is_small = |value: &f64| value.abs() < 1e-9 * size;
    if moments.iter().chain(&products).all(is_small) {
        Ok(())
    } else {
        Err(RapierError::Balance)
    }
}

/// Returns the contact points of a robot.
fn body_points(robot: &Robot, setup: &Setup, legs: &[Leg]) -> Result<Vec<BodyPoint>, RapierError> {
    let contacts = setup.reaching_contacts(robot)?;
    if contacts == Contacts::Feet {
        return Ok(Vec::new());
    }
    setup.contact(robot)?;
    let is_flat = |ground: &Ground| matches!(ground.terrain, Terrain::Flat);
    if !setup.ground.as_ref().is_some_and(is_flat) {
        return Err(RapierError::Contacts);
    }
    let mut points = Vec::new();
    if setup.base != Base::Fixed {
        points.extend(robot.trunk.corners().map(|corner| BodyPoint {
            leg: None,
            point: Point {
                body: TRUNK,
                at: Vector::from_array(corner),
            },
        }));
    }
    if contacts == Contacts::All {
        for (i, leg) in legs.iter().enumerate() {
            points.extend([0, 1].map(|body| {
                let segment = &leg.segments[body];
                BodyPoint {
                    leg: Some(i),
                    point: Point {
                        body,
                        at: Vector::new(0.0, 0.0, segment.centre - segment.length),
                    },
                }
            }));
        }
    }
    Ok(points)
}
