//! Energy dissipated by impulses.

use twinrig_contact::SolveError;
use twinrig_legged::{TangentialImpulse, taken_by_friction};

use super::Instant;
use super::entry::Role;

/// Violation of dissipativity by one impact, at the constraint of a leg that gives the most.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "an impact gives {given:.3e} J, but can only dissipate; shorten the steps, or take another integrator or compliant constraints"
)]
pub(crate) struct ImpactGivesEnergy {
    pub(crate) leg: usize,
    /// \[J\]
    pub(crate) given: f64,
}

/// Errors of an impact.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub(crate) enum ImpactError {
    #[error(transparent)]
    SolveError(#[from] SolveError),
    #[error(transparent)]
    GivesEnergy(#[from] ImpactGivesEnergy),
}

/// Energy dissipated by impulses \[J\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Losses {
    /// Loss by stops, cables, ground normals, and the tangential ground impulses that are not
    /// friction.
    pub(crate) impact: f64,
    pub(crate) friction: f64,
}

impl Losses {
    /// Divides the losses of impulses at one instant so that no part is negative. The parts have no
    /// order in time: a normal impulse at a foot that others lift does positive work, which their
    /// friction takes. What impulses give in total, within the tolerance of their solution
    /// ([`Instant::check_energy`]), is an error of the motion and stays in the residual of the
    /// energy balance.
    pub(crate) fn divided(self) -> Self {
        if self.impact >= 0.0 && self.friction >= 0.0 {
            return self;
        }
        let total = (self.impact + self.friction).max(0.0);
        let friction = self.friction.clamp(0.0, total);
        Self {
            impact: total - friction,
            friction,
        }
    }
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

    /// Checks that impulses with these losses give no energy, beyond that of errors of the rates up
    /// to `accepted` \[m/s\].
    pub(crate) fn check_energy(
        &self,
        losses: Losses,
        accepted: f64,
        after: impl Fn(usize) -> f64,
    ) -> Result<(), ImpactGivesEnergy> {
        /// Round-off, relative to the energy exchanged.
        const ROUND_OFF: f64 = 1e-9;
        let (mut allowed, mut worst) = (0.0, (0, 0.0));
        for (row, entry) in self.entries.iter().enumerate() {
            let (impulse, after) = (self.problem.unknowns()[row], after(row));
            let exchanged = 0.5 * impulse.abs() * (entry.rate.abs() + after.abs());
            allowed += ROUND_OFF * exchanged + accepted * impulse.abs();
            let given = 0.5 * impulse * (entry.rate + after);
            if given > worst.1 {
                worst = (entry.row.leg, given);
            }
        }
        let given = -(losses.impact + losses.friction);
        // The form of the comparison rejects NaN.
        if given <= allowed {
            return Ok(());
        }
        let leg = worst.0;
        Err(ImpactGivesEnergy { leg, given })
    }
}

#[cfg(test)]
mod tests {
    use super::Losses;

    #[test]
    fn divided_losses_are_not_negative_and_keep_a_positive_sum() {
        for (impact, friction, expected) in [
            (0.3, 0.2, (0.3, 0.2)),
            (-0.1, 0.2, (0.0, 0.1)),
            (0.3, -0.1, (0.2, 0.0)),
            (-0.3, 0.2, (0.0, 0.0)),
        ] {
            let losses = Losses { impact, friction }.divided();
            assert!((losses.impact - expected.0).abs() < 1e-15, "{losses:?}");
            assert!((losses.friction - expected.1).abs() < 1e-15, "{losses:?}");
        }
    }
}
