//! Impacts: impulses at every closed constraint that would close further.

use core::mem;

use twinrig_contact::{Method, Restitution, Unsolved};
use twinrig_legged::Fitted;

use super::Instant;
use super::closed::{HOLDING, PLACES, Role, Stop, touching};
use super::losses::Losses;
use crate::articulated::Articulated;
use crate::hold::Driven;
use crate::motion::Scene;
use crate::real::{Lanes, Real};
use crate::state::State;

/// Approach below which an impact gives nothing back \[m/s\].
pub(super) const RESTING: f64 = 0.05;

/// What an impact took: by normal impulses, by friction \[J\], and the ground's impulses on each leg, world frame \[N·s\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Toll {
    pub(crate) impact: f64,
    pub(crate) friction: f64,
    pub(crate) ground: [[f64; 3]; 4],
}

impl<const N: usize> Instant<N> {
    /// The impact of these legs: impulses at every closed constraint that would close further.
    pub(crate) fn impact(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &mut State<Lanes, N>,
        legs: &[usize],
    ) -> Result<Toll, Unsolved> {
        let (articulated, drive) = slack(scene, state);
        self.find(scene, state, &articulated, &drive, legs, false, &touching);
        let mut toll = Toll::default();
        let mut drifts = [[0.0; PLACES]; 4];
        for entry in &self.entries {
            drifts[entry.row.leg][entry.role.place()] = entry.rate;
        }
        self.drifts = Some(drifts);
        if !self.entries.iter().any(|e| e.is_normal() && e.rate < 0.0) {
            return Ok(toll);
        }
        let (friction, restitution) = scene
            .model
            .ground
            .as_ref()
            .map_or((0.0, 0.0), |ground| (ground.friction, ground.restitution));
        self.prepare(&articulated, friction);
        self.before.clear();
        self.before
            .extend(self.entries.iter().map(|entry| entry.rate));
        self.coefficients.clear();
        self.coefficients
            .extend(self.entries.iter().map(|entry| match entry.role {
                Role::Normal { .. } if entry.rate < -RESTING => restitution,
                _ => 0.0,
            }));
        let Self {
            before,
            coefficients,
            ..
        } = self;
        let (before, coefficients) = (mem::take(before), mem::take(coefficients));
        let law = Restitution::Poisson;
        let solved = self.solve(HOLDING, Method::Newton, |problem, method| {
            problem.impact(law, &before, &coefficients, method)
        });
        (self.before, self.coefficients) = (before, coefficients);
        solved?;
        let mut trunk = [0.0; 6];
        let mut torques = [Lanes::zero(); N];
        for (i, (entry, &impulse)) in self.entries.iter().zip(self.problem.unknowns()).enumerate() {
            for (a, r) in trunk.iter_mut().zip(&self.pushes[i].trunk) {
                *a += r * impulse;
            }
            for (torque, arm) in torques.iter_mut().zip(&entry.push.links) {
                let own = torque.lane(entry.row.leg) + arm * impulse;
                *torque = torque.with_lane(entry.row.leg, own);
            }
            if entry.role == Role::Stop(Stop::Cable) {
                let leg = entry.row.leg;
                let back = drive.pulley_mobility.lane(leg) * scene.legs.pulley_radius.lane(leg);
                let rate = state.pulley_rate.lane(leg) - back * impulse;
                state.pulley_rate = state.pulley_rate.with_lane(leg, rate);
            }
        }
        articulated.give_way(state, trunk, torques);
        let Losses { impact, friction } = self.losses(1.0, |row| self.problem.w(row));
        (toll.impact, toll.friction) = (impact, friction);
        toll.ground = self.ground();
        Ok(toll)
    }

    /// The ground's impulses on each leg, world frame.
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

/// The robot as an impact finds it: a motor of limited torque has none to set against an impulse, one without limits stands
/// like a rock.
fn slack<const N: usize>(
    scene: &Scene<'_, Lanes, N>,
    state: &State<Lanes, N>,
) -> (Articulated<Lanes, N>, Driven<Lanes>) {
    let mut mode = scene.mode.clone_without_stops();
    let mut drive = Driven::none();
    if let Some(drives) = &scene.model.drives {
        let limited = match drives {
            Fitted::Servos(servos) => servos.both().map(|servo| servo.torque().is_finite()),
            Fitted::Motors(_) => [true; 2],
        };
        let [at_hip, at_pulley] = drives.inertias();
        drive.pulley = state.pulley;
        drive.pulley_rate = state.pulley_rate;
        mode.holds.hip = Lanes::splat(1.0);
        if limited[0] {
            mode.holds.hip = Lanes::zero();
            drive.hip_inertia = Lanes::splat(at_hip);
        }
        if limited[1] {
            drive.pulley_mobility = Lanes::splat(1.0 / at_pulley);
        }
    }
    mode.recount();
    (scene.articulated(state, &mode, &drive), drive)
}

impl<const N: usize> Articulated<Lanes, N> {
    /// Changes the velocities by what impulses do.
    fn give_way(&self, state: &mut State<Lanes, N>, trunk: [f64; 6], mut torques: [Lanes; N]) {
        if let Some(base) = &self.base {
            for (torque, column) in torques.iter_mut().zip(&base.carried.columns) {
                for (c, &row) in column.iter().zip(&crate::carried::COUPLED) {
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
                state.rates[i] += self.give.mobility[i][j] * torques[j];
            }
        }
    }
}
