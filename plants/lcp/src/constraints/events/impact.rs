//! Impacts: impulses at all closed constraints with approaching velocity.

use core::mem;

use twinrig_contact::{Method, Restitution};
use twinrig_legged::{DriveModels, LEGS};

use super::Instant;
use super::closed::{STICKING, touching};
use super::entry::{Entry, Feet, Role, Stop};
use super::impact_record::ImpactRecord;
use super::losses::{ImpactError, Losses};
use crate::constraints::motion::Dynamics;
use crate::model::articulated::Articulated;
use crate::model::leg_constraints::DriveAction;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Approach velocity below which an impact has no restitution \[m/s\].
pub(super) const RESTING: f64 = 0.05;

/// Result of an impact: energy dissipated by normal impulses and by friction \[J\], and ground
/// impulses on each leg, world frame \[N·s\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ImpactTotals {
    pub(crate) impact: f64,
    pub(crate) friction: f64,
    pub(crate) ground: [[f64; 3]; 4],
}

impl ImpactTotals {
    /// Adds the result of another impact at the same instant.
    pub(crate) fn add(&mut self, other: &Self) {
        self.impact += other.impact;
        self.friction += other.friction;
        let parts = other.ground.iter().flatten();
        for (sum, part) in self.ground.iter_mut().flatten().zip(parts) {
            *sum += part;
        }
    }
}

impl<const N: usize> Instant<N> {
    /// Resolves the impact of these legs by impulses at all closed constraints with approaching
    /// velocity.
    pub(crate) fn impact(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &mut State<Lanes, N>,
        legs: &[usize],
    ) -> Result<ImpactTotals, ImpactError> {
        let (articulated, drive) = self.find_closed(dynamics, state, legs);
        if !self.entries.iter().any(|e| e.is_normal() && e.rate < 0.0) {
            return Ok(ImpactTotals::default());
        }
        let restitution = dynamics.model.restitution();
        self.prepare(&articulated, &dynamics.model.friction);
        self.coefficients.clear();
        self.coefficients
            .extend(self.entries.iter().map(|entry| match entry.role {
                Role::Normal { .. } if entry.rate < -RESTING => restitution,
                _ => 0.0,
            }));
        let before = mem::take(&mut self.before);
        let coefficients = mem::take(&mut self.coefficients);
        let law = Restitution::Poisson;
        let solved = self.solve(STICKING, Method::Newton, |problem, method| {
            problem.impact(law, &before, &coefficients, method)
        });
        (self.before, self.coefficients) = (before, coefficients);
        solved?;
        self.note_stopped(&dynamics.model.friction);
        self.apply_impulses(dynamics, state, &articulated, &drive)
    }

    /// Resolves the impact without collision of jammed feet ([`Instant::resolve_modes`]); none
    /// where no impulse resolves it.
    pub(crate) fn resolve_jam(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &mut State<Lanes, N>,
        legs: &[usize],
    ) -> Result<Option<ImpactTotals>, ImpactError> {
        let (articulated, drive) = self.find_closed(dynamics, state, legs);
        self.prepare(&articulated, &dynamics.model.friction);
        let jams = |entry: &Entry<N>| match entry.role {
            Role::Normal { links, .. } => self.jammed[entry.row.leg][links - 3],
            _ => false,
        };
        self.marks.clear();
        self.marks.extend(self.entries.iter().map(jams));
        let (before, marks) = (mem::take(&mut self.before), mem::take(&mut self.marks));
        let solved = self.solve(0.0, Method::Newton, |problem, method| {
            problem.impact_without_collision(&before, &marks, method)
        });
        let mut impulses = marks.iter().zip(self.problem.unknowns());
        let has_impulse = impulses.any(|(jams, impulse)| *jams && *impulse > 0.0);
        (self.before, self.marks) = (before, marks);
        solved?;
        self.note_stopped(&dynamics.model.friction);
        has_impulse
            .then(|| self.apply_impulses(dynamics, state, &articulated, &drive))
            .transpose()
    }

    /// Finds the closed constraints for an impact, and their rates.
    fn find_closed(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        legs: &[usize],
    ) -> (Articulated<Lanes, N>, DriveAction<Lanes>) {
        let (articulated, drive) = impact_model(dynamics, state);
        self.find_entries(
            dynamics,
            state,
            &articulated,
            &drive,
            legs,
            Feet::WithTangents,
            &touching,
        );
        let mut last_impact = ImpactRecord::default();
        for entry in &self.entries {
            last_impact.rates[entry.row.leg][entry.role.slot()] = entry.rate;
        }
        self.last_impact = Some(last_impact);
        self.before.clear();
        self.before
            .extend(self.entries.iter().map(|entry| entry.rate));
        (articulated, drive)
    }

    /// Applies the impulses of the solution to the velocities; returns energies and ground
    /// impulses.
    fn apply_impulses(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &mut State<Lanes, N>,
        articulated: &Articulated<Lanes, N>,
        drive: &DriveAction<Lanes>,
    ) -> Result<ImpactTotals, ImpactError> {
        let mut totals = ImpactTotals::default();
        for (entry, &impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            if entry.role == Role::Stop(Stop::Cable) {
                let leg = entry.row.leg;
                let gain = drive.pulley_mobility.lane(leg) * dynamics.legs.pulley_radius.lane(leg);
                let rate = state.pulley_rate.lane(leg) - gain * impulse;
                state.pulley_rate = state.pulley_rate.with_lane(leg, rate);
            }
        }
        let (trunk, torques) = self.responses();
        articulated.change_velocities(state, trunk, torques);
        let losses = self.losses(1.0, |row| self.rate_after(row));
        // Errors of the rates below the sticking speed are accepted.
        self.check_energy(losses, STICKING, |row| self.rate_after(row))?;
        let Losses { impact, friction } = losses.divided();
        (totals.impact, totals.friction) = (impact, friction);
        totals.ground = self.ground();
        Ok(totals)
    }

    /// Returns the velocity changes of the trunk by the impulses of the solution, and the impulses
    /// on the links.
    pub(crate) fn responses(&self) -> ([f64; 6], [Lanes; N]) {
        let (mut trunk, mut links) = ([0.0; 6], [Lanes::zero(); N]);
        let impulses = self.problem.unknowns();
        let rows = self.entries.iter().zip(&self.force_responses);
        for ((entry, response), impulse) in rows.zip(impulses) {
            for (sum, r) in trunk.iter_mut().zip(&response.trunk) {
                *sum += r * impulse;
            }
            let leg = entry.row.leg;
            for (sum, arm) in links.iter_mut().zip(&entry.force_row.links) {
                *sum = sum.with_lane(leg, sum.lane(leg) + arm * impulse);
            }
        }
        (trunk, links)
    }

    /// Returns the rate of a row after the impulses: without the compliance of a foot, which the
    /// motion does not have. That of a cable is its pulley's.
    fn rate_after(&self, row: usize) -> f64 {
        let entry = &self.entries[row];
        let compliance = match entry.role {
            Role::Stop(_) => 0.0,
            _ => entry.compliance,
        };
        self.problem.w(row) - compliance * self.problem.unknowns()[row]
    }

    /// Stores the feet stopped by the impact: those with an impulse inside the friction cone.
    fn note_stopped(&mut self, friction: &[f64; LEGS]) {
        let Some(last_impact) = &mut self.last_impact else {
            return;
        };
        let impulses = self.problem.unknowns();
        for (i, entry) in self.entries.iter().enumerate() {
            if let Role::Normal { links, .. } = entry.role {
                let pull = libm::hypot(impulses[i + 1], impulses[i + 2]);
                let limit = friction[entry.row.leg] * impulses[i] * (1.0 - 1e-9);
                last_impact.stopped[entry.row.leg][links - 3] = pull < limit;
            }
        }
    }

    /// Returns the ground impulses on each leg, world frame.
    pub(crate) fn ground(&self) -> [[f64; 3]; 4] {
        let mut ground = [[0.0; 3]; 4];
        for (entry, impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            for (sum, d) in ground[entry.row.leg].iter_mut().zip(&entry.direction) {
                *sum += impulse * d;
            }
        }
        ground
    }
}

/// Returns the robot during an impact: a motor of limited torque does not resist an impulse, a
/// motor without limit is rigid.
fn impact_model<const N: usize>(
    dynamics: &Dynamics<'_, Lanes, N>,
    state: &State<Lanes, N>,
) -> (Articulated<Lanes, N>, DriveAction<Lanes>) {
    let mut mode = dynamics.mode.drives_only();
    let mut drive = DriveAction::none();
    if let Some(drives) = &dynamics.model.drives {
        let limited = match drives {
            DriveModels::Servos(servos) => servos.both().map(|servo| servo.torque().is_finite()),
            DriveModels::Motors(_) => [true; 2],
        };
        let [at_hip, at_pulley] = drives.inertias();
        drive.pulley = state.pulley;
        drive.pulley_rate = state.pulley_rate;
        mode.active.hip = Lanes::splat(1.0);
        if limited[0] {
            mode.active.hip = Lanes::zero();
            drive.hip_inertia = Lanes::splat(at_hip);
        }
        if limited[1] {
            drive.pulley_mobility = Lanes::splat(1.0 / at_pulley);
        }
    }
    mode.update_any();
    (dynamics.articulated(state, &mode, &drive), drive)
}

impl<const N: usize> Articulated<Lanes, N> {
    /// Changes the velocities by generalised impulses.
    pub(crate) fn change_velocities(
        &self,
        state: &mut State<Lanes, N>,
        trunk: [f64; 6],
        mut torques: [Lanes; N],
    ) {
        if let Some(base) = &self.base {
            for (torque, column) in torques.iter_mut().zip(&base.coupling.columns) {
                for (c, &row) in column.iter().zip(&crate::model::coupling::COUPLED) {
                    *torque -= *c * Lanes::splat(trunk[row]);
                }
            }
            for i in 0..3 {
                state.velocity[i] += trunk[i];
                state.turning[i] += trunk[3 + i];
            }
        }
        for i in 0..N {
            for j in 0..N {
                state.rates[i] += self.mobility.matrix[i][j] * torques[j];
            }
        }
    }
}
