//! Energy: where it is, and where it went.

use serde::{Deserialize, Serialize};
use twinrig_runtime::EnergyBooks;

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

impl Ledger {
    /// Opens the books with what there is.
    pub fn opened(stored: Stored) -> Self {
        Self {
            start: stored.iter().sum(),
            stored,
            ..Self::default()
        }
    }

    /// Strikes a balance after a step. Every joule that moves leaves one account and enters another.
    pub fn balance(&mut self, stored: Stored) {
        let flows = [self.actuator, self.dissipated, self.impact];
        let moved = |now: [f64; 3], before: [f64; 3]| {
            (now[0] - before[0]).abs() + (now[1] - before[1]).abs() + (now[2] - before[2]).abs()
        };
        self.exchanged += 0.5 * (moved(stored, self.stored) + moved(flows, self.flows));
        (self.stored, self.flows) = (stored, flows);
    }

    /// Where the energy is, where it went, and what is missing.
    pub fn books(&self) -> EnergyBooks {
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
        EnergyBooks {
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
