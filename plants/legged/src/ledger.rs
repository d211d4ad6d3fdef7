//! Energy: where it is, and where it went.

use serde::{Deserialize, Serialize};
use twinrig_runtime::EnergyBalance;

/// Kinetic, spring and gravity energy \[J\].
pub type Stored = [f64; 3];

/// What has flowed since the start \[J\]. Every step adds to the flows, then strikes a balance; what then does not add up is
/// the residual, which measures the integration and hides nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Work of the drives on the robot.
    pub actuator: f64,
    /// What friction has taken, in joints and on the ground.
    pub dissipated: f64,
    /// What impacts have taken.
    pub impact: f64,
    exchanged: f64,
    start: f64,
    stored: Stored,
    /// Flows at the last balance.
    flows: [f64; 3],
}

/// Friction dissipates. Where its work is positive, its forces are not those of the motion that the plant has found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("friction has given {given:.3e} J in all, and can only take")]
pub struct NegativeDissipation {
    /// Energy that friction has given since the start \[J\].
    pub given: f64,
}

/// Round-off of the work of friction: absolute \[J\], and as a share of the energy exchanged.
const ROUND_OFF: f64 = 1e-9;
const ROUND_OFF_SHARE: f64 = 1e-9;

impl Ledger {
    /// Checks that the energy dissipated since the start is not negative, up to round-off. Every plant does so after its steps.
    ///
    /// # Errors
    /// [`NegativeDissipation`].
    pub fn check(&self) -> Result<(), NegativeDissipation> {
        self.check_within(ROUND_OFF.max(ROUND_OFF_SHARE * self.exchanged))
    }

    /// Checks that friction has given no more than `allowed` \[J\] in all: for engines whose contacts are soft, so that what
    /// friction takes is not exact.
    ///
    /// # Errors
    /// [`NegativeDissipation`].
    pub fn check_within(&self, allowed: f64) -> Result<(), NegativeDissipation> {
        // Written so that NaN does not pass.
        if self.dissipated >= -allowed {
            return Ok(());
        }
        let given = -self.dissipated;
        Err(NegativeDissipation { given })
    }

    /// Opens the books with what there is.
    pub fn opened(stored: Stored) -> Self {
        Self {
            start: stored.iter().sum(),
            stored,
            ..Self::default()
        }
    }

    /// Strikes a balance after a step. Every joule that moves leaves one account and enters another.
    pub fn close_step(&mut self, stored: Stored) {
        let flows = [self.actuator, self.dissipated, self.impact];
        let moved = |now: [f64; 3], before: [f64; 3]| {
            (now[0] - before[0]).abs() + (now[1] - before[1]).abs() + (now[2] - before[2]).abs()
        };
        self.exchanged += 0.5 * (moved(stored, self.stored) + moved(flows, self.flows));
        (self.stored, self.flows) = (stored, flows);
    }

    /// Where the energy is, where it went, and what is missing.
    pub fn balance(&self) -> EnergyBalance {
        let [kinetic, spring, gravity] = self.stored;
        let Self {
            actuator,
            dissipated,
            impact,
            exchanged,
            start,
            ..
        } = *self;
        let residual = kinetic + spring + gravity + dissipated + impact - actuator - start;
        EnergyBalance {
            kinetic,
            spring,
            gravity,
            dissipated,
            actuator,
            impact,
            exchanged,
            residual,
        }
    }
}
