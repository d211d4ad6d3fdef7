//! Derivatives of the right-hand side: a column of the Jacobian is the right-hand side in dual numbers, and exact.

use crate::constants::Constants;
use crate::flow::Flow;
use crate::motion::{Bench, Scene};
use crate::real::{Dual, Lanes, Real, Wide};
use crate::state::{Slope, State};

/// A direction in which a state may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Position(usize),
    Attitude(usize),
    Velocity(usize),
    Turning(usize),
    Angle(usize),
    Rate(usize),
    Pulley,
    PulleyRate,
}

impl<const N: usize> Constants<Lanes, N> {
    /// The same numbers, none of which changes.
    pub(crate) fn still(&self) -> Constants<Dual<Lanes>, N> {
        let still = |x: Lanes| Dual::of(x);
        Constants {
            hip: self.hip.map(still),
            links: self.links.map(still),
            mass: still(self.mass),
            moments: self.moments.map(still),
            inertias: self.inertias.map(|row| row.map(still)),
            friction: self.friction.map(still),
            l_delta: still(self.l_delta),
            diagonal: self.diagonal.map(still),
            parallel: self.parallel.map(still),
            toe: self.toe.map(still),
            diagonal_max: still(self.diagonal_max),
            diagonal_min: still(self.diagonal_min),
            parallel_max: still(self.parallel_max),
            cable_max: still(self.cable_max),
            pulley_radius: still(self.pulley_radius),
        }
    }
}

impl<const N: usize> State<Lanes, N> {
    /// The state as it sets out in a direction, as fast in each leg as `seed` says; of the trunk's directions, as its first
    /// lane says.
    fn towards(&self, direction: Direction, seed: Lanes) -> State<Dual<Lanes>, N> {
        let still = |value: f64| Dual { value, slope: 0.0 };
        let mut state = State {
            position: self.position.map(still),
            attitude: self.attitude.map(still),
            velocity: self.velocity.map(still),
            turning: self.turning.map(still),
            angles: self.angles.map(Dual::of),
            rates: self.rates.map(Dual::of),
            pulley: Dual::of(self.pulley),
            pulley_rate: Dual::of(self.pulley_rate),
        };
        let one = seed.lane(0);
        match direction {
            Direction::Position(i) => state.position[i].slope = one,
            Direction::Attitude(i) => state.attitude[i].slope = one,
            Direction::Velocity(i) => state.velocity[i].slope = one,
            Direction::Turning(i) => state.turning[i].slope = one,
            Direction::Angle(i) => state.angles[i].slope = seed,
            Direction::Rate(i) => state.rates[i].slope = seed,
            Direction::Pulley => state.pulley.slope = seed,
            Direction::PulleyRate => state.pulley_rate.slope = seed,
        }
        state
    }
}

impl<const N: usize> Slope<Dual<Lanes>, N> {
    /// How fast it changes.
    fn change(&self) -> Slope<Lanes, N> {
        let slope = |x: Dual<f64>| x.slope;
        let slopes = |x: Dual<Lanes>| x.slope;
        Slope {
            position: self.position.map(slope),
            attitude: self.attitude.map(slope),
            velocity: self.velocity.map(slope),
            turning: self.turning.map(slope),
            angles: self.angles.map(slopes),
            rates: self.rates.map(slopes),
            pulley: slopes(self.pulley),
            pulley_rate: slopes(self.pulley_rate),
            dissipated: slopes(self.dissipated),
            actuator: slopes(self.actuator),
        }
    }
}

impl<const N: usize> Flow<N> {
    /// The derivative of the right-hand side in one direction. On a trunk that is held, each leg has one of its own for the
    /// price of one; otherwise a leg moves the others, and `seed` picks the leg.
    #[inline(never)]
    pub(crate) fn column(
        &mut self,
        legs: &Constants<Dual<Lanes>, N>,
        state: &State<Lanes, N>,
        direction: Direction,
        seed: Lanes,
        recovery: f64,
        bench: &mut Bench<Dual<f64>, N>,
    ) -> Slope<Lanes, N> {
        self.counts.evaluations += 1;
        let scene = Scene::new(&self.model, legs, &self.mode, recovery);
        let motion = scene.motion(&state.towards(direction, seed), bench);
        motion.slope.change()
    }
}
