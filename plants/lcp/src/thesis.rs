//! The thesis' scheme for generalised coordinates (sections 2.3 and 2.4), its signs corrected, its defects kept: it is here
//! for comparison alone.
//!
//! Explicit Euler steps; forces of the stops from a complementarity problem of accelerations that projected Gauss–Seidel
//! sweeps with over-relaxation solve; what a gap has become is taken back by K and v (equations 2.9–2.11):
//!
//! ```text
//! 0 ≤ λ ⊥ J q̈ + J̇ q̇ + v J q̇ + K g ≥ 0        K = 1/τ²    v = 1/(τ Q)
//! ```
//!
//! Corrected: the signs of K in equations 2.9 and 2.10, and of the state-dependent stop's gap in 2.14–2.16 (it is
//! g = B(q₂) − q₂ − q₃, so that J = (B′ − 1, −1)); H⁻¹ in 2.18; J̇ q̇ = B″ q̇₂² and v J q̇ in 2.19; and the lower stop of q₃
//! depends on q₂, too, J = (1, 1). The gaps here are those of the rest of the plant, lengths where the thesis has angles.
//! Either is zero where the other is, and there a length is a multiple of the angle.
//!
//! Kept: a joint whose stop is reached has its rate set to zero, the rates of the others left alone (section 2.3.2). That is
//! no impulse that a stop could give. It can make energy: what it takes is written down as an impact, what it makes shows up
//! as the residual of the books. And as it is made anew at every contact, shorter steps do not make it right.

use twinrig_contact::Method;

use crate::chain::Chain;
use crate::events::Stop;
use crate::events::constrained::Demand;
use crate::flow::{Flow, FlowError};
use crate::motion::Scene;
use crate::real::Real;
use crate::site::Site;

/// τ in steps, "relatively larger than the integration time-step". ASSUMED.
const TAU: f64 = 5.0;

/// Q < 0.5: overdamped. ASSUMED.
const QUALITY: f64 = 0.4;

/// Relaxation and sweeps at most; the thesis names neither. ASSUMED.
const SWEEPS: Method = Method::GaussSeidel {
    relaxation: 1.2,
    sweeps: 200,
    tolerance: 1e-9,
};

impl<const N: usize> Flow<N> {
    /// Moves on by `seconds` in one step.
    pub(crate) fn run_thesis(&mut self, seconds: f64) -> Result<(), FlowError> {
        self.follow_command();
        let before = self.state;
        self.reset();
        if self.lands() {
            // A foot is no joint whose rate could be set: it meets the ground as with every other method, and stops that are
            // closed just then take their share of the blow.
            self.collide()?;
        }
        let tau = TAU * seconds;
        let demand = Demand::Acceleration {
            stiffness: 1.0 / (tau * tau),
            damping: 1.0 / (tau * QUALITY),
        };
        let constrained = self.constrain(demand, SWEEPS, seconds)?;
        let end = self.explicit(&constrained, seconds);
        self.conclude(&before, end, &constrained, seconds)
    }

    /// Sets the rate of each joint to zero whose stop was reached: found closed and closing, where it did not push in the step
    /// before. Writes down what that took.
    fn reset(&mut self) {
        let legs = &self.model.side_by_side;
        let scene = Scene::new(&self.model, legs, &self.mode, 0.0);
        let mut state = self.state;
        let chain = Chain::new(legs, &state.angles, &state.rates);
        let drive = scene.drive(&state);
        let active = &self.mode.active;
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
                // The knee; the ankle, where the stop is the pantograph's.
                let joint = match stop {
                    Stop::Closed | Stop::Open => 2,
                    Stop::Extended | Stop::Bottomed | Stop::Cable => 1,
                };
                let mut change = state.rates[joint - 1].lane(leg) - state.rates[joint].lane(leg);
                if stop == Stop::Cable {
                    // As far as the pulley lets it: no slower than the cable goes.
                    let slack = chain.cable.gradient[1].lane(leg);
                    change = constraint.rate.lane(leg) / slack;
                }
                // Joints below keep their rates: all links from here on change by the same.
                for rate in &mut state.rates[joint..] {
                    *rate = rate.with_lane(leg, rate.lane(leg) + change);
                }
            }
        }
        if any {
            let [kinetic, ..] = self.stored();
            self.state = state;
            let [left, ..] = self.stored();
            self.ledger.impact += (kinetic - left).max(0.0);
        }
    }

    /// Whether a foot has come to the ground that was not on it.
    fn lands(&self) -> bool {
        let Some(ground) = &self.model.ground else {
            return false;
        };
        let (legs, state) = (&self.model.side_by_side, &self.state);
        let chain = Chain::new(legs, &state.angles, &state.rates);
        let rotation = crate::articulated::rotation(state.attitude);
        (0..self.model.legs.len()).any(|leg| {
            (3..=N).any(|links| {
                let stands = |c: &crate::mode::Contact| (c.leg, c.links) == (leg, links);
                if self.mode.contacts.iter().any(stands) {
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
#[path = "thesis_tests.rs"]
mod tests;
