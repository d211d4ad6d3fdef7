//! Impacts: impulses at every closed constraint that would close further.

use core::mem;

use twinrig_contact::{Method, Restitution, Unsolved};
use twinrig_legged::Fitted;

use super::Instant;
use super::closed::{Entry, Feet, HOLDING, PLACES, Role, Stop, touching};
use super::losses::Losses;
use crate::articulated::Articulated;
use crate::constraints::Driven;
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

/// What an impact found, and which feet it stopped.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Struck {
    /// Rates of the closed gaps before it \[m/s\].
    pub(super) rates: [[f64; PLACES]; 4],
    /// By leg, and by point of the leg.
    pub(super) stopped: [[bool; 2]; 4],
}

impl Toll {
    /// Adds what another impact of the same instant took.
    pub(crate) fn add(&mut self, other: &Self) {
        self.impact += other.impact;
        self.friction += other.friction;
        let parts = other.ground.iter().flatten();
        for (sum, part) in self.ground.iter_mut().flatten().zip(parts) {
            *sum += part;
        }
    }
}

impl Struck {
    /// The velocity of a foot along the ground's tangents before the impact.
    pub(super) fn tangential(&self, leg: usize, links: usize) -> [f64; 2] {
        [1, 2].map(|which| self.rates[leg][Role::Tangent { links, which }.place()])
    }
}

impl<const N: usize> Instant<N> {
    /// The impact of these legs: impulses at every closed constraint that would close further.
    pub(crate) fn impact(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &mut State<Lanes, N>,
        legs: &[usize],
    ) -> Result<Toll, Unsolved> {
        let (articulated, drive) = self.closed(scene, state, legs);
        if !self.entries.iter().any(|e| e.is_normal() && e.rate < 0.0) {
            return Ok(Toll::default());
        }
        let [friction, restitution] = surface(scene);
        self.prepare(&articulated, friction);
        self.coefficients.clear();
        self.coefficients
            .extend(self.entries.iter().map(|entry| match entry.role {
                Role::Normal { .. } if entry.rate < -RESTING => restitution,
                _ => 0.0,
            }));
        let before = mem::take(&mut self.before);
        let coefficients = mem::take(&mut self.coefficients);
        let law = Restitution::Poisson;
        let solved = self.solve(HOLDING, Method::Newton, |problem, method| {
            problem.impact(law, &before, &coefficients, method)
        });
        (self.before, self.coefficients) = (before, coefficients);
        solved?;
        self.note_stopped(friction);
        Ok(self.strike(scene, state, &articulated, &drive))
    }

    /// The impact without collision of feet that jam ([`Instant::resolve_modes`]); none where no impulse helps.
    pub(crate) fn unjam(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &mut State<Lanes, N>,
        legs: &[usize],
    ) -> Result<Option<Toll>, Unsolved> {
        let (articulated, drive) = self.closed(scene, state, legs);
        let [friction, _] = surface(scene);
        self.prepare(&articulated, friction);
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
        let strikes = impulses.any(|(jams, impulse)| *jams && *impulse > 0.0);
        (self.before, self.marks) = (before, marks);
        solved?;
        self.note_stopped(friction);
        Ok(strikes.then(|| self.strike(scene, state, &articulated, &drive)))
    }

    /// Finds what is closed as an impact finds it, and its rates.
    fn closed(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        legs: &[usize],
    ) -> (Articulated<Lanes, N>, Driven<Lanes>) {
        let (articulated, drive) = slack(scene, state);
        self.find(
            scene,
            state,
            &articulated,
            &drive,
            legs,
            Feet::Held,
            &touching,
        );
        let mut struck = Struck::default();
        for entry in &self.entries {
            struck.rates[entry.row.leg][entry.role.place()] = entry.rate;
        }
        self.struck = Some(struck);
        self.before.clear();
        self.before
            .extend(self.entries.iter().map(|entry| entry.rate));
        (articulated, drive)
    }

    /// Changes the velocities by the impulses that were found, and says what they took.
    fn strike(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &mut State<Lanes, N>,
        articulated: &Articulated<Lanes, N>,
        drive: &Driven<Lanes>,
    ) -> Toll {
        let mut toll = Toll::default();
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
        toll
    }

    /// Notes which feet the impact has stopped: those whose impulse lies inside the cone of friction.
    fn note_stopped(&mut self, friction: f64) {
        let Some(struck) = &mut self.struck else {
            return;
        };
        let impulses = self.problem.unknowns();
        for (i, entry) in self.entries.iter().enumerate() {
            if let Role::Normal { links, .. } = entry.role {
                let pull = libm::hypot(impulses[i + 1], impulses[i + 2]);
                let limit = friction * impulses[i] * (1.0 - 1e-9);
                struck.stopped[entry.row.leg][links - 3] = pull < limit;
            }
        }
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

/// Friction and restitution of the ground; none where there is no ground.
fn surface<const N: usize>(scene: &Scene<'_, Lanes, N>) -> [f64; 2] {
    let ground = scene.model.ground.as_ref();
    ground.map_or([0.0; 2], |ground| [ground.friction, ground.restitution])
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
        mode.active.hip = Lanes::splat(1.0);
        if limited[0] {
            mode.active.hip = Lanes::zero();
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
