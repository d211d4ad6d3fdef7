//! Abduction of the hips: the plane of each leg turns about an axis along the trunk.
//!
//! At the angle α, positive to the left, R turns leg axes into trunk axes about x. A leg is carried
//! by a frame whose origin is the point a of the trunk on the axis. With velocity v and angular
//! velocity ω of the trunk, the frame has, in leg axes,
//!
//! ```text
//! velocity              V = Rᵀ (v + ω × a)
//! angular velocity      Ω = Rᵀ ω + α̇ x
//! acceleration          A + Rᵀ (ω × (v + ω × a))             A = Rᵀ (v̇ + ω̇ × a)
//! angular acceleration  Rᵀ ω̇ + α̈ x + (0, α̇ Ωz, −α̇ Ωy)
//! ```
//!
//! The stops are one-sided springs like those inside the leg, at a distance from the axis.

mod body;
mod drive;
mod frame;
mod spatial;

pub use body::{JointRow, LegBody};
pub use drive::{JointDrive, JointMotion, JointState, Limited};
pub use frame::LegFrame;
pub use spatial::SpatialSystem;

use twinrig_actuator::LegMotor;
use twinrig_legged::{DriveModels, LeggedError, Setup};
use twinrig_robot::{LegMount, OneSided, Robot};

use crate::element::Element;
use crate::lanes::{LANES, Lanes, Quad, Simd};
use crate::servo::ServoLaw;

/// Joint of one leg.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Constants {
    /// Position of the axis in the trunk frame, left and up \[m\].
    axis: [f64; 2],
    /// Least and greatest angle \[rad\].
    range: [f64; 2],
    /// Viscous friction \[N·m·s/rad\].
    friction: f64,
    /// Stops at both ends of the range.
    stops: OneSided,
    /// Distance of the stops from the axis \[m\].
    lever: f64,
    /// Inertia of the drive \[kg·m²\].
    inertia: f64,
}

impl Constants {
    /// Placeholder for an absent leg, whose drive alone has an inertia.
    const ABSENT: Self = Self {
        axis: [0.0; 2],
        range: [-1.0, 1.0],
        friction: 0.0,
        stops: OneSided {
            stiffness: 0.0,
            damping: 0.0,
            toe_region: 1.0,
        },
        lever: 1.0,
        inertia: 1.0,
    };

    /// Returns the joint of a leg with compliant stops, if the leg has one.
    fn new(mount: &LegMount, inertia: f64) -> Option<Self> {
        let (joint, compliance) = (mount.abduction_axis()?, mount.leg.compliance?);
        Some(Self {
            axis: joint.place,
            range: joint.range,
            friction: joint.friction,
            stops: compliance.stops,
            lever: mount.leg.l1,
            inertia,
        })
    }
}

/// Joints of four legs; `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy)]
pub struct AbductionJoints<T> {
    /// Position of the axis in the trunk frame, left and up \[m\].
    pub axis: [T; 2],
    /// Least and greatest angle \[rad\].
    range: [T; 2],
    friction: T,
    stops: Element<T>,
    lever: T,
    inertia: T,
    law: JointLaw,
}

/// Law of the drives of the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
enum JointLaw {
    /// No drives.
    Free,
    /// Position servos.
    Servo(ServoLaw),
    /// Motors of this inertia, under torque–rate lines \[kg·m²\].
    Motor(f64),
}

impl JointLaw {
    /// Returns the inertia of a drive \[kg·m²\].
    const fn inertia(&self) -> f64 {
        match self {
            Self::Free => 0.0,
            Self::Servo(servo) => servo.inertia(),
            Self::Motor(inertia) => *inertia,
        }
    }
}

/// Torque of stops and friction of a joint.
#[derive(Debug, Clone, Copy)]
pub struct Resistance<L> {
    /// Torque on the leg \[N·m\].
    pub torque: L,
    /// Dissipated power \[W\].
    pub dissipated: L,
    /// Depth of the nearer stop, negative where it is not reached \[m\], and its rate \[m/s\].
    pub depth: L,
    /// See [`Self::depth`].
    pub depth_rate: L,
}

impl AbductionJoints<Quad> {
    /// Places the joints of the selected legs of a robot side by side.
    ///
    /// # Errors
    /// As [`Setup::abducting_mounts`], [`Setup::abduction_servo`] and [`Setup::drive_models`], and
    /// [`LeggedError::Compliance`].
    pub fn new(robot: &Robot, setup: &Setup) -> Result<Self, LeggedError> {
        setup.compliances(robot)?;
        let law = match (setup.abduction_servo(robot)?, setup.drive_models(robot)?) {
            (Some(servo), _) => JointLaw::Servo(ServoLaw::from(&servo)),
            (None, Some(DriveModels::Motors(motors))) => {
                let inertia = |motor: LegMotor| JointLaw::Motor(motor.inertia());
                motors.abduction.map_or(JointLaw::Free, inertia)
            }
            (None, _) => JointLaw::Free,
        };
        let inertia = law.inertia();
        let mut legs = [Constants::ABSENT; LANES];
        for (leg, mount) in legs.iter_mut().zip(setup.abducting_mounts(robot)?) {
            *leg = Constants::new(mount, inertia).unwrap_or(Constants::ABSENT);
        }
        Ok(Self::side_by_side(&legs, law))
    }

    /// Returns the same for coordinates whose origin is `centre` from that of the trunk \[m\].
    #[must_use]
    pub fn about(mut self, [_, y, z]: [f64; 3]) -> Self {
        for (axis, by) in self.axis.iter_mut().zip([y, z]) {
            axis.0.iter_mut().for_each(|place| *place -= by);
        }
        self
    }

    fn side_by_side(legs: &[Constants; LANES], law: JointLaw) -> Self {
        let quad = |of: &dyn Fn(&Constants) -> f64| Quad(legs.each_ref().map(of));
        Self {
            axis: [0, 1].map(|i| quad(&|leg| leg.axis[i])),
            range: [0, 1].map(|i| quad(&|leg| leg.range[i])),
            friction: quad(&|leg| leg.friction),
            stops: Element::side_by_side(legs.map(|leg| leg.stops)),
            lever: quad(&|leg| leg.lever),
            inertia: quad(&|leg| leg.inertia),
            law,
        }
    }

    /// Loads the joints into lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> AbductionJoints<S::Lanes> {
        AbductionJoints {
            axis: simd.load_all(&self.axis),
            range: simd.load_all(&self.range),
            friction: simd.load(self.friction),
            stops: self.stops.load(simd),
            lever: simd.load(self.lever),
            inertia: simd.load(self.inertia),
            law: self.law,
        }
    }
}

impl<T> AbductionJoints<T> {
    /// Returns the inertia of a drive \[kg·m²\].
    pub fn inertia(&self) -> f64 {
        self.law.inertia()
    }
}

impl<L: Lanes> AbductionJoints<L> {
    /// Returns the depth of the nearer stop \[m\], and its derivative with respect to the angle
    /// \[m/rad\].
    #[inline(always)]
    fn depth(&self, angle: L) -> [L; 2] {
        let [least, greatest] = self.range;
        let (inside, beyond) = (least - angle, angle - greatest);
        let upper = beyond.gt(inside);
        [
            self.lever * beyond.or(upper, inside),
            self.lever.or(upper, -self.lever),
        ]
    }

    /// Returns the torque at an angle \[rad\] and its rate \[rad/s\].
    #[inline(always)]
    pub fn resistance(&self, angle: L, rate: L) -> Resistance<L> {
        let [depth, slope] = self.depth(angle);
        let depth_rate = slope * rate;
        let press = self.stops.press(depth, depth_rate);
        let rubbed = self.friction * rate;
        Resistance {
            torque: -(slope * press.force) - rubbed,
            dissipated: press.dissipated + rubbed * rate,
            depth,
            depth_rate,
        }
    }

    /// Returns the energy stored in the stops \[J\].
    #[inline(always)]
    pub fn energy(&self, angle: L) -> L {
        let [depth, _] = self.depth(angle);
        self.stops.energy(depth)
    }
}
