//! Energy that the impulses of a step take.

use twinrig_legged::TangentialImpulse;

use super::{Constraints, RESIDUAL_ACCEPTED, Role};
use crate::flow_error::FlowError;
use crate::state::State;

/// Energy transfers of a step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Losses {
    /// Energy dissipated by impacts \[J\].
    pub(crate) impact: f64,
    /// Energy dissipated by sliding \[J\].
    pub(crate) sliding: f64,
    /// Energy of the overlaps at its end \[J\].
    pub(crate) overlap: f64,
}

impl Constraints {
    /// Energy transfers of the step, from the velocities at its end.
    pub(crate) fn losses(&self, after: &State, seconds: f64) -> Result<Losses, FlowError> {
        let (mut taken, mut needed, mut sliding) = (0.0, 0.0, 0.0);
        // Energy that errors of the rates may give, and the constraint that gives the most.
        let (mut accepted, mut worst) = (0.0, (0, 0.0));
        let impulses = self.problem.unknowns();
        let slide = |row: usize| {
            let entry = &self.entries[row];
            TangentialImpulse {
                impulse: impulses[row],
                before: entry.rate,
                after: entry.row.rate(after),
            }
        };
        for (i, entry) in self.entries.iter().enumerate() {
            match entry.role {
                Role::Stop(_) | Role::Ankle | Role::Normal => {
                    let slide = slide(i);
                    taken += slide.taken();
                    accepted += RESIDUAL_ACCEPTED * slide.impulse;
                    if -slide.taken() > worst.1 {
                        worst = (entry.row.leg, -slide.taken());
                    }
                    let gap = entry.gap + 0.5 * seconds * (slide.before + slide.after);
                    needed += slide.impulse / seconds * (-gap).max(0.0);
                }
                Role::First | Role::Second => sliding += slide(i).taken(),
            }
        }
        let given = -(self.overlap + taken);
        // The form of the comparison rejects NaN.
        if given <= accepted {
            let overlap = (self.overlap + taken).clamp(0.0, needed);
            return Ok(Losses {
                // What is given beyond, by errors of the rates, is an error of the motion.
                impact: (self.overlap + taken - overlap).max(0.0),
                sliding,
                overlap,
            });
        }
        let leg = worst.0;
        Err(FlowError::ImpactGivesEnergy { leg, given })
    }
}
