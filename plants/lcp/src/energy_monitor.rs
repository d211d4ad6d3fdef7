//! The monitor of every method: energy from nowhere, which an unstable step makes, and feet that sink.
//!
//! No motion holds more energy than it had and was given: d(stored − actuator) ≤ 0, whatever friction and impacts take. A
//! step's error breaks that now and then by a little, one way and back; a step beyond its limit of stability does so again
//! and again. So the gains are added up, losses are set against them, and a sum that stands out ends the run:
//!
//! ```text
//! gained ← max(0, gained + Δ(stored − actuator)) ≤ share · own    own = kinetic + spring energy − gained + weight · leg length
//! ```
//!
//! Friction hides a gain that is smaller than what it takes. The books do not: what they have too much, measured by all that
//! was exchanged, is the error of the motion as a whole.

use twinrig_legged::Ledger;

use crate::flow::{Before, Flow, FlowError, ImpulseSums};
use crate::options::Method;

/// The share that a gain may come to: three times what any method gains at the steps that it is good for.
const SHARE: f64 = 0.05;

/// The thesis' scheme makes energy at every stop, and says so in the books: it has to run away to be stopped.
const SHARE_OF_THESIS: f64 = 100.0;

/// What the books may have too much, as a share of what was exchanged; and as a share of what is there, below which it is not
/// worth a word.
const SURPLUS: f64 = 0.1;
const WORTH: f64 = 0.02;

/// The same of what they may have too little: losses of a method do no harm until they dwarf all there is.
const DEFICIT: f64 = 0.3;
const DWARFED: f64 = 10.0;

/// Gain of a step that shows it to be too long, as a share of what is there.
const TOO_LONG: f64 = 0.01;

/// Depth of a foot in the ground that is an error of a method \[m\], and the rate at which it sinks \[m/s\]: a method that does
/// not locate its events lets a foot that lands fast be overlapped by half of its way in a step.
const DEPTH: f64 = 1e-3;
/// The same of methods for comparison, which do not bring back what drifts while it holds.
const DRIFTED: f64 = 2e-2;
const SINKING: f64 = 1e-3;
const LANDING: f64 = 10.0;

impl<const N: usize> Flow<N> {
    /// Looks at what a step has come to, given what was before it.
    pub(crate) fn watch(&mut self, before: &Before<N>, seconds: f64) -> Result<(), FlowError> {
        self.above_ground(&before.impulse_sums, seconds)?;
        let before = &before.ledger;
        let gain = self.gain(before);
        if !gain.is_finite() {
            return Err(FlowError::NotFinite);
        }
        let own = self.own(before);
        self.gained = (self.gained + gain).max(0.0);
        let balance = self.ledger.balance();
        let thesis = self.method == Method::Thesis;
        let share = if thesis { SHARE_OF_THESIS } else { SHARE };
        let worth = WORTH * own;
        let surplus = !thesis && balance.residual > worth.max(SURPLUS * balance.exchanged);
        if self.gained > share * own || surplus {
            let gained = self.gained.max(balance.residual);
            return Err(FlowError::Gained { seconds, gained });
        }
        if !thesis && -balance.residual > (DWARFED * own).max(DEFICIT * balance.exchanged) {
            let lost = -balance.residual;
            return Err(FlowError::Lost { seconds, lost });
        }
        let checked = self.ledger.check();
        checked.map_err(|why| FlowError::Dissipation { seconds, why })
    }

    /// Whether no foot sinks that nothing has held since `before`.
    fn above_ground(&self, before: &ImpulseSums, seconds: f64) -> Result<(), FlowError> {
        let least = match self.method {
            Method::Rk4 | Method::Rodas4 | Method::Moreau => DEPTH,
            Method::SemiImplicit | Method::ExplicitEuler | Method::Thesis => DRIFTED,
        };
        let legs = 0..self.model.legs.len();
        let points = legs.flat_map(|leg| (3..=N).map(move |links| (leg, links)));
        for (leg, links) in points {
            let Some(footing) = self.footing(leg, links) else {
                return Ok(());
            };
            let depth = -footing.gap;
            let held = self.impulse_sums.ground[leg] != before.ground[leg];
            if !held && depth > least + LANDING * seconds && footing.velocity[0] < -SINKING {
                return Err(FlowError::Sinks { leg, depth });
            }
        }
        Ok(())
    }

    /// Whether what was just stepped, from these books on, was too long a step.
    pub(crate) fn overshot(&self, before: &Ledger) -> bool {
        let gain = self.gain(before);
        gain.is_nan() || gain > TOO_LONG * self.own(before)
    }

    /// Whether a step of finite tolerance has gained or lost more than motors, friction and impacts account for: forces that
    /// make energy are no solution, however well they hold their constraints.
    pub(crate) fn is_unbalanced(&self, before: &Ledger) -> bool {
        let [was, is] = [before, &self.ledger].map(|ledger| ledger.balance().residual);
        let missing = (is - was).abs();
        self.tolerance.is_finite() && (missing.is_nan() || missing > TOO_LONG * self.own(before))
    }

    fn gain(&self, before: &Ledger) -> f64 {
        let [before, after] = [before, &self.ledger].map(Ledger::balance);
        (after.stored() - after.actuator) - (before.stored() - before.actuator)
    }

    /// What is there by right, and what lifting all that moves by a leg's length would take \[J\].
    fn own(&self, before: &Ledger) -> f64 {
        let balance = before.balance();
        (balance.kinetic + balance.spring - self.gained).max(0.0) + self.model.moving
    }
}

#[cfg(test)]
mod tests {
    use twinrig_contact::{Ground, Terrain};
    use twinrig_legged::{Base, Drives};

    use super::*;
    use crate::scenes::{self, flow};

    #[test]
    fn a_foot_that_sinks_is_seen_and_one_that_is_pushed_out_is_not() {
        let ground = Ground::new(Terrain::Flat, 0.6, 0.0).unwrap();
        let start = ([0.0, -45.0, 45.0], [0.0; 3]);
        let robot = scenes::robot();
        let mut flow = flow::<3>(&robot, Base::Free, start, Drives::None, Some(ground));
        let gap = flow.footing(0, 3).unwrap().gap;
        flow.state.position[2] -= gap + DEPTH + 2e-3 * LANDING + 1e-4;
        let before = flow.impulse_sums;
        let mut at = |rate: f64, higher: f64, load: f64| {
            flow.state.velocity[2] = rate;
            flow.state.position[2] += higher;
            flow.impulse_sums = before;
            (0..4).for_each(|leg| flow.impulse_sums.ground[leg][2] += load);
            flow.above_ground(&before, 2e-3)
        };
        assert_eq!(at(0.0, 0.0, 0.0), Ok(()));
        assert_eq!(at(0.1, 0.0, 0.0), Ok(()));
        let seen = at(-0.1, 0.0, 0.0).unwrap_err();
        assert!(matches!(seen, FlowError::Sinks { leg: 0, .. }), "{seen:?}");
        assert_eq!(at(-0.1, 0.0, 1e-3), Ok(()));
        assert_eq!(at(-0.1, 2e-4, 0.0), Ok(()));
    }
}
