//! Scheme of the thesis for generalised coordinates (sections 2.3 and 2.4) with corrected signs and
//! its remaining defects, for comparison.
//!
//! Explicit Euler steps. The forces of the stops follow from a complementarity problem of
//! accelerations, solved by projected Gauss–Seidel sweeps with over-relaxation; gap errors are
//! corrected by K and v (equations 2.9–2.11):
//!
//! ```text
//! 0 ≤ λ ⊥ J q̈ + J̇ q̇ + v J q̇ + K g ≥ 0        K = 1/τ²    v = 1/(τ Q)
//! ```
//!
//! Corrected: the signs of K in equations 2.9 and 2.10, and of the state-dependent stop's gap in
//! 2.14–2.16 (it is g = B(q₂) − q₂ − q₃, so that J = (B′ − 1, −1)); H⁻¹ in 2.18; J̇ q̇ = B″ q̇₂²
//! and v J q̇ in 2.19; and the dependence of the lower stop of q₃ on q₂, J = (1, 1). The gaps are
//! those of the rest of the plant: lengths where the thesis has angles. Both have the same zeros,
//! where a length is a multiple of the angle.
//!
//! Kept: the rate of a joint at a reached stop is set to zero, and the rates of the others are
//! unchanged (section 2.3.2). A stop cannot produce that impulse, and the reset may create energy:
//! a loss is entered as an impact, a gain remains in the residual of the energy balance. As the
//! error recurs at every contact, shorter steps do not remove it.

use twinrig_contact::Method;

use super::euler::{FixedStep, explicit};
use super::run_state::RunState;
use super::step_error::StepError;
use crate::constraints::contacts::Contact;
use crate::constraints::events::Stop;
use crate::constraints::events::constrained::ConstraintLevel;
use crate::model::Model;
use crate::model::chain::Chain;
use crate::model::real::Real;
use crate::model::rotation::rotation;
use crate::model::site::Site;

/// τ in steps, "relatively larger than the integration time-step". ASSUMED.
const TAU: f64 = 5.0;

/// Q < 0.5: overdamped. ASSUMED.
const QUALITY: f64 = 0.4;

/// Relaxation factor and maximum number of sweeps, which the thesis does not give. ASSUMED.
const SWEEPS: Method = Method::GaussSeidel {
    relaxation: 1.2,
    sweeps: 200,
    tolerance: 1e-9,
};

impl<const N: usize> FixedStep<N> {
    /// Advances by `seconds` in one step.
    pub(crate) fn thesis(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        self.rhs.follow_command(model, run);
        let before = run.state;
        reset(model, run);
        if lands(model, run) {
            // A foot is not a joint whose rate could be reset: its impact is solved as in every
            // other method, and stops closed at that instant share it.
            self.apply_impact(model, run)?;
        }
        let tau = TAU * seconds;
        let level = ConstraintLevel::Acceleration {
            stiffness: 1.0 / (tau * tau),
            damping: 1.0 / (tau * QUALITY),
        };
        let constrained = self.constrain(model, run, level, SWEEPS, seconds)?;
        let end = explicit(model, run, &constrained, seconds);
        self.finish_step(model, run, &before, end, &constrained, seconds)
    }
}

/// Sets the rate of each joint at a newly reached stop to zero: closed and closing, and inactive in
/// the previous step. Enters the energy loss.
fn reset<const N: usize>(model: &Model<N>, run: &mut RunState<N>) {
    let legs = &model.side_by_side;
    let dynamics = run.dynamics(model, 0.0);
    let mut state = run.state;
    let chain = Chain::new(legs, &state.angles, &state.rates);
    let drive = dynamics.drive(&state);
    let active = &run.mode.active;
    let mut any = false;
    for (stop, constraint, active) in [
        (Stop::Extended, chain.extended(legs), active.extended),
        (Stop::Bottomed, chain.bottomed(legs), active.bottomed),
        (Stop::Cable, chain.taut(legs, &drive), active.cable),
        (
            Stop::Closed,
            chain.closed(legs, &state.angles),
            active.closed,
        ),
        (Stop::Open, chain.open(legs), active.open),
    ] {
        if stop == Stop::Cable && model.drives.is_none() {
            continue;
        }
        for leg in 0..model.legs.len() {
            let reached = constraint.gap.lane(leg) < 0.0
                && constraint.rate.lane(leg) < 0.0
                && active.lane(leg) == 0.0;
            if !reached {
                continue;
            }
            any = true;
            // The knee, or the ankle for the stops of the pantograph.
            let joint = match stop {
                Stop::Closed | Stop::Open => 2,
                Stop::Extended | Stop::Bottomed | Stop::Cable => 1,
            };
            let mut change = state.rates[joint - 1].lane(leg) - state.rates[joint].lane(leg);
            if stop == Stop::Cable {
                // Limited by the pulley: the joint does not become slower than the cable.
                let gradient = chain.cable.gradient[1].lane(leg);
                change = constraint.rate.lane(leg) / gradient;
            }
            // Joints below keep their relative rates: all links from here on change equally.
            for rate in &mut state.rates[joint..] {
                *rate = rate.with_lane(leg, rate.lane(leg) + change);
            }
        }
    }
    if any {
        let [kinetic, ..] = run.stored(model);
        run.state = state;
        let [after, ..] = run.stored(model);
        run.ledger.impact += (kinetic - after).max(0.0);
    }
}

/// Returns whether a foot without contact has reached the ground.
fn lands<const N: usize>(model: &Model<N>, run: &RunState<N>) -> bool {
    let Some(ground) = &model.ground else {
        return false;
    };
    let (legs, state) = (&model.side_by_side, &run.state);
    let chain = Chain::new(legs, &state.angles, &state.rates);
    let rotation = rotation(state.attitude);
    (0..model.legs.len()).any(|leg| {
        (3..=N).any(|links| {
            let stands = |c: &Contact| (c.leg, c.links) == (leg, links);
            if run.mode.contacts.iter().any(stands) {
                return false;
            }
            let site: Site<f64, N> = Site::new(legs, &chain, state, leg, links);
            let footing = site.footing(ground, state.position, &rotation);
            footing.gap < 0.0 && footing.velocity[0] < 0.0
        })
    })
}

#[cfg(test)]
mod tests;
