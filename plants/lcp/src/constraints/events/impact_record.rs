//! The impact before a resolution of contact modes.

use super::entry::{Role, SLOTS};

/// Rates before an impact, and the feet it stopped.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ImpactRecord {
    /// Rates of the closed gaps before the impact \[m/s\].
    pub(super) rates: [[f64; SLOTS]; 4],
    /// Feet stopped by the impact, by leg and point of the leg.
    pub(super) stopped: [[bool; 2]; 4],
}

impl ImpactRecord {
    /// Returns the tangential velocity of a foot before the impact.
    pub(super) fn tangential(&self, leg: usize, links: usize) -> [f64; 2] {
        [1, 2].map(|which| self.rates[leg][Role::Tangent { links, which }.slot()])
    }
}
