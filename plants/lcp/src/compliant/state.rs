//! State of the compliant model, and its time derivative.

use twinrig_compliant::lanes::{Lanes, Quad, Simd};
use twinrig_compliant::{BodyContact, Flows, JointState, Joints};

/// Positions and velocities of trunk, links and pulleys, with `N` links and `P` contact points a
/// leg. `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct State<T, const N: usize, const P: usize, const A: usize, const B: usize> {
    /// Position of the trunk's own centre of mass, world frame \[m\].
    pub(crate) position: T,
    /// Attitude of the trunk as a quaternion w, x, y, z from trunk to world, of any length.
    pub(crate) attitude: T,
    /// Velocity \[m/s\] and angular velocity of the trunk \[rad/s\], trunk axes.
    pub(crate) velocity: T,
    pub(crate) turning: T,
    /// Absolute angles of the links in the leg plane, zero straight down \[rad\], and their rates.
    pub(crate) angles: [T; N],
    pub(crate) rates: [T; N],
    /// Angle of the cable's pulley \[rad\], and its rate.
    pub(crate) pulley: T,
    pub(crate) pulley_rate: T,
    /// Deflection of the sole along the two tangents of the ground, by contact point \[m\].
    pub(crate) bristles: [[T; 2]; P],
    /// Joints of abduction, if legs have them.
    pub(crate) abduction: [JointState<T>; A],
    /// Contact of trunk, knees and ankles, if they have any.
    pub(crate) body: [BodyContact<T>; B],
}

/// Time derivative of a state, with powers and forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slope<T, const N: usize, const P: usize, const A: usize, const B: usize> {
    pub(crate) state: State<T, N, P, A, B>,
    pub(crate) flows: Flows<T>,
    /// Compressed elements.
    pub(crate) compressed: T,
}

impl<T: Copy, const N: usize, const P: usize, const A: usize, const B: usize> State<T, N, P, A, B> {
    /// Applies a function to all members.
    #[inline(always)]
    pub(crate) fn map<U: Copy>(&self, mut of: impl FnMut(T) -> U) -> State<U, N, P, A, B> {
        // The trunk first, as the search for the fastest leg requires.
        let (position, attitude) = (of(self.position), of(self.attitude));
        let (velocity, turning) = (of(self.velocity), of(self.turning));
        // `array::map` is not always inlined.
        let (mut angles, mut rates) = ([of(self.angles[0]); N], [of(self.rates[0]); N]);
        for i in 1..N {
            (angles[i], rates[i]) = (of(self.angles[i]), of(self.rates[i]));
        }
        let mut bristles = [[of(self.bristles[0][0]), of(self.bristles[0][1])]; P];
        for i in 1..P {
            bristles[i] = [of(self.bristles[i][0]), of(self.bristles[i][1])];
        }
        State {
            position,
            attitude,
            velocity,
            turning,
            angles,
            rates,
            pulley: of(self.pulley),
            pulley_rate: of(self.pulley_rate),
            bristles,
            abduction: JointState::map_each(&self.abduction, position, &mut of),
            body: BodyContact::map_each(&self.body, position, &mut of),
        }
    }

    /// Combines two states member by member.
    #[inline(always)]
    pub(crate) fn zip<U: Copy>(
        &self,
        other: &State<U, N, P, A, B>,
        mut of: impl FnMut(T, U) -> T,
    ) -> Self {
        let mut next = *self;
        next.position = of(self.position, other.position);
        next.attitude = of(self.attitude, other.attitude);
        next.velocity = of(self.velocity, other.velocity);
        next.turning = of(self.turning, other.turning);
        for i in 0..N {
            next.angles[i] = of(self.angles[i], other.angles[i]);
            next.rates[i] = of(self.rates[i], other.rates[i]);
        }
        next.pulley = of(self.pulley, other.pulley);
        next.pulley_rate = of(self.pulley_rate, other.pulley_rate);
        for i in 0..P {
            for k in 0..2 {
                next.bristles[i][k] = of(self.bristles[i][k], other.bristles[i][k]);
            }
        }
        for i in 0..A {
            next.abduction[i] = self.abduction[i].zip(&other.abduction[i], &mut of);
        }
        for i in 0..B {
            next.body[i] = self.body[i].zip(&other.body[i], &mut of);
        }
        next
    }
}

impl<T: Copy, const N: usize, const P: usize, const A: usize, const B: usize> Slope<T, N, P, A, B> {
    /// Applies a function to all members.
    #[inline(always)]
    pub(crate) fn map<U: Copy>(&self, mut of: impl FnMut(T) -> U) -> Slope<U, N, P, A, B> {
        Slope {
            state: self.state.map(&mut of),
            flows: self.flows.map(&mut of),
            compressed: of(self.compressed),
        }
    }
}

impl<const N: usize, const P: usize, const A: usize, const B: usize> State<Quad, N, P, A, B> {
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> State<S::Lanes, N, P, A, B> {
        self.map(|quad| simd.load(quad))
    }
}

impl<L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize>
    State<L, N, P, A, B>
{
    #[inline(always)]
    pub(crate) fn store(&self) -> State<Quad, N, P, A, B> {
        self.map(L::quad)
    }
}

impl<L: Copy, const N: usize, const P: usize, const A: usize, const B: usize> State<L, N, P, A, B> {
    /// Returns the motion of links and pulleys.
    #[inline(always)]
    pub(crate) fn joints(&self) -> Joints<'_, L, N> {
        Joints {
            angles: &self.angles,
            rates: &self.rates,
            pulley: self.pulley,
            pulley_rate: self.pulley_rate,
        }
    }

    /// Returns the motion of the trunk: position, attitude, velocity and angular velocity.
    #[inline(always)]
    pub(crate) fn trunk(&self) -> [L; 4] {
        [self.position, self.attitude, self.velocity, self.turning]
    }
}
