//! Motion at constant momentum: the half steps before and after the impulses.
//!
//! ```text
//! x_c ← x_c + τ V        R ← R exp(τ ω)        θ ← θ + τ θ̇        τ = ½h
//! ```
//!
//! The velocity V of the robot's centre of mass, the angular momentum L about it and the momenta p
//! of the links are constant. The velocities are those that correspond to them in the middle of the
//! step, where the impulses act:
//!
//! ```text
//! H(θ̄) u_a = (R̄ᵀL, p)        H(θ̄) u_b = (R̄ᵀL⁺, p⁺)        T = 1 + ½ x̂ + β x̂²,  x = τω
//! RᵀL = T(τω_a) Π_a           R⁺ᵀL⁺ = T(−τω_b) Π_b
//! R̄ᵀL = T(−τω_a) Π_a          R̄ᵀL⁺ = T(τω_b) Π_b
//! ```
//!
//! This is the generalised leapfrog, which is symplectic; T makes it so for rotations (dexp⁻ᵀ,
//! Hairer, Lubich and Wanner, *Geometric Numerical Integration*, 2006, III.4 and VI.3). V and L
//! change under external forces only: momentum is balanced to round-off, and a robot in flight
//! follows its parabola at any step size.

use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::articulated::Articulated;
use crate::model::coupling::COUPLED;
use crate::model::real::{Lanes, Real};
use crate::model::rotation::{into_trunk, into_world, quaternion_rate, rotation};
use crate::model::state::State;
use crate::model::trunk::{Spatial, cross, reduced};
use twinrig_robot::GRAVITY;

use super::momentum::{Body, Geometry, Momenta};

/// Change of the rates at which the iteration has converged \[rad/s\], and the same as a share of
/// the maximum rate. The remaining error is some hundredths of that.
pub(super) const RATE_TOLERANCE: f64 = 1e-7;
pub(super) const RATE_TOLERANCE_RELATIVE: f64 = 1e-6;

/// Maximum number of iterations; a step that needs more rotates links by too much.
pub(super) const ITERATIONS_MAX: u32 = 16;

/// Momentum of the robot, world frame: position \[m\] and velocity \[m/s\] of its centre of mass,
/// and angular momentum about it \[kg·m²/s\]. In directions in which the trunk may not move, the
/// values are the trunk's: there, trunk and world share an axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Momentum {
    pub(super) position: [f64; 3],
    pub(super) velocity: [f64; 3],
    pub(super) spin: [f64; 3],
    moves: [bool; 6],
}

impl Momentum {
    /// Computes the momentum of a robot in a state. `relative` is the velocity of its centre of
    /// mass relative to the trunk's, trunk axes.
    pub(super) fn of<const N: usize>(
        model: &Model<N>,
        state: &State<Lanes, N>,
        body: &Body,
        relative: [f64; 3],
        spin: [f64; 3],
    ) -> Self {
        let upright = rotation(state.attitude);
        let offset = into_world(&upright, body.offset());
        let moving = std::array::from_fn(|i| state.velocity[i] + relative[i]);
        let moving = into_world(&upright, moving);
        let mut momentum = Self {
            position: state.position,
            velocity: into_world(&upright, state.velocity),
            spin: into_world(&upright, spin),
            moves: model.trunk.moves,
        };
        for i in momentum.free_axes() {
            momentum.position[i] += offset[i];
            momentum.velocity[i] = moving[i];
        }
        momentum
    }

    fn free_axes(&self) -> impl Iterator<Item = usize> + use<> {
        let moves = self.moves;
        (0..3).filter(move |&i| moves[i])
    }

    /// Adds impulses on trunk and legs, trunk axes in the middle of the step, and the weight over
    /// `seconds`. Returns the change of the velocity of the centre of mass, trunk axes.
    pub(super) fn apply<const N: usize>(
        &mut self,
        impulse: &Spatial<f64>,
        middle: &Articulated<Lanes, N>,
        body: &Body,
        seconds: f64,
    ) -> [f64; 3] {
        let upright = middle.rotation();
        let [x, y, z, roll, pitch, yaw] = *impulse;
        let lever = cross(body.offset(), [x, y, z]);
        let turn = into_world(
            &upright,
            [roll - lever[0], pitch - lever[1], yaw - lever[2]],
        );
        for (spin, turn) in self.spin.iter_mut().zip(turn) {
            *spin += turn;
        }
        let push = into_world(&upright, [x, y, z]);
        let mut change = [0.0; 3];
        for i in self.free_axes() {
            change[i] = push[i] / body.mass;
        }
        change[2] -= seconds * GRAVITY;
        for (velocity, change) in self.velocity.iter_mut().zip(change) {
            *velocity += change;
        }
        into_trunk(&upright, change)
    }

    /// Shifts the centre of mass by an impulse over `seconds` that changes no velocity.
    pub(super) fn shift<const N: usize>(
        &mut self,
        push: [f64; 3],
        middle: &Articulated<Lanes, N>,
        body: &Body,
        seconds: f64,
    ) {
        let push = into_world(&middle.rotation(), push);
        for i in self.free_axes() {
            self.position[i] += seconds * push[i] / body.mass;
        }
    }

    /// Sets position and velocity of the trunk at its known attitude.
    pub(super) fn place_trunk<const N: usize>(
        &self,
        state: &mut State<Lanes, N>,
        body: &Body,
        relative: [f64; 3],
    ) {
        let upright = rotation(state.attitude);
        let offset = into_world(&upright, body.offset());
        state.position = self.position;
        state.velocity = into_trunk(&upright, self.velocity);
        for i in self.free_axes() {
            state.position[i] -= offset[i];
            state.velocity[i] -= relative[i];
        }
    }

    /// Returns the angular momentum in trunk axes.
    pub(super) fn spin_in(&self, attitude: [f64; 4]) -> [f64; 3] {
        into_trunk(&rotation(attitude), self.spin)
    }

    /// Advances the centre of mass at constant velocity.
    pub(super) fn drift(&mut self, seconds: f64) {
        for (x, v) in self.position.iter_mut().zip(&self.velocity) {
            *x += seconds * v;
        }
    }
}

/// Returns T(x) Π.
pub(super) fn transported(x: [f64; 3], spin: [f64; 3]) -> [f64; 3] {
    /// Coefficients of β = (1 − ½x cot ½x)/x² by powers of x².
    const BETA: [f64; 6] = [
        1.0 / 12.0,
        1.0 / 720.0,
        1.0 / 30_240.0,
        1.0 / 1_209_600.0,
        1.0 / 47_900_160.0,
        691.0 / 1_307_674_368_000.0,
    ];
    let square: f64 = x.iter().map(|x| x * x).sum();
    let beta = BETA.iter().rev().fold(0.0, |sum, b| sum * square + b);
    let once = cross(x, spin);
    let twice = cross(x, once);
    std::array::from_fn(|i| spin[i] + 0.5 * once[i] + beta * twice[i])
}

/// Returns the attitude after a rotation at constant angular velocity.
pub(super) fn rotated(attitude: [f64; 4], turning: [f64; 3], seconds: f64) -> [f64; 4] {
    let square: f64 = turning.iter().map(|rate| rate * rate).sum();
    let angle = 0.5 * seconds * libm::sqrt(square);
    let (sine, cosine) = Real::sin_cos(angle);
    let share = if angle > 0.0 { sine / angle } else { 1.0 };
    let rate = quaternion_rate(attitude, turning);
    let next: [f64; 4] = std::array::from_fn(|i| cosine * attitude[i] + share * seconds * rate[i]);
    let square: f64 = next.iter().map(|c| c * c).sum();
    let scale = 1.0 / libm::sqrt(square);
    next.map(|c| c * scale)
}

/// Advances links and pulleys at constant rates.
#[inline(always)]
pub(super) fn advance_joints<const N: usize>(state: &mut State<Lanes, N>, seconds: f64) {
    let h = Lanes::splat(seconds);
    for (angle, rate) in state.angles.iter_mut().zip(&state.rates) {
        *angle += h * *rate;
    }
    state.pulley += h * state.pulley_rate;
}

/// Rates of links and angular velocity of the trunk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rates<const N: usize> {
    pub(super) links: [Lanes; N],
    pub(super) turning: [f64; 3],
}

impl<const N: usize> Rates<N> {
    /// Returns the rates of a state.
    pub(super) fn of(state: &State<Lanes, N>) -> Self {
        Self {
            links: state.rates,
            turning: state.turning,
        }
    }
}

/// Returns the lanes in which an iteration has converged: all together for a moving trunk, each leg
/// separately on a fixed one.
pub(super) fn converged(
    free: bool,
    mut change: Lanes,
    mut size: Lanes,
    turn: [f64; 2],
    seconds: f64,
) -> Result<Lanes, StepError> {
    if free {
        change = Lanes::splat(change.sum() + turn[0]);
        size = Lanes::splat(size.sum() + turn[1]);
    }
    // A sum propagates NaN. A diverging iteration needs a shorter step.
    if !change.sum().is_finite() {
        return Err(StepError::NotConverged { seconds });
    }
    Ok(change.simd_le(Lanes::splat(RATE_TOLERANCE) + Lanes::splat(RATE_TOLERANCE_RELATIVE) * size))
}

impl<const N: usize> Articulated<Lanes, N> {
    /// Returns the changes of the rates by changes of the momenta, with the centre of mass at rest.
    #[inline(always)]
    pub(super) fn rate_changes(&self, links: &[Lanes; N], spin: [f64; 3]) -> Rates<N> {
        self.rates_of(links, spin, Lanes::zero())
    }

    /// Returns the rates at these momenta, where hips that follow their commands turn at `hip`; the
    /// inertia is that at an end of a step.
    #[inline(always)]
    pub(super) fn rates_of(&self, links: &[Lanes; N], spin: [f64; 3], hip: Lanes) -> Rates<N> {
        let imposed = self.mobility.imposed.map(|rate| rate * hip);
        let add = |moved: [Lanes; N]| std::array::from_fn(|i| moved[i] + imposed[i]);
        let mut rates = Rates {
            links: add(self.mobility.change(links)),
            turning: [0.0; 3],
        };
        let Some(base) = &self.base else {
            return rates;
        };
        let force = [0.0, 0.0, 0.0, spin[0], spin[1], spin[2]];
        let trunk = base
            .schur
            .solve(reduced(force, &base.coupling, &rates.links));
        let mut left = *links;
        for (left, column) in left.iter_mut().zip(&base.coupling.columns) {
            for (c, &row) in column.iter().zip(&COUPLED) {
                *left -= *c * Lanes::splat(trunk[row]);
            }
        }
        rates.links = add(self.mobility.change(&left));
        rates.turning.copy_from_slice(&trunk[3..]);
        rates
    }
}

/// Half step whose rates follow from the momenta at its end.
pub(super) struct HalfStep<'a, const N: usize> {
    pub(super) model: &'a Model<N>,
    /// Inertia at its start.
    pub(super) inertia: &'a Articulated<Lanes, N>,
    pub(super) hip_inertia: Lanes,
    pub(super) seconds: f64,
}

impl<const N: usize> HalfStep<'_, N> {
    /// Computes the rates in the middle by Newton's method with the inertia of the start, and the
    /// momenta at the last iterate but one. Hips that follow their commands keep their rate.
    pub(super) fn rates(
        &self,
        angles: &[Lanes; N],
        start: Rates<N>,
        momenta: &Momenta<N>,
    ) -> Result<(Rates<N>, Momenta<N>), StepError> {
        let legs = &self.model.side_by_side;
        let h = Lanes::splat(self.seconds);
        let free = self.model.is_free();
        let mut rates = start;
        let mut last: Option<(Momenta<N>, Lanes)> = None;
        for _ in 0..ITERATIONS_MAX {
            let angles_after: [Lanes; N] = std::array::from_fn(|i| angles[i] + h * rates.links[i]);
            let geometry = Geometry::at(self.model, &angles_after);
            let mut found = geometry.momenta(legs, &rates.links, rates.turning);
            let mut missing: [Lanes; N] =
                std::array::from_fn(|i| momenta.links[i] - found.links[i]);
            missing[0] -= self.hip_inertia * (rates.links[0] - start.links[0]);
            let x = rates.turning.map(|rate| self.seconds * rate);
            let back = transported(x, found.spin);
            let spin = std::array::from_fn(|i| momenta.spin[i] - back[i]);
            let more = self.inertia.rate_changes(&missing, spin);
            let (mut change, mut size) = (Lanes::zero(), Lanes::zero());
            for (rate, more) in rates.links.iter().zip(&more.links) {
                change += more.abs();
                size += rate.abs();
            }
            let sum = |v: [f64; 3]| v.iter().map(|x| x.abs()).sum::<f64>();
            let turn = [sum(more.turning), sum(rates.turning)];
            let mut done = converged(free, change, size, turn, 2.0 * self.seconds)?;
            let mut steps = more.links;
            if let Some((last, converged)) = &last {
                // Legs on a fixed trunk are independent: converged rates stay unchanged.
                done |= *converged;
                for i in 0..N {
                    steps[i] = converged.bitselect(Lanes::zero(), steps[i]);
                    found.links[i] = converged.bitselect(last.links[i], found.links[i]);
                    found.gradients[i] = converged.bitselect(last.gradients[i], found.gradients[i]);
                }
            }
            for (rate, step) in rates.links.iter_mut().zip(steps) {
                *rate += step;
            }
            for (rate, more) in rates.turning.iter_mut().zip(more.turning) {
                *rate += more;
            }
            if done.all() {
                return Ok((rates, found));
            }
            last = (!free).then_some((found, done));
        }
        let seconds = 2.0 * self.seconds;
        Err(StepError::NotConverged { seconds })
    }
}
