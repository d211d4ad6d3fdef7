//! Rates of the gaps to which impulses lead, so that they give no energy but that of the overlaps.

use super::{Constraints, RECOVERY, RESTING_SPEED, Role};
use crate::model::Model;
use crate::motion::Motion;

impl Constraints {
    /// Sets the rates to which impulses lead.
    pub(super) fn set_rates(&mut self, model: &Model, seconds: f64) {
        let ground = model.ground.as_ref();
        let restitution = ground.map_or(0.0, |ground| ground.restitution);
        for entry in &mut self.entries {
            // Overlaps are removed slowly: otherwise an impact would rebound by the overlap of its
            // step.
            let recovering = (-RECOVERY * entry.gap / seconds).min(RESTING_SPEED);
            entry.recovering = match entry.role {
                Role::First | Role::Second => 0.0,
                Role::Normal if restitution > 0.0 && entry.rate < -RESTING_SPEED => {
                    (-restitution * entry.rate).max(recovering)
                }
                Role::Stop(_) | Role::Ankle | Role::Normal => recovering,
            };
            entry.lossless = entry.recovering.min(-entry.rate);
        }
    }

    /// Sets the velocities at the end of the step without impulses, less those to which impulses
    /// lead, with this share of the removal of overlaps.
    pub(super) fn set_offsets(&mut self, motion: &Motion, share: f64, seconds: f64) {
        for (i, entry) in self.entries.iter().enumerate() {
            let free = entry.rate + seconds * motion.along(&entry.row);
            let target = match entry.role {
                Role::First | Role::Second if entry.mean => -entry.rate,
                Role::First | Role::Second => 0.0,
                Role::Stop(_) | Role::Ankle | Role::Normal => {
                    entry.lossless + share * (entry.recovering - entry.lossless)
                }
            };
            self.problem.offset(i, free - target);
        }
    }

    /// Returns the share of the removal of overlaps for which the energy of the overlaps suffices,
    /// at most the present one.
    pub(super) fn recovery_share(&self, share: f64) -> f64 {
        /// Error of the rates that is accepted, the tolerance of the impulses \[m/s\].
        const ACCEPTED: f64 = 1e-7;
        let (mut lossless, mut recovering, mut accepted) = (0.0, 0.0, 0.0);
        for (entry, &impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            if matches!(entry.role, Role::First | Role::Second) {
                continue;
            }
            lossless += 0.5 * impulse * (entry.rate + entry.lossless);
            recovering += 0.5 * impulse * (entry.recovering - entry.lossless);
            accepted += ACCEPTED * impulse;
        }
        let available = self.overlap - lossless;
        if share * recovering <= available + accepted {
            return share;
        }
        (available / recovering).clamp(0.0, share)
    }

    /// Lets friction act against the mean velocity of the step at each contact where, acting
    /// against that at its end, it would do work. Returns whether there is a further one.
    pub(super) fn average_slides(&mut self) -> bool {
        /// Speed of a foot that sticks to the tolerance of the impulses \[m/s\].
        const STUCK: f64 = 1e-7;
        let mut changed = false;
        for i in 0..self.entries.len() {
            if self.entries[i].role != Role::First || self.entries[i].mean {
                continue;
            }
            let impulse = |row: usize| self.problem.unknowns()[row];
            let work = |row: usize| impulse(row) * self.entries[row].rate;
            let magnitude = impulse(i).abs() + impulse(i + 1).abs();
            if work(i) + work(i + 1) > STUCK * magnitude {
                self.entries[i].mean = true;
                self.entries[i + 1].mean = true;
                changed = true;
            }
        }
        changed
    }
}
