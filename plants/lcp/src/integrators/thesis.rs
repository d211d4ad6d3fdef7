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

use crate::constraints::events::Stop;
use crate::constraints::events::constrained::ConstraintLevel;
use crate::integrators::flow::Flow;
use crate::integrators::step_error::StepError;
use crate::model::chain::Chain;
use crate::model::real::Real;
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

impl<const N: usize> Flow<N> {
    /// Advances by `seconds` in one step.
    pub(crate) fn run_thesis(&mut self, seconds: f64) -> Result<(), StepError> {
        self.follow_command();
        let before = self.run.state;
        self.reset();
        if self.lands() {
            // A foot is not a joint whose rate could be reset: its impact is solved as in every
            // other method, and stops closed at that instant share it.
            self.apply_impact()?;
        }
        let tau = TAU * seconds;
        let level = ConstraintLevel::Acceleration {
            stiffness: 1.0 / (tau * tau),
            damping: 1.0 / (tau * QUALITY),
        };
        let constrained = self.constrain(level, SWEEPS, seconds)?;
        let end = self.explicit(&constrained, seconds);
        self.finish_step(&before, end, &constrained, seconds)
    }

    /// Sets the rate of each joint at a newly reached stop to zero: closed and closing, and
    /// inactive in the previous step. Enters the energy loss.
    fn reset(&mut self) {
        let legs = &self.model.side_by_side;
        let dynamics = self.run.dynamics(&self.model, 0.0);
        let mut state = self.run.state;
        let chain = Chain::new(legs, &state.angles, &state.rates);
        let drive = dynamics.drive(&state);
        let active = &self.run.mode.active;
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
            if stop == Stop::Cable && self.model.drives.is_none() {
                continue;
            }
            for leg in 0..self.model.legs.len() {
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
            let [kinetic, ..] = self.stored();
            self.run.state = state;
            let [after, ..] = self.stored();
            self.run.ledger.impact += (kinetic - after).max(0.0);
        }
    }

    /// Returns whether a foot without contact has reached the ground.
    fn lands(&self) -> bool {
        let Some(ground) = &self.model.ground else {
            return false;
        };
        let (legs, state) = (&self.model.side_by_side, &self.run.state);
        let chain = Chain::new(legs, &state.angles, &state.rates);
        let rotation = crate::model::articulated::rotation(state.attitude);
        (0..self.model.legs.len()).any(|leg| {
            (3..=N).any(|links| {
                let stands =
                    |c: &crate::constraints::mode::Contact| (c.leg, c.links) == (leg, links);
                if self.run.mode.contacts.iter().any(stands) {
                    return false;
                }
                let site: Site<f64, N> = Site::new(legs, &chain, state, leg, links);
                let footing = site.footing(ground, state.position, &rotation);
                footing.gap < 0.0 && footing.velocity[0] < 0.0
            })
        })
    }
}

#[cfg(test)]
mod tests;
