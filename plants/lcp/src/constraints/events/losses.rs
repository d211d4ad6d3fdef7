//! Energy dissipated by impulses.

use twinrig_legged::{TangentialImpulse, taken_by_friction};

use super::Instant;
use super::closed::Role;

/// Energy dissipated by impulses \[J\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Losses {
    /// Loss by stops, cables, ground normals, and the tangential ground impulses that are not
    /// friction.
    pub(crate) impact: f64,
    pub(crate) friction: f64,
}

impl<const N: usize> Instant<N> {
    /// Returns the losses by the impulses of the last solution. An unknown is an impulse per
    /// `seconds`; `after` returns the rate of a row after the impulses.
    pub(crate) fn losses(&self, seconds: f64, after: impl Fn(usize) -> f64) -> Losses {
        let mut losses = Losses::default();
        let slide = |row: usize| TangentialImpulse {
            impulse: seconds * self.problem.unknowns()[row],
            before: self.entries[row].rate,
            after: after(row),
        };
        for (row, entry) in self.entries.iter().enumerate() {
            match entry.role {
                Role::Stop(_) | Role::Normal { .. } => losses.impact += slide(row).taken(),
                Role::Tangent { which: 1, .. } => {
                    let (friction, rest) = taken_by_friction([slide(row), slide(row + 1)]);
                    losses.friction += friction;
                    losses.impact += rest;
                }
                Role::Tangent { .. } => {}
            }
        }
        losses
    }
}
