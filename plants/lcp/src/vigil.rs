//! Energy from nowhere: what an unstable step makes.
//!
//! No motion holds more energy than it had and was given: d(stored − actuator) ≤ 0, whatever friction and impacts take. A
//! step's error breaks that now and then by a little, one way and back; a step beyond its limit of stability does so again
//! and again. So the gains are added up, losses are set against them, and a sum that stands out ends the run:
//!
//! ```text
//! gained ← max(0, gained + Δ(stored − actuator)) ≤ share · (kinetic + spring energy − gained + weight · leg length)
//! ```

use twinrig_legged::Ledger;

use crate::flow::{Flow, FlowError};
use crate::options::Method;

impl Method {
    /// The share that a gain may come to. The thesis' scheme makes energy at every stop, and says so in the books: it has to
    /// run away to be stopped.
    const fn share(self) -> f64 {
        match self {
            Self::Rk4 | Self::Rodas4 => 0.05,
            Self::Moreau | Self::SemiImplicit | Self::ExplicitEuler => 0.25,
            Self::Thesis => 100.0,
        }
    }
}

impl<const N: usize> Flow<N> {
    /// Looks at what a step has gained, given the books before it.
    pub(crate) fn watch(&mut self, before: &Ledger, seconds: f64) -> Result<(), FlowError> {
        let [before, after] = [before, &self.ledger].map(Ledger::books);
        let gain = (after.stored() - after.actuator) - (before.stored() - before.actuator);
        if !gain.is_finite() {
            return Err(FlowError::NotFinite);
        }
        // What is there by right, and what lifting the robot by a leg's length would take.
        let own = (before.kinetic + before.spring - self.gained).max(0.0) + self.model.moving;
        let handed_over = self.rattles > 0;
        let method = if handed_over {
            Method::Moreau
        } else {
            self.method
        };
        self.gained = (self.gained + gain).max(0.0);
        if self.gained > method.share() * own {
            let gained = self.gained;
            return Err(FlowError::Gained { seconds, gained });
        }
        Ok(())
    }
}
