//! Energy: where it is, and where it went.

use serde::{Deserialize, Serialize};
use twinrig_runtime::EnergyBooks;

/// Kinetic, spring and gravity energy \[J\].
pub(crate) type Stored = [f64; 3];

/// What has flowed since the start \[J\].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ledger {
    pub(crate) actuator: f64,
    pub(crate) dissipated: f64,
    pub(crate) impact: f64,
    exchanged: f64,
    start: f64,
    stored: Stored,
    /// Flows at the last balance.
    flows: [f64; 3],
}

impl Ledger {
    pub(crate) fn opened(stored: Stored) -> Self {
        Self {
            start: stored.iter().sum(),
            stored,
            ..Self::default()
        }
    }

    /// Strikes a balance after a step. Every joule that moves leaves one account and enters another.
    pub(crate) fn balance(&mut self, stored: Stored) {
        let flows = [self.actuator, self.dissipated, self.impact];
        let moved = |now: [f64; 3], before: [f64; 3]| {
            (now[0] - before[0]).abs() + (now[1] - before[1]).abs() + (now[2] - before[2]).abs()
        };
        self.exchanged += 0.5 * (moved(stored, self.stored) + moved(flows, self.flows));
        (self.stored, self.flows) = (stored, flows);
    }

    pub(crate) fn books(&self) -> EnergyBooks {
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
