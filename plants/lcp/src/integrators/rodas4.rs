//! RODAS: a six-stage Rosenbrock method of order 4 with an embedded method of order 3, L-stable and
//! stiffly accurate (Hairer and Wanner, *Solving Ordinary Differential Equations II*, 1996, section
//! IV.7; the coefficients are those of their code of that name, in the variables U of equation
//! 7.25).
//!
//! ```text
//! (I − hγ J) Uᵢ = hγ f(y + Σⱼ aᵢⱼ Uⱼ) + γ Σⱼ cᵢⱼ Uⱼ        y⁺ = y + Σⱼ mⱼ Uⱼ        y⁺ − ŷ⁺ = U₆
//! ```
//!
//! Within a step the system is autonomous, as commands are constant. Of the state y = (x, v),
//! angles and rates of links and pulleys satisfy ẋ = v, so that U = (X, V) with the right-hand side
//! (r, s) follows from half as many equations:
//!
//! ```text
//! X = r + hγ V        (I − hγ ∂a/∂v − h²γ² ∂a/∂x) V = s + hγ ∂a/∂x r        a = v̇
//! ```
//!
//! The attitude of the trunk is integrated as a quaternion, whose length is not determined by the
//! equations, and normalised after the step; the change is below the error of the method. The work
//! of friction, of the motors and of pushes are three more states on which nothing depends: their
//! rows are filled in afterwards, and the energy balance has the order of the method. Pushes are
//! held at their mean over the step, which is of second order where they are not constant.

mod coefficients;
mod linear_system;

use super::error_norm::error_norm;
use super::jacobian::Jacobian;
use super::right_hand_side::RightHandSide;
use super::run_state::RunState;
use super::substep::Substep;
use crate::model::Model;
use crate::model::real::{Lanes, Real};
use crate::model::state::{Slope, State, normalised};

use coefficients::{A, C, GAMMA, STAGES};
use linear_system::{Memory, System};

/// Result of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RodasStep<const N: usize> {
    pub(crate) end: State<Lanes, N>,
    /// Work dissipated by friction, work of the motors and of pushes, by leg \[J\].
    pub(crate) dissipated: Lanes,
    pub(crate) actuator: Lanes,
    pub(crate) external: Lanes,
    /// Difference of the two methods as a displacement of a foot or the trunk \[m\]. Infinite for a
    /// failed step, for instance where I − hγJ is singular; a shorter step may succeed.
    pub(crate) error: Lanes,
}

/// The method with its workspace.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rodas4<const N: usize> {
    rhs: RightHandSide<N>,
    memory: Memory<N>,
}

impl<const N: usize> Rodas4<N> {
    /// Computes one step.
    pub(crate) fn step(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        substep: &Substep<'_, N>,
    ) -> RodasStep<N> {
        let Substep {
            start: state,
            motion: start,
            h,
            elapsed,
            recovery,
        } = *substep;
        let free = model.is_free();
        let coordinates = model.coordinates();
        let Self { rhs, memory } = self;
        // The method is that of an autonomous system.
        run.set_mean_load(model, [elapsed, elapsed + h]);
        run.counts.factorisations += 1;
        let mut jacobian = Jacobian::new(model, &run.mode, state, recovery);
        let system = memory.factor(&mut jacobian, h);
        run.counts.evaluations += jacobian.evaluations;
        let Some(system) = system else {
            return RodasStep::failed(state);
        };
        let mut stages = [Slope::zero(); STAGES];
        let mut sum = Slope::zero();
        for i in 0..STAGES {
            let mut right;
            if i == 0 && run.mode.load.is_none() {
                right = scaled(&start.slope, h, free);
            } else {
                sum = Slope::zero();
                let mut linear = Slope::zero();
                for j in 0..i {
                    sum.add(A[i - 1][j], &stages[j], free);
                    linear.add(C[i - 1][j], &stages[j], free);
                }
                let at = state.along(Lanes::splat(1.0), &sum, free);
                right = scaled(&rhs.motion(model, run, &at, recovery).slope, h, free);
                right.add(GAMMA, &linear, free);
            }
            stages[i] = match &system {
                System::Islands(islands) => {
                    islands.solve(&right, h * Lanes::splat(GAMMA), coordinates)
                }
                System::Coupled(memory) => {
                    memory.solve(right, h.lane(0) * GAMMA, coordinates, model.legs.len())
                }
            };
        }
        // With feet on the ground the estimate for velocities converges more slowly than the
        // method, and would reduce the step size without need.
        let in_flight = run.mode.contacts.iter().next().is_none();
        let last = &stages[STAGES - 1];
        sum.add(1.0, last, free);
        RodasStep {
            end: normalised(&state.along(Lanes::splat(1.0), &sum, free), free),
            dissipated: sum.dissipated,
            actuator: sum.actuator,
            external: sum.external,
            error: error_norm(model, last, in_flight),
        }
    }
}

impl<const N: usize> RodasStep<N> {
    /// Returns a failed step.
    fn failed(state: &State<Lanes, N>) -> Self {
        Self {
            end: *state,
            dissipated: Lanes::zero(),
            actuator: Lanes::zero(),
            external: Lanes::zero(),
            error: Lanes::splat(f64::INFINITY),
        }
    }
}

/// Returns hγ times a slope.
fn scaled<const N: usize>(slope: &Slope<Lanes, N>, h: Lanes, free: bool) -> Slope<Lanes, N> {
    let h = h * Lanes::splat(GAMMA);
    let mut change = Slope::zero();
    if free {
        change.add(h.lane(0), slope, true);
        return change;
    }
    change.angles = slope.angles.map(|x| h * x);
    change.rates = slope.rates.map(|x| h * x);
    change.pulley = h * slope.pulley;
    change.pulley_rate = h * slope.pulley_rate;
    change.dissipated = h * slope.dissipated;
    change.actuator = h * slope.actuator;
    change.external = h * slope.external;
    change
}

#[cfg(test)]
mod tests;
