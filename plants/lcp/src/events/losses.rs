//! Energy that impulses dissipate.

use twinrig_legged::{Slide, taken_by_friction};

use super::Instant;
use super::closed::Role;

/// Energy that impulses take \[J\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Losses {
    /// By stops, cables and the ground's normal, and by the part of the impulses along the ground that is not friction's.
    pub(crate) impact: f64,
    pub(crate) friction: f64,
}

impl<const N: usize> Instant<N> {
    /// Losses by the impulses of the last solution. An unknown is an impulse per `seconds`; `after` gives the rates after them,
    /// row by row.
    pub(crate) fn losses(&self, seconds: f64, after: impl Fn(usize) -> f64) -> Losses {
        let mut losses = Losses::default();
        let slide = |row: usize| Slide {
            impulse: seconds * self.problem.unknowns()[row],
            before: self.entries[row].rate,
            after: after(row),
        };
        for (row, entry) in self.entries.iter().enumerate() {
            match entry.role {
                Role::Stop(_) | Role::Normal { .. } => losses.impact += slide(row).taken(),
                Role::Tangent { which: 1, .. } => {
                    let (taken, rest) = taken_by_friction([slide(row), slide(row + 1)]);
                    losses.friction += taken;
                    losses.impact += rest;
                }
                Role::Tangent { .. } => {}
            }
        }
        losses
    }
}
