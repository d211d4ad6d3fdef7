//! Impulses of a step: the complementarity problem in its middle, with the impulses of the last
//! step as the initial guess.

use twinrig_contact::Method;

use super::drift::Rates;
use super::kick::Kick;
use super::momentum::{Geometry, Momenta};
use crate::constraints::events::{Entry, Feet, Instant, Role, SLOTS, Stop};
use crate::constraints::motion::Dynamics;
use crate::integrators::run_state::RunState;
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::articulated::{Accelerations, Articulated};
use crate::model::leg_constraints::DriveAction;
use crate::model::load::PushForces;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Share γ of a gap that a step closes, or of an overlap that it corrects, at an active constraint:
/// the maximum for which an overlap decays without oscillation, as positions advance by the mean of
/// the velocities at both ends.
pub(super) const RECOVERY: f64 = 1.0 / 3.0;

/// Approach velocity below which an impact has no restitution, and maximum velocity of the
/// correction of an overlap \[m/s\].
const RESTING: f64 = 0.05;

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
    /// Rates without the impulses, by row.
    free_rates: Vec<f64>,
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
        let restitution = model.restitution();
        instant.prepare(articulated, &model.friction);
        for (i, (entry, free)) in instant.entries.iter().zip(free_rates.iter()).enumerate() {
            instant
                .problem
                .offset(i, free + rate_offset(entry, restitution, seconds));
            let last = last_impulses.force(entry.row.leg, entry.role.slot());
            instant.problem.guess(i, last * seconds);
        }
        instant.solve(
            VIOLATION_ACCEPTED,
            Method::Newton,
            |problem, method| match method {
                Method::Newton => problem.solve_within(TOLERANCE[0], TOLERANCE[1]),
                _ => problem.solve_by(method),
            },
        )?;
        instant.problem.project_onto_bounds();
        let (mut trunk, mut torques) = (accelerations.trunk, articulated.torques);
        let impulses = instant.problem.unknowns();
        for ((entry, response), impulse) in instant
            .entries
            .iter()
            .zip(&instant.force_responses)
            .zip(impulses)
        {
            let force = impulse / seconds;
            for (a, r) in trunk.iter_mut().zip(&response.trunk) {
                *a += r * force;
            }
            for (torque, arm) in torques.iter_mut().zip(&entry.force_row.links) {
                let sum = torque.lane(entry.row.leg) + arm * force;
                *torque = torque.with_lane(entry.row.leg, sum);
            }
        }
        Ok((articulated.with_trunk(trunk, &torques), torques))
    }

    /// Returns the tension of each leg's cable, mean over the step \[N\].
    pub(super) fn tension(&self, seconds: f64) -> Lanes {
        let mut tension = Lanes::zero();
        let impulses = self.instant.problem.unknowns();
        for (entry, impulse) in self.instant.entries.iter().zip(impulses) {
            if entry.role == Role::Stop(Stop::Cable) {
                tension = tension.with_lane(entry.row.leg, impulse / seconds);
            }
        }
        tension
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
        let before = core::mem::take(&mut self.last_impulses).impulses;
        self.last_impulses.seconds = seconds;
        let losses = self.instant.losses(1.0, |row| {
            let entry = &self.instant.entries[row];
            self.instant.problem.w(row) - rate_offset(entry, restitution, seconds)
        });
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

/// Returns the offset of a gap's rate at the end of the step, for the correction of the gap or the
/// rebound of an impact.
fn rate_offset<const N: usize>(entry: &Entry<N>, restitution: f64, seconds: f64) -> f64 {
    let start = entry.gap - 0.5 * seconds * entry.rate;
    // Slow correction; otherwise an impact would rebound by the overlap of its step.
    let recovered = (RECOVERY * start / seconds).max(-RESTING);
    match entry.role {
        Role::Tangent { .. } => 0.0,
        Role::Normal { .. } if restitution > 0.0 && entry.rate < -RESTING => {
            (restitution * entry.rate).min(recovered)
        }
        _ => recovered,
    }
}
