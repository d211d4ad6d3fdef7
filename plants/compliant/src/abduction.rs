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

use twinrig_robot::{LegMount, OneSided};

use crate::element::Element;
use crate::ground::{Point, TrunkMotion};
use crate::lanes::{LANES, Lanes, Quad, Simd};

/// Joint of one leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbductionConstants {
    /// Position of the axis in the trunk frame, left and up \[m\].
    pub axis: [f64; 2],
    /// Least and greatest angle \[rad\].
    pub range: [f64; 2],
    /// Viscous friction \[N·m·s/rad\].
    pub friction: f64,
    /// Stops at both ends of the range.
    pub stops: OneSided,
    /// Distance of the stops from the axis \[m\].
    pub lever: f64,
}

impl AbductionConstants {
    /// Placeholder for an absent leg.
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
    };

    /// Returns the joint of a leg with compliant stops, if the leg has one.
    pub fn new(mount: &LegMount) -> Option<Self> {
        let (joint, compliance) = (mount.leg.abduction?, mount.leg.compliance?);
        let [_, y, z] = mount.hip;
        let is_right = y < 0.0;
        let (inward, range) = if is_right {
            (joint.offset, [-joint.abduction_max, joint.adduction_max])
        } else {
            (-joint.offset, [-joint.adduction_max, joint.abduction_max])
        };
        Some(Self {
            axis: [y + inward, z + joint.height],
            range,
            friction: joint.friction,
            stops: compliance.stops,
            lever: mount.leg.l1,
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
    /// Places the joints of up to four legs side by side.
    pub fn side_by_side(legs: &[AbductionConstants]) -> Self {
        let legs: [AbductionConstants; LANES] = std::array::from_fn(|lane| {
            let leg = legs.get(lane).copied();
            leg.unwrap_or(AbductionConstants::ABSENT)
        });
        let quad = |of: &dyn Fn(&AbductionConstants) -> f64| Quad(legs.each_ref().map(of));
        Self {
            axis: [0, 1].map(|i| quad(&|leg| leg.axis[i])),
            range: [0, 1].map(|i| quad(&|leg| leg.range[i])),
            friction: quad(&|leg| leg.friction),
            stops: Element::side_by_side(legs.map(|leg| leg.stops)),
            lever: quad(&|leg| leg.lever),
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
        }
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

    /// Returns the frames that carry the legs, at these angles \[rad\] and rates \[rad/s\].
    #[inline(always)]
    pub fn frame(&self, angle: L, rate: L, trunk: &TrunkMotion) -> LegFrame<L> {
        let ([sine], [cosine]) = L::sin_cos([angle]);
        let ([y, z], zero) = (self.axis, angle.zero());
        let [wx, wy, wz] = trunk.turning;
        let [vx, vy, vz] = trunk.velocity;
        // ω × a, then ω × (ω × a).
        let around = [z * wy - y * wz, zero - z * wx, y * wx];
        let inward = [
            around[2] * wy - around[1] * wz,
            around[0] * wz - around[2] * wx,
            around[1] * wx - around[0] * wy,
        ];
        let turning = [zero.like(wx), zero.like(wy), zero.like(wz)];
        let field = std::array::from_fn(|i| zero.like(trunk.field[i]) - inward[i]);
        let mut frame = LegFrame {
            sine,
            cosine,
            axis: self.axis,
            velocity: [around[0] + vx, around[1] + vy, around[2] + vz],
            turning,
            field,
            swing: [zero; 2],
        };
        frame.velocity = frame.into_leg(frame.velocity);
        frame.field = frame.into_leg(frame.field);
        let [x, y, z] = frame.into_leg(turning);
        frame.turning = [x + rate, y, z];
        frame.swing = [rate * z, -(rate * y)];
        frame
    }
}

/// Frames that carry legs, whose origins lie on the axes of abduction.
#[derive(Debug, Clone, Copy)]
pub struct LegFrame<L> {
    sine: L,
    cosine: L,
    /// Left and up \[m\].
    pub axis: [L; 2],
    /// V and Ω, leg axes \[m/s, rad/s\].
    pub velocity: [L; 3],
    /// See [`Self::velocity`].
    pub turning: [L; 3],
    /// Rᵀ (g − ω × (v + ω × a)) \[m/s²\].
    pub field: [L; 3],
    /// Angular acceleration without those of trunk and joint, about the second and the third axis of
    /// the leg \[rad/s²\].
    pub swing: [L; 2],
}

impl<L: Lanes> LegFrame<L> {
    /// Transforms a vector from trunk to leg axes.
    #[inline(always)]
    #[must_use]
    pub fn into_leg(&self, [x, y, z]: [L; 3]) -> [L; 3] {
        [
            x,
            self.cosine * y + self.sine * z,
            self.cosine * z - self.sine * y,
        ]
    }

    /// Transforms a vector from leg to trunk axes.
    #[inline(always)]
    #[must_use]
    pub fn into_trunk(&self, [x, y, z]: [L; 3]) -> [L; 3] {
        [
            x,
            self.cosine * y - self.sine * z,
            self.sine * y + self.cosine * z,
        ]
    }

    /// Transforms a symmetric matrix, row by row up to the diagonal, from leg to trunk axes.
    #[inline(always)]
    #[must_use]
    pub fn tensor_into_trunk(&self, [xx, yx, yy, zx, zy, zz]: [L; 6]) -> [L; 6] {
        let (s, c) = (self.sine, self.cosine);
        let (difference, mixed) = (yy - zz, s * c);
        let shift = s * s * difference + (mixed + mixed) * zy;
        [
            xx,
            c * yx - s * zx,
            yy - shift,
            s * yx + c * zx,
            mixed * difference + (c * c - s * s) * zy,
            zz + shift,
        ]
    }

    /// Transforms a point and its velocity within the leg, in leg axes, to those in trunk axes.
    #[inline(always)]
    #[must_use]
    pub fn point(&self, [x, y, z]: [L; 3], [u, w]: [L; 2]) -> Point<L> {
        let ([wx, wy, wz], [vx, vy, vz]) = (self.turning, self.velocity);
        let [px, py, pz] = self.into_trunk([x, y, z]);
        let [left, up] = self.axis;
        Point {
            place: [px, py + left, pz + up],
            velocity: self.into_trunk([
                u + (z * wy - y * wz + vx),
                x * wz - z * wx + vy,
                w + (y * wx - x * wy + vz),
            ]),
        }
    }

    /// Returns a force and a torque about the axis, in leg axes, as a force and a torque about the
    /// origin of the trunk in its axes.
    #[inline(always)]
    #[must_use]
    pub fn wrench_into_trunk(&self, force: [L; 3], torque: [L; 3]) -> [[L; 3]; 2] {
        let [fx, fy, fz] = self.into_trunk(force);
        let [x, y, z] = self.into_trunk(torque);
        let [left, up] = self.axis;
        [
            [fx, fy, fz],
            [x + (left * fz - up * fy), y + up * fx, z - left * fx],
        ]
    }

    /// Returns the acceleration of the frame that belongs to that of the trunk: A and Rᵀ ω̇.
    #[inline(always)]
    #[must_use]
    pub fn acceleration(&self, trunk: [f64; 6]) -> [[L; 3]; 2] {
        let [left, up] = self.axis;
        let [x, y, z, roll, pitch, yaw] = trunk;
        let linear = self.into_leg([up * pitch - left * yaw + x, up * -roll + y, left * roll + z]);
        let zero = left.zero();
        let angular = self.into_leg([zero.like(roll), zero.like(pitch), zero.like(yaw)]);
        [linear, angular]
    }
}
