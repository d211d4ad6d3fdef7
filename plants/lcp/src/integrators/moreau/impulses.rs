//! Impulses of a step: the complementarity problem in its middle, with the impulses of the last
//! step as the initial guess.

use twinrig_contact::Method;

use super::drift::Rates;
use super::kick::Kick;
use super::momentum::{Geometry, Momenta};
use crate::constraints::events::{Entry, Feet, Instant, Role, SLOTS};
use crate::constraints::motion::Dynamics;
use crate::integrators::run_state::RunState;
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::articulated::{Accelerations, Articulated};
use crate::model::leg_constraints::DriveAction;
use crate::model::load::PushForces;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Share γ of a gap that a step closes at an active constraint: the maximum for which gaps close
/// without oscillation, as positions advance by the mean of the velocities at both ends. The same
/// share of an overlap is corrected.
pub(super) const RECOVERY: f64 = 1.0 / 3.0;

/// Approach velocity below which an impact has no restitution \[m/s\].
const RESTING: f64 = 0.05;

/// Growth of an overlap in a step above which the step is halved \[m\]: a tenth of the depth that
/// is accepted in rigid ground, as many such steps may follow each other.
pub(super) const OVERLAP_MAX: f64 = 1e-5;

/// Number of solutions of a step, of which each but the first lets friction of further feet act
/// against the mean velocity.
const PASSES_MAX: u32 = 6;

/// Predicted gap below which a constraint enters the problem \[m\].
const CLOSING: f64 = 1e-6;

/// Predicted gap above which a constraint is ignored \[m\].
const SEARCH_DISTANCE: f64 = 2e-3;

/// Tolerances of the impulses, relative to the maximum speed, and in m/s.
const TOLERANCE: [f64; 2] = [1e-6, 1e-7];

/// Violation that is accepted if no method finds a better solution \[m/s\]: a hundredth of a
/// micrometre over a step of a millisecond, which the next step corrects.
const VIOLATION_ACCEPTED: f64 = 1e-5;

/// Impulses of a step, the initial guess of the next one.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LastImpulses {
    /// By leg and slot \[N·s, N·m·s\].
    pub(crate) impulses: [[f64; SLOTS]; 4],
    /// Length of that step \[s\].
    pub(crate) seconds: f64,
    /// Work of the corrections of overlaps, less what was deducted from the losses \[J\].
    pub(crate) correction: f64,
}

impl LastImpulses {
    /// Returns the mean force of that step in a slot.
    fn force(&self, leg: usize, slot: usize) -> f64 {
        let impulse = self.impulses[leg][slot];
        // Before the first step all impulses are zero, and so is its length.
        if impulse == 0.0 {
            return 0.0;
        }
        impulse / self.seconds
    }

    /// Returns the expected forces in a step of length `seconds`: those of the last step, limited
    /// to its impulses. The impact in a short step is not a force that persists in a long one.
    pub(super) fn forces_over(&self, seconds: f64) -> [[f64; SLOTS]; 4] {
        let longer = self.seconds.max(seconds);
        self.impulses
            .map(|slots| slots.map(|impulse| impulse / longer))
    }
}

/// Complementarity problem of a step, with its workspace.
#[derive(Debug, Clone, Default)]
pub(super) struct ImpulseSolver<const N: usize> {
    pub(super) instant: Instant<N>,
    pub(super) last_impulses: LastImpulses,
    /// Whether a step with a new overlap can be halved.
    pub(super) halvable: bool,
    /// Rates without the impulses, by row.
    free_rates: Vec<f64>,
    /// Whether friction acts against the mean velocity, by row.
    averaged: Vec<bool>,
    /// Correction of the overlaps.
    pub(super) shift: Box<Instant<N>>,
    /// Work of the correction of overlaps in the step \[J\].
    pub(super) corrected: f64,
}

impl<const N: usize> ImpulseSolver<N> {
    /// Solves for the impulses; returns the accelerations under them, and the torques on the links.
    pub(super) fn impulses(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        articulated: &mut Articulated<Lanes, N>,
        middle: &State<Lanes, N>,
        drive: &DriveAction<Lanes>,
        (geometry, rates, before, pushed): (
            &Geometry<N>,
            &Rates<N>,
            &Momenta<N>,
            Option<&PushForces<Lanes, N>>,
        ),
        seconds: f64,
    ) -> Result<(Accelerations<Lanes, N>, [Lanes; N]), StepError> {
        let Self {
            instant,
            free_rates,
            last_impulses,
            ..
        } = self;
        let model = dynamics.model;
        let near = |gap: f64, rate: f64| gap + 0.5 * seconds * rate.min(0.0) < SEARCH_DISTANCE;
        let legs = [0, 1, 2, 3];
        let legs = &legs[..model.legs.len()];
        instant.find_entries(
            dynamics,
            middle,
            articulated,
            drive,
            legs,
            Feet::WithTangents,
            &near,
        );
        let kick = Kick {
            model,
            geometry,
            hip_torque: drive.hip_torque,
            rates,
            before,
            pushed,
            seconds,
        };
        kick.apply(
            articulated,
            &instant.load(&last_impulses.forces_over(seconds)),
        )?;
        let accelerations = articulated.accelerations();
        free_rates.clear();
        let mut kept = false;
        instant.entries.retain(|entry| {
            let free = entry.rate + seconds * gap_acceleration(entry, &accelerations);
            if !entry.role.is_tangent() {
                kept = entry.gap + 0.5 * seconds * entry.rate.min(free) < CLOSING;
            }
            if kept {
                free_rates.push(free);
            }
            kept
        });
        instant.prepare(articulated, &model.friction);
        for (i, entry) in instant.entries.iter().enumerate() {
            let last = last_impulses.force(entry.row.leg, entry.role.slot());
            instant.problem.guess(i, last * seconds);
        }
        self.solve(model.restitution(), seconds)?;
        let instant = &self.instant;
        let (by_trunk, by_links) = instant.responses();
        let per = 1.0 / seconds;
        let (mut trunk, mut torques) = (accelerations.trunk, articulated.torques);
        for (sum, change) in trunk.iter_mut().zip(by_trunk) {
            *sum += per * change;
        }
        for (sum, change) in torques.iter_mut().zip(by_links) {
            *sum += Lanes::splat(per) * change;
        }
        Ok((articulated.with_trunk(trunk, &torques), torques))
    }

    /// Solves for impulses that give no energy.
    fn solve(&mut self, restitution: f64, seconds: f64) -> Result<(), StepError> {
        let n = self.instant.entries.len();
        self.averaged.clear();
        self.averaged.resize(n, false);
        for pass in 1.. {
            self.set_offsets(restitution, seconds);
            self.instant.solve(
                VIOLATION_ACCEPTED,
                Method::Newton,
                |problem, method| match method {
                    Method::Newton => problem.solve_within(TOLERANCE[0], TOLERANCE[1]),
                    _ => problem.solve_by(method),
                },
            )?;
            self.instant.problem.project_onto_bounds();
            let after = |row| self.rate_after(row, restitution, seconds);
            let losses = self.instant.losses(1.0, after);
            let checked = self.instant.check_energy(losses, VIOLATION_ACCEPTED, after);
            if checked.is_ok() {
                break;
            }
            if pass == PASSES_MAX || !self.average_slides(restitution, seconds) {
                return Ok(checked?);
            }
        }
        self.check_overlaps(restitution, seconds)
    }

    /// Sets the offsets of the problem: the rates at the end of the step without impulses, plus
    /// those that are allowed.
    fn set_offsets(&mut self, restitution: f64, seconds: f64) {
        for (i, free) in self.free_rates.iter().enumerate() {
            let offset = free + self.rate_offset(i, restitution, seconds);
            self.instant.problem.offset(i, offset);
        }
    }

    /// Returns the rate of a row after the impulses.
    fn rate_after(&self, row: usize, restitution: f64, seconds: f64) -> f64 {
        self.instant.problem.w(row) - self.rate_offset(row, restitution, seconds)
    }

    /// Lets friction act against the mean velocity of the step at each foot where, acting against
    /// that at its end, it does work. Returns whether there is a further one.
    fn average_slides(&mut self, restitution: f64, seconds: f64) -> bool {
        let mut changed = false;
        for row in 0..self.averaged.len() {
            let role = self.instant.entries[row].role;
            if !matches!(role, Role::Tangent { which: 1, .. }) || self.averaged[row] {
                continue;
            }
            let work: f64 = [row, row + 1]
                .map(|row| {
                    let after = self.rate_after(row, restitution, seconds);
                    self.instant.problem.unknowns()[row] * (self.instant.entries[row].rate + after)
                })
                .iter()
                .sum();
            if work > 0.0 {
                self.averaged[row..row + 2].fill(true);
                changed = true;
            }
        }
        changed
    }

    /// Returns an error for a step that can be halved and in which a leg moves beyond a stop or a
    /// cable by more than [`OVERLAP_MAX`].
    fn check_overlaps(&self, restitution: f64, seconds: f64) -> Result<(), StepError> {
        if !self.halvable {
            return Ok(());
        }
        let half = 0.5 * seconds;
        for (row, entry) in self.instant.entries.iter().enumerate() {
            if !matches!(entry.role, Role::Stop(_)) {
                continue;
            }
            let end = entry.gap + half * self.rate_after(row, restitution, seconds);
            let growth = (entry.gap - half * entry.rate).min(0.0) - end;
            if growth > OVERLAP_MAX {
                let (leg, depth) = (entry.row.leg, -end);
                return Err(StepError::Overlap {
                    leg,
                    depth,
                    seconds,
                });
            }
        }
        Ok(())
    }

    /// Returns the offset of a gap's rate at the end of the step, for a gap that closes or the
    /// rebound of an impact.
    fn rate_offset(&self, row: usize, restitution: f64, seconds: f64) -> f64 {
        let entry = &self.instant.entries[row];
        match entry.role {
            Role::Tangent { .. } if self.averaged[row] => entry.rate,
            Role::Tangent { .. } => 0.0,
            Role::Normal { .. } if restitution > 0.0 && entry.rate < -RESTING => {
                restitution * entry.rate
            }
            // Where the gap opens before, an impulse gives no energy if it closes as fast after.
            _ => {
                let start = entry.gap - 0.5 * seconds * entry.rate;
                (RECOVERY * start / seconds).max(entry.rate).max(0.0)
            }
        }
    }

    /// Enters the work of the impulses in the energy balance, and the ground impulses in the sums.
    pub(super) fn record_impulses(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        seconds: f64,
    ) {
        let restitution = model
            .ground
            .as_ref()
            .map_or(0.0, |ground| ground.restitution);
        let LastImpulses {
            impulses: before,
            correction,
            ..
        } = core::mem::take(&mut self.last_impulses);
        self.last_impulses.seconds = seconds;
        let after = |row| self.rate_after(row, restitution, seconds);
        let mut losses = self.instant.losses(1.0, after).divided();
        // An overlap is energy that an impulse took too much; its correction returns it.
        let correction = correction + core::mem::take(&mut self.corrected);
        let returned = correction.min(losses.impact);
        losses.impact -= returned;
        self.last_impulses.correction = correction - returned;
        run.ledger.impact += losses.impact;
        run.ledger.dissipated += losses.friction;
        let impulses = self.instant.problem.unknowns();
        for (entry, impulse) in self.instant.entries.iter().zip(impulses) {
            let (leg, slot) = (entry.row.leg, entry.role.slot());
            self.last_impulses.impulses[leg][slot] = *impulse;
            let activated = *impulse > 0.0 && before[leg][slot] <= 0.0;
            run.counts.events += u64::from(activated && !entry.role.is_tangent());
        }
        let ground = self.instant.ground();
        run.impulse_sums.add_ground(&ground);
    }
}

/// Returns the acceleration of a gap without constraint forces.
fn gap_acceleration<const N: usize>(
    entry: &Entry<N>,
    accelerations: &Accelerations<Lanes, N>,
) -> f64 {
    let mut sum = entry.winding;
    for (j, a) in entry.row.trunk.iter().zip(&accelerations.trunk) {
        sum += j * a;
    }
    for (j, a) in entry.row.links.iter().zip(&accelerations.links) {
        sum += j * a.lane(entry.row.leg);
    }
    sum
}
