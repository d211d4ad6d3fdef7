//! The state: positions and velocities of trunk, links and pulleys, and their derivatives.

use crate::model::real::{Lanes, Real};

/// Positions and velocities. `R` is the number type of the legs, `R::Sum` that of the trunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct State<R: Real, const N: usize> {
    /// Position of the trunk's own centre of mass, world frame \[m\].
    pub(crate) position: [R::Sum; 3],
    /// Attitude of the trunk as a quaternion w, x, y, z from trunk to world.
    pub(crate) attitude: [R::Sum; 4],
    /// Velocity of the trunk's centre of mass \[m/s\] and angular velocity \[rad/s\], trunk axes.
    pub(crate) velocity: [R::Sum; 3],
    pub(crate) turning: [R::Sum; 3],
    /// Absolute angles of the links in the leg plane, zero straight down \[rad\], and their rates.
    pub(crate) angles: [R; N],
    pub(crate) rates: [R; N],
    /// Angle of the cable's pulley \[rad\].
    pub(crate) pulley: R,
    pub(crate) pulley_rate: R,
}

/// Time derivative of a state, with powers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slope<R: Real, const N: usize> {
    pub(crate) position: [R::Sum; 3],
    pub(crate) attitude: [R::Sum; 4],
    pub(crate) velocity: [R::Sum; 3],
    pub(crate) turning: [R::Sum; 3],
    pub(crate) angles: [R; N],
    pub(crate) rates: [R; N],
    pub(crate) pulley: R,
    pub(crate) pulley_rate: R,
    /// Power dissipated by friction, power of the motors and of pushes, by leg \[W\].
    pub(crate) dissipated: R,
    pub(crate) actuator: R,
    pub(crate) external: R,
}

fn axpy<R: Real, const M: usize>(x: &mut [R; M], h: R, slope: &[R; M]) {
    for i in 0..M {
        x[i] += h * slope[i];
    }
}

impl<R: Real, const N: usize> State<R, N> {
    /// Advances along a slope by `h` seconds, which may differ between legs on a fixed trunk.
    #[inline(always)]
    pub(crate) fn along(&self, h: R, slope: &Slope<R, N>, free: bool) -> Self {
        let mut next = *self;
        if free {
            let h = h.lane(0);
            axpy(&mut next.position, h, &slope.position);
            axpy(&mut next.attitude, h, &slope.attitude);
            axpy(&mut next.velocity, h, &slope.velocity);
            axpy(&mut next.turning, h, &slope.turning);
        }
        axpy(&mut next.angles, h, &slope.angles);
        axpy(&mut next.rates, h, &slope.rates);
        next.pulley += h * slope.pulley;
        next.pulley_rate += h * slope.pulley_rate;
        next
    }
}

/// Returns the state with its attitude normalised.
#[inline(always)]
pub(crate) fn normalised<const N: usize>(state: &State<Lanes, N>, free: bool) -> State<Lanes, N> {
    let mut next = *state;
    if free {
        let square: f64 = next.attitude.iter().map(|c| c * c).sum();
        let scale = 1.0 / libm::sqrt(square);
        next.attitude = next.attitude.map(|c| c * scale);
    }
    next
}

impl<R: Real, const N: usize> Slope<R, N> {
    pub(crate) fn zero() -> Self {
        let (zero, none) = (R::zero(), <R::Sum as Real>::zero());
        Self {
            position: [none; 3],
            attitude: [none; 4],
            velocity: [none; 3],
            turning: [none; 3],
            angles: [zero; N],
            rates: [zero; N],
            pulley: zero,
            pulley_rate: zero,
            dissipated: zero,
            actuator: zero,
            external: zero,
        }
    }

    /// Adds `weight` times another slope.
    #[inline(always)]
    pub(crate) fn add(&mut self, weight: f64, other: &Self, free: bool) {
        let (w, t) = (R::splat(weight), <R::Sum as Real>::splat(weight));
        if free {
            axpy(&mut self.position, t, &other.position);
            axpy(&mut self.attitude, t, &other.attitude);
            axpy(&mut self.velocity, t, &other.velocity);
            axpy(&mut self.turning, t, &other.turning);
        }
        axpy(&mut self.angles, w, &other.angles);
        axpy(&mut self.rates, w, &other.rates);
        self.pulley += w * other.pulley;
        self.pulley_rate += w * other.pulley_rate;
        self.dissipated += w * other.dissipated;
        self.actuator += w * other.actuator;
        self.external += w * other.external;
    }
}
