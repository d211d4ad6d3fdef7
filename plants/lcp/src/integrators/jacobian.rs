//! Exact derivatives of the right-hand side: a column of the Jacobian is the right-hand side in
//! dual numbers.

use crate::constraints::mode::Mode;
use crate::constraints::motion::Dynamics;
use crate::constraints::workspace::Workspace;
use crate::model::Model;
use crate::model::constants::Constants;
use crate::model::real::{Dual, Lanes, Real, Wide};
use crate::model::state::{Slope, State};

/// Coordinate direction of the state.
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
    /// Returns the same constants with zero derivatives.
    pub(crate) fn as_dual(&self) -> Constants<Dual<Lanes>, N> {
        let constant = |x: Lanes| Dual::of(x);
        Constants {
            hip: self.hip.map(constant),
            links: self.links.map(constant),
            mass: constant(self.mass),
            moments: self.moments.map(constant),
            inertias: self.inertias.map(|row| row.map(constant)),
            friction: self.friction.map(constant),
            l_delta: constant(self.l_delta),
            diagonal: self.diagonal.map(constant),
            parallel: self.parallel.map(constant),
            toe: self.toe.map(constant),
            diagonal_max: constant(self.diagonal_max),
            diagonal_min: constant(self.diagonal_min),
            parallel_max: constant(self.parallel_max),
            cable_max: constant(self.cable_max),
            pulley_radius: constant(self.pulley_radius),
        }
    }
}

impl<const N: usize> State<Lanes, N> {
    /// Returns the state as dual numbers with a derivative in one direction: `seed` by leg, and its
    /// first lane for directions of the trunk.
    fn seeded(&self, direction: Direction, seed: Lanes) -> State<Dual<Lanes>, N> {
        let constant = |value: f64| Dual { value, slope: 0.0 };
        let mut state = State {
            position: self.position.map(constant),
            attitude: self.attitude.map(constant),
            velocity: self.velocity.map(constant),
            turning: self.turning.map(constant),
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
    /// Returns the derivative parts.
    fn derivative(&self) -> Slope<Lanes, N> {
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
            external: slopes(self.external),
        }
    }
}

/// Jacobian of the right-hand side in a state and a mode, column by column.
pub(crate) struct Jacobian<'a, const N: usize> {
    pub(crate) model: &'a Model<N>,
    legs: Constants<Dual<Lanes>, N>,
    pub(crate) mode: &'a Mode,
    state: &'a State<Lanes, N>,
    recovery: f64,
    /// Number of evaluations of the right-hand side.
    pub(crate) evaluations: u64,
}

impl<'a, const N: usize> Jacobian<'a, N> {
    pub(crate) fn new(
        model: &'a Model<N>,
        mode: &'a Mode,
        state: &'a State<Lanes, N>,
        recovery: f64,
    ) -> Self {
        Self {
            model,
            legs: model.side_by_side.as_dual(),
            mode,
            state,
            recovery,
            evaluations: 0,
        }
    }

    /// Returns the derivative of the right-hand side in one direction. On a fixed trunk one
    /// evaluation yields the derivative of each leg; on a moving trunk the legs are coupled, and
    /// `seed` selects the leg.
    #[inline(never)]
    pub(crate) fn column(
        &mut self,
        direction: Direction,
        seed: Lanes,
        workspace: &mut Workspace<Dual<f64>, N>,
    ) -> Slope<Lanes, N> {
        self.evaluations += 1;
        let dynamics = Dynamics::new(self.model, &self.legs, self.mode, self.recovery);
        let motion = dynamics.motion(&self.state.seeded(direction, seed), workspace);
        motion.slope.derivative()
    }
}
