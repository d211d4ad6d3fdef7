//! Moreau's midpoint rule: constraints as impulses over a step, no matter when in it they act.
//!
//! ```text
//! q̄ = q + ½h u    (H(q̄) + ½h D)(u⁺ − u) = h f(q̄, u) + Jᵀ P    q⁺ = q̄ + ½h u⁺
//! 0 ≤ P ⊥ J u⁺ + γ g/h ≥ 0                         D: friction of the joints, what damps motors
//! ```
//!
//! No event is looked for, so a step costs the same whatever happens in it. Positions are of second order where nothing
//! opens or closes, of first order where something does.

use twinrig_legged::Fitted;

use crate::articulated::{Accelerations, Articulated, into_world, rotation, stored_in};
use crate::chain::rubbed;
use crate::drives::greatest;
use crate::events::{Entry, Role, Stop};
use crate::flow::{Flow, FlowError};
use crate::hold::{Driven, HIP, Holding};
use crate::motion::{Scene, quaternion_rate};
use crate::motors::Effort;
use crate::real::{Lanes, Real};
use crate::state::{Slope, State, normalised};

/// Share γ of a gap that a step takes away, or of an overlap that it gives back, where a constraint holds: as large as leaves
/// an overlap decaying without a swing, since positions move by the mean of the velocities at both ends.
const RECOVERY: f64 = 1.0 / 3.0;

/// Approach below which an impact gives nothing back, and the speed at which overlaps are \[m/s\].
const RESTING: f64 = 0.05;

/// Gaps that come nearer than this count as closing \[m\].
const TOUCHING: f64 = 1e-6;

/// Gaps farther from closing than this after a step are not looked at \[m\].
const REACH: f64 = 2e-3;

/// Tolerances of the impulses, relative to the greatest speed and in m/s.
const TOLERANCE: [f64; 2] = [1e-6, 1e-7];

/// A motor that changes its mind more often is on the border of its torque; either answer is right there.
const CHANGES_MAX: u32 = 4;

/// Halvings of a step whose impulses are not to be found, at most.
const HALVINGS_MAX: u32 = 8;

/// A step as it is solved.
struct Solved<const N: usize> {
    accelerations: Accelerations<Lanes, N>,
    drive: Driven<Lanes>,
    /// Mean acceleration of the pulleys, tension of the cables, torques of the motors.
    winding: Lanes,
    tension: Lanes,
    torques: [Lanes; 2],
}

impl<const N: usize> Flow<N> {
    /// Moves on by `seconds`, in halves where the impulses of a whole step are not to be found.
    pub(crate) fn run_moreau(&mut self, seconds: f64) -> Result<(), FlowError> {
        self.moreau_halved(seconds, HALVINGS_MAX)
    }

    fn moreau_halved(&mut self, seconds: f64, halvings: u32) -> Result<(), FlowError> {
        match self.moreau_step(seconds) {
            Err(FlowError::Unsolved(_)) if halvings > 0 => {
                self.counts.fallbacks += 1;
                self.moreau_halved(0.5 * seconds, halvings - 1)?;
                self.moreau_halved(0.5 * seconds, halvings - 1)
            }
            done => done,
        }
    }

    fn moreau_step(&mut self, seconds: f64) -> Result<(), FlowError> {
        let free = self.model.is_free();
        let before = self.state;
        let half = Lanes::splat(0.5 * seconds);
        let middle = normalised(&before.along(half, &drifting(&before, free), free), free);
        for change in 0.. {
            let wanted = self.wanted_over(&before, seconds);
            let solved = self.solve_step(&before, &middle, wanted, seconds)?;
            let effort = Effort {
                torques: solved.torques,
                given: [solved.accelerations.links[0], solved.winding],
                wanted,
            };
            if change == CHANGES_MAX || !self.tire(&effort) {
                self.finish(&before, &middle, &solved, seconds);
                break;
            }
        }
        self.finite()
    }

    /// Mean accelerations to the rates that the drives want at the step's end.
    fn wanted_over(&self, before: &State<Lanes, N>, seconds: f64) -> [Lanes; 2] {
        let Some(Fitted::Servos(servos)) = &self.model.drives else {
            return [Lanes::zero(); 2];
        };
        let told = [self.mode.commands.hip, self.mode.commands.pulley];
        let at = [before.angles[0], before.pulley];
        let rates = [before.rates[0], before.pulley_rate];
        std::array::from_fn(|i| {
            Lanes::new(std::array::from_fn(|leg| {
                let of = |lanes: &[Lanes; 2]| lanes[i].lane(leg);
                let rate = of(&rates);
                let then = servos.both()[i].rate_after(seconds, of(&told), of(&at), rate);
                (then - rate) / seconds
            }))
        })
    }

    /// What the drives do in the mean of a step. What damps a motor answers to accelerations, like friction in the joints.
    fn drive_over(
        &self,
        scene: &Scene<'_, Lanes, N>,
        before: &State<Lanes, N>,
        middle: &State<Lanes, N>,
        wanted: [Lanes; 2],
        seconds: f64,
    ) -> Driven<Lanes> {
        let mut drive = scene.drive(before);
        drive.pulley = middle.pulley;
        drive.hip_acceleration = wanted[0];
        let commands = &self.mode.commands;
        match &self.model.drives {
            None => {}
            Some(Fitted::Servos(servos)) => {
                let spent = commands.pulley_spent;
                let follows = Lanes::splat(1.0) - spent * spent;
                let torque = greatest(&servos.knee, spent, before.pulley_rate);
                drive.pulley_acceleration =
                    follows * wanted[1] + torque / Lanes::splat(servos.knee.inertia());
            }
            Some(Fitted::Motors(motors)) => {
                let half = Lanes::splat(0.5 * seconds);
                let inertia = Lanes::splat(motors.knee.inertia());
                drive.hip_inertia += half * commands.hip_damping;
                drive.pulley_mobility =
                    Lanes::splat(1.0) / (inertia + half * commands.pulley_damping);
                let torque = commands.pulley - commands.pulley_damping * before.pulley_rate;
                drive.pulley_acceleration = torque * drive.pulley_mobility;
            }
        }
        drive
    }

    /// The step's mean accelerations, with the impulses of the constraints in them.
    fn solve_step(
        &mut self,
        before: &State<Lanes, N>,
        middle: &State<Lanes, N>,
        wanted: [Lanes; 2],
        seconds: f64,
    ) -> Result<Solved<N>, FlowError> {
        self.counts.evaluations += 1;
        let legs = &self.model.side_by_side;
        let scene = Scene::new(&self.model, legs, &self.mode, 0.0);
        let drive = self.drive_over(&scene, before, middle, wanted, seconds);
        let mut mode = self.mode.clone_without_stops();
        mode.recount();
        let holding = Holding {
            holds: &mode.holds,
            drive: &drive,
            recovery: Lanes::zero(),
            ahead: 0.5 * seconds,
            any: mode.any,
        };
        let articulated = Articulated::new(&self.model, legs, middle, &holding);
        let mut accelerations = articulated.accelerations();
        self.impulses(&articulated, middle, &drive, &mut accelerations, seconds)?;
        let tension = self.tension(seconds);
        let radius = self.model.side_by_side.pulley_radius;
        let winding = drive.pulley_acceleration - drive.pulley_mobility * radius * tension;
        let mut torques = [Lanes::zero(); 2];
        if let Some(drives) = &self.model.drives {
            let inertia = drives.inertias().map(Lanes::splat);
            torques[0] = drive.hip_torque;
            if let Fitted::Servos(_) = drives {
                let spent = self.mode.commands.hip_spent;
                let follows = Lanes::splat(1.0) - spent * spent;
                let held = articulated.give.forces(&accelerations.torques)[HIP];
                torques[0] += follows * (inertia[0] * accelerations.links[0] + held);
            } else {
                let lost = Lanes::splat(0.5 * seconds) * self.mode.commands.hip_damping;
                torques[0] -= lost * accelerations.links[0];
            }
            torques[1] = inertia[1] * winding + radius * tension;
        }
        Ok(Solved {
            accelerations,
            drive,
            winding,
            tension,
            torques,
        })
    }

    /// Finds the impulses, and adds what they do to the accelerations.
    fn impulses(
        &mut self,
        articulated: &Articulated<Lanes, N>,
        middle: &State<Lanes, N>,
        drive: &Driven<Lanes>,
        accelerations: &mut Accelerations<Lanes, N>,
        seconds: f64,
    ) -> Result<(), FlowError> {
        let Self {
            model,
            mode,
            instant,
            free_rates,
            pushed,
            counts,
            ..
        } = self;
        let scene = Scene::new(model, &model.side_by_side, mode, 0.0);
        let near = |gap: f64, rate: f64| gap + 0.5 * seconds * rate.min(0.0) < REACH;
        let legs = [0, 1, 2, 3];
        let legs = &legs[..model.legs.len()];
        instant.find(&scene, middle, articulated, drive, legs, false, &near);
        free_rates.clear();
        let mut kept = false;
        instant.entries.retain(|entry| {
            let free = entry.rate + seconds * pushed_by(entry, accelerations);
            if !entry.role.is_tangent() {
                kept = entry.gap + 0.5 * seconds * entry.rate.min(free) < TOUCHING;
            }
            if kept {
                free_rates.push(free);
            }
            kept
        });
        let ground = model.ground.as_ref();
        let [friction, restitution] =
            ground.map_or([0.0; 2], |ground| [ground.friction, ground.restitution]);
        instant.prepare(articulated, friction);
        for (i, (entry, free)) in instant.entries.iter().zip(free_rates.iter()).enumerate() {
            instant
                .problem
                .offset(i, free + allowed(entry, restitution, seconds));
            let last = pushed[entry.row.leg][entry.role.place()];
            instant.problem.guess(i, last * seconds);
        }
        let solution = instant.problem.solve_within(TOLERANCE[0], TOLERANCE[1])?;
        instant.count(&solution);
        (counts.solver_iterations, counts.factorisations) =
            (instant.iterations, instant.factorisations);
        let (mut trunk, mut torques) = (accelerations.trunk, articulated.torques);
        let impulses = instant.problem.unknowns();
        for ((entry, push), impulse) in instant.entries.iter().zip(&instant.pushes).zip(impulses) {
            let force = impulse / seconds;
            for (a, r) in trunk.iter_mut().zip(&push.trunk) {
                *a += r * force;
            }
            for (torque, arm) in torques.iter_mut().zip(&entry.push.links) {
                let own = torque.lane(entry.row.leg) + arm * force;
                *torque = torque.with_lane(entry.row.leg, own);
            }
        }
        *accelerations = articulated.with_trunk(trunk, &torques);
        Ok(())
    }

    /// Tension of each leg's cable, mean over the step.
    fn tension(&self, seconds: f64) -> Lanes {
        let mut tension = Lanes::zero();
        let impulses = self.instant.problem.unknowns();
        for (entry, impulse) in self.instant.entries.iter().zip(impulses) {
            if entry.role == Role::Stop(Stop::Cable) {
                tension = tension.with_lane(entry.row.leg, impulse / seconds);
            }
        }
        tension
    }

    /// Takes the step's end as the present and writes up what has flowed.
    fn finish(
        &mut self,
        before: &State<Lanes, N>,
        middle: &State<Lanes, N>,
        solved: &Solved<N>,
        seconds: f64,
    ) {
        let (h, half) = (Lanes::splat(seconds), Lanes::splat(0.5 * seconds));
        let free = self.model.is_free();
        let mut after = *middle;
        for i in 0..N {
            after.rates[i] += h * solved.accelerations.links[i];
        }
        after.pulley_rate += h * solved.winding;
        if free {
            for i in 0..3 {
                after.velocity[i] += seconds * solved.accelerations.trunk[i];
                after.turning[i] += seconds * solved.accelerations.trunk[3 + i];
            }
        }
        after = normalised(&after.along(half, &drifting(&after, free), free), free);
        let [hip, knee] = solved.torques;
        self.tally.hip += h * hip;
        self.tally.knee += h * knee;
        self.tally.cable += h * solved.tension;
        let turned = half * (before.rates[0] + after.rates[0]);
        let wound = half * (before.pulley_rate + after.pulley_rate);
        self.ledger.actuator += (hip * turned + knee * wound).sum();
        let mean = std::array::from_fn(|i| Lanes::splat(0.5) * (before.rates[i] + after.rates[i]));
        let torques = rubbed(&self.model.side_by_side, &mean);
        for i in 0..N {
            self.ledger.dissipated -= (h * torques[i] * mean[i]).sum();
        }
        let _ = &solved.drive;
        self.state = after;
        self.take_toll(seconds);
        self.ledger
            .balance(stored_in(&self.model, &self.model.side_by_side, &after));
        self.counts.steps += 1;
    }

    /// Writes up what the impulses took, and what the ground gave the feet.
    fn take_toll(&mut self, seconds: f64) {
        let restitution = self
            .model
            .ground
            .as_ref()
            .map_or(0.0, |ground| ground.restitution);
        let before = core::mem::take(&mut self.pushed);
        let losses = self.instant.losses(1.0, |row| {
            let entry = &self.instant.entries[row];
            self.instant.problem.w(row) - allowed(entry, restitution, seconds)
        });
        self.ledger.impact += losses.impact;
        self.ledger.dissipated += losses.friction;
        let impulses = self.instant.problem.unknowns();
        for (entry, impulse) in self.instant.entries.iter().zip(impulses) {
            let (leg, place) = (entry.row.leg, entry.role.place());
            self.pushed[leg][place] = impulse / seconds;
            let met = *impulse > 0.0 && before[leg][place] <= 0.0;
            self.counts.events += u64::from(met && !entry.role.is_tangent());
        }
        let ground = self.instant.ground();
        self.tally.push(&ground);
    }
}

/// How positions change at the velocities of a state.
fn drifting<const N: usize>(state: &State<Lanes, N>, free: bool) -> Slope<Lanes, N> {
    let mut slope = Slope::zero();
    slope.angles = state.rates;
    slope.pulley = state.pulley_rate;
    if free {
        slope.position = into_world(&rotation(state.attitude), state.velocity);
        slope.attitude = quaternion_rate(state.attitude, state.turning);
    }
    slope
}

/// Acceleration of a gap by everything but the constraints.
fn pushed_by<const N: usize>(entry: &Entry<N>, accelerations: &Accelerations<Lanes, N>) -> f64 {
    let mut sum = entry.winding;
    for (j, a) in entry.row.trunk.iter().zip(&accelerations.trunk) {
        sum += j * a;
    }
    for (j, a) in entry.row.links.iter().zip(&accelerations.links) {
        sum += j * a.lane(entry.row.leg);
    }
    sum
}

/// What a gap's rate at the end of the step may fall short of zero by, for the gap there is or the rebound there shall be.
fn allowed<const N: usize>(entry: &Entry<N>, restitution: f64, seconds: f64) -> f64 {
    let start = entry.gap - 0.5 * seconds * entry.rate;
    // An overlap is given back slowly, or an impact would rebound with what its step overlapped.
    let recovered = (RECOVERY * start / seconds).max(-RESTING);
    match entry.role {
        Role::Tangent { .. } => 0.0,
        Role::Normal { .. } if restitution > 0.0 && entry.rate < -RESTING => {
            (restitution * entry.rate).min(recovered)
        }
        _ => recovered,
    }
}
