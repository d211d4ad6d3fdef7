//! State of the compliant model, and its time derivative.

use twinrig_compliant::lanes::{Lanes, Quad, Simd};
use twinrig_compliant::{BodyContact, Flows, JointState};

/// Positions and velocities of trunk, legs and pulleys. `T` is [`Quad`] in memory, or lanes.
///
/// The velocity of the foot determines the rates of the second and the third link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct State<T, const A: usize = 0, const B: usize = 0> {
    /// Position of the centre of mass of the trunk and the masses at its hips, world frame \[m\].
    pub(crate) position: T,
    /// Attitude of the trunk as a quaternion w, x, y, z from trunk to world, of any length.
    pub(crate) attitude: T,
    /// Velocity \[m/s\] and angular velocity of the trunk \[rad/s\], trunk axes.
    pub(crate) velocity: T,
    pub(crate) turning: T,
    /// Absolute angles of the links in the leg plane, zero straight down \[rad\].
    pub(crate) angles: [T; 3],
    /// Rate of the first \[rad/s\].
    pub(crate) hip_rate: T,
    /// Angle of the cable's pulley \[rad\], and its rate.
    pub(crate) pulley: T,
    pub(crate) pulley_rate: T,
    /// Velocity of the foot in the leg plane, forward and up \[m/s\].
    pub(crate) foot: [T; 2],
    /// Deflection of the sole along the two tangents of the ground \[m\].
    pub(crate) bristle: [T; 2],
    /// Joints of abduction, if legs have them.
    pub(crate) abduction: [JointState<T>; A],
    /// Contact of the trunk, if it has any.
    pub(crate) body: [BodyContact<T>; B],
}

/// Time derivative of a state, with powers and forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slope<T, const A: usize = 0, const B: usize = 0> {
    pub(crate) state: State<T, A, B>,
    pub(crate) flows: Flows<T>,
    /// Compressed elements.
    pub(crate) compressed: T,
}

impl<T: Copy, const A: usize, const B: usize> State<T, A, B> {
    /// Applies a function to all members.
    #[inline(always)]
    pub(crate) fn map<U: Copy>(&self, mut of: impl FnMut(T) -> U) -> State<U, A, B> {
        let [first, second, third] = self.angles;
        let ([x, z], [a, b]) = (self.foot, self.bristle);
        let position = of(self.position);
        State {
            position,
            attitude: of(self.attitude),
            velocity: of(self.velocity),
            turning: of(self.turning),
            angles: [of(first), of(second), of(third)],
            hip_rate: of(self.hip_rate),
            pulley: of(self.pulley),
            pulley_rate: of(self.pulley_rate),
            foot: [of(x), of(z)],
            bristle: [of(a), of(b)],
            abduction: JointState::map_each(&self.abduction, position, &mut of),
            body: BodyContact::map_each(&self.body, position, &mut of),
        }
    }

    /// Combines two states member by member.
    #[inline(always)]
    pub(crate) fn zip(&self, other: &Self, mut of: impl FnMut(T, T) -> T) -> Self {
        let mut next = *self;
        next.position = of(self.position, other.position);
        next.attitude = of(self.attitude, other.attitude);
        next.velocity = of(self.velocity, other.velocity);
        next.turning = of(self.turning, other.turning);
        for i in 0..3 {
            next.angles[i] = of(self.angles[i], other.angles[i]);
        }
        next.hip_rate = of(self.hip_rate, other.hip_rate);
        next.pulley = of(self.pulley, other.pulley);
        next.pulley_rate = of(self.pulley_rate, other.pulley_rate);
        for i in 0..2 {
            next.foot[i] = of(self.foot[i], other.foot[i]);
            next.bristle[i] = of(self.bristle[i], other.bristle[i]);
        }
        for i in 0..A {
            next.abduction[i] = self.abduction[i].zip(&other.abduction[i], &mut of);
        }
        for i in 0..B {
            next.body[i] = self.body[i].zip(&other.body[i], &mut of);
        }
        next
    }

    /// Returns the motion of the trunk: position, attitude, velocity and angular velocity.
    #[inline(always)]
    pub(crate) fn trunk(&self) -> [T; 4] {
        [self.position, self.attitude, self.velocity, self.turning]
    }
}

impl<const A: usize, const B: usize> State<Quad, A, B> {
    /// Returns a state at rest in the origin, with bent ankles.
    pub(crate) fn at_rest() -> Self {
        let zero = Quad::splat(0.0);
        Self {
            position: zero,
            attitude: Quad([1.0, 0.0, 0.0, 0.0]),
            velocity: zero,
            turning: zero,
            angles: [zero, zero, Quad::splat(1.0)],
            hip_rate: zero,
            pulley: zero,
            pulley_rate: zero,
            foot: [zero; 2],
            bristle: [zero; 2],
            abduction: [JointState::AT_REST; A],
            body: [BodyContact::RELAXED; B],
        }
    }

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> State<S::Lanes, A, B> {
        self.map(|quad| simd.load(quad))
    }
}

impl<L: Lanes, const A: usize, const B: usize> State<L, A, B> {
    #[inline(always)]
    pub(crate) fn store(&self) -> State<Quad, A, B> {
        self.map(L::quad)
    }
}
