//! Moreau's midpoint rule: constraints as impulses over a step, independent of their time within
//! it.
//!
//! ```text
//! q̄ = q ⊕ ½h u_a                                               q⁺ = q̄ ⊕ ½h u_b
//! (H(q̄) + ½h D)(u_b − u_a) = h (f(q̄, u_a) + ½(g(u_a) + g(u_b))) + Jᵀ P
//! 0 ≤ P ⊥ J u_b + γ g/h ≥ 0      D: friction of the joints, damping of the motors
//! ```
//!
//! Momenta are constant in the half steps ([`drift`]); forces and impulses change them in the
//! middle ([`kick`]). Without impulses this is the generalised leapfrog: second order, symplectic,
//! time-reversible. Momentum is balanced to round-off; the energy oscillates by an error of second
//! order and does not drift. J is that at q̄; g is the gap at the beginning of the step,
//! extrapolated from the middle, `g(q̄) − ½h J u_a`, and γ g/h is not below −50 mm/s.
//!
//! Without event location a step has constant cost, and is of first order where a constraint opens
//! or closes.

mod drift;
mod drives;
mod kick;
mod momentum;

use twinrig_contact::Method;
use twinrig_legged::DriveModels;

use crate::constraints::events::{Entry, Feet, Role, SLOTS, Stop};
use crate::integrators::flow::Flow;
use crate::integrators::saturation::Effort;
use crate::integrators::step_error::StepError;
use crate::model::articulated::{Accelerations, Articulated, rotation};
use crate::model::chain::friction_torques;
use crate::model::leg_constraints::{ConstraintSet, DriveAction, HIP};
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

use drift::{HalfStep, Momentum, Rates, advance_joints, rotated};
use drives::{MeanDrive, TorqueSpeedLines};
use kick::Kick;
use momentum::{Geometry, Momenta};

/// Share γ of a gap that a step closes, or of an overlap that it corrects, at an active constraint:
/// the maximum for which an overlap decays without oscillation, as positions advance by the mean of
/// the velocities at both ends.
const RECOVERY: f64 = 1.0 / 3.0;

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

/// A motor that changes more often is at the limit of its torque, where both modes are valid.
const CHANGES_MAX: u32 = 4;

/// Maximum number of halvings of a step whose impulses are not found.
const HALVINGS_MAX: u32 = 8;

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
    fn forces_over(&self, seconds: f64) -> [[f64; SLOTS]; 4] {
        let longer = self.seconds.max(seconds);
        self.impulses
            .map(|slots| slots.map(|impulse| impulse / longer))
    }
}

/// Inertia of the robot at one end of a step.
#[derive(Debug, Clone)]
struct Node<const N: usize> {
    angles: [Lanes; N],
    /// Mask of the hips that follow their commands, and inertia of the motors at the others.
    hips: [Lanes; 2],
    inertia: Articulated<Lanes, N>,
    geometry: Geometry<N>,
    /// Whether it is computed.
    known: bool,
}

/// Memory of a step: large values that are swapped instead of copied.
#[derive(Debug, Clone)]
pub(crate) struct Memory<const N: usize> {
    start: Box<Node<N>>,
    end: Box<Node<N>>,
    middle: Articulated<Lanes, N>,
}

impl<const N: usize> Node<N> {
    fn blank() -> Self {
        Self {
            angles: [Lanes::zero(); N],
            hips: [Lanes::zero(); 2],
            inertia: Articulated::blank(),
            geometry: Geometry::blank(),
            known: false,
        }
    }
}

impl<const N: usize> Default for Memory<N> {
    fn default() -> Self {
        Self {
            start: Box::new(Node::blank()),
            end: Box::new(Node::blank()),
            middle: Articulated::blank(),
        }
    }
}

/// Solution of a step.
struct SolvedStep<const N: usize> {
    after: State<Lanes, N>,
    /// Means of the rates before and after the impulses.
    mean: [Lanes; N],
    /// Tension of the cables and torques of the motors, mean over the step, and work of the hip
    /// motors \[J\].
    tension: Lanes,
    torques: [Lanes; 2],
    hip_work: Lanes,
}

/// Hips over a step.
struct Hip {
    /// Rates before and after the forces in the middle.
    rates: [Lanes; 2],
    acceleration: Lanes,
    /// Damping of motors that impose no acceleration \[N·m·s/rad\].
    damping: Lanes,
    /// Torque that imposes the acceleration of the other motors \[N·m\].
    imposed_torque: Lanes,
    /// Changes of momentum in the half steps before and after, due to the change of the legs'
    /// configuration \[kg·m²/s\].
    momentum_change: [Lanes; 2],
}

impl<const N: usize> Flow<N> {
    /// Advances by `seconds`; halves a step whose impulses are not found.
    pub(crate) fn run_moreau(&mut self, seconds: f64) -> Result<(), StepError> {
        self.moreau_halved(seconds, HALVINGS_MAX)
    }

    fn moreau_halved(&mut self, seconds: f64, halvings: u32) -> Result<(), StepError> {
        let mut memory = self.midpoint.take().unwrap_or_default();
        let done = self.moreau_step(seconds, &mut memory);
        self.midpoint = Some(memory);
        match done {
            Err(StepError::SolveError(_) | StepError::NotConverged { .. }) if halvings > 0 => {
                self.run.counts.fallbacks += 1;
                self.moreau_halved(0.5 * seconds, halvings - 1)?;
                self.moreau_halved(0.5 * seconds, halvings - 1)
            }
            done => done,
        }
    }

    fn moreau_step(&mut self, seconds: f64, memory: &mut Memory<N>) -> Result<(), StepError> {
        let before = self.run.state;
        let commanded = self.mean_commanded(&before, seconds);
        let mut lines = self.torque_speed_lines([before.rates[0], before.pulley_rate]);
        for change in 0.. {
            let solved = self.solve_step(memory, &before, commanded, &lines, seconds)?;
            let (half, per) = (Lanes::splat(0.5), Lanes::splat(1.0 / seconds));
            let after = &solved.after;
            let effort = Effort {
                torques: solved.torques,
                actual: [
                    (after.rates[0] - before.rates[0]) * per,
                    (after.pulley_rate - before.pulley_rate) * per,
                ],
                commanded,
                rates: [
                    solved.mean[0],
                    half * (before.pulley_rate + after.pulley_rate),
                ],
            };
            let saturated = self.saturate(&effort);
            let now = self.torque_speed_lines(effort.rates);
            if change == CHANGES_MAX || !saturated && now == lines {
                self.finish(&before, &solved, memory, seconds);
                break;
            }
            lines = now;
        }
        self.run.check_finite(&self.model)
    }

    /// Computes the inertia with links at these angles, in the present mode of the motors.
    fn renew(&self, node: &mut Node<N>, angles: &[Lanes; N]) {
        let mut drive = DriveAction::none();
        // Hips that follow their commands impose a unit rate of 1 rad/s.
        drive.hip_acceleration = Lanes::splat(1.0);
        if let Some(drives) = &self.model.drives {
            let saturated = self.run.mode.commands.hip_saturated;
            drive.hip_inertia = saturated * saturated * Lanes::splat(drives.inertias()[0]);
        }
        let mode = self.run.mode.drives_only();
        let hips = [mode.active.hip, drive.hip_inertia];
        if node.known && node.angles == *angles && node.hips == hips {
            return;
        }
        let mut mode = mode;
        mode.update_any();
        let constraint_set = ConstraintSet {
            active: &mode.active,
            drive: &drive,
            recovery: Lanes::zero(),
            implicit_seconds: 0.0,
            any: mode.any,
        };
        let zero_rates = [Lanes::zero(); N];
        let inertia = &mut node.inertia;
        inertia.unload(
            &self.model,
            &self.model.side_by_side,
            [angles, &zero_rates],
            &constraint_set,
        );
        node.geometry = Geometry::of(&self.model, inertia);
        (node.angles, node.hips, node.known) = (*angles, hips, true);
    }

    /// Computes the end of a step under these drives.
    #[expect(
        clippy::too_many_lines,
        reason = "the stages of one step, in the order of the equations"
    )]
    fn solve_step(
        &mut self,
        memory: &mut Memory<N>,
        before: &State<Lanes, N>,
        commanded: [Lanes; 2],
        lines: &TorqueSpeedLines,
        seconds: f64,
    ) -> Result<SolvedStep<N>, StepError> {
        self.run.counts.evaluations += 1;
        let half = 0.5 * seconds;
        self.renew(&mut memory.start, &before.angles);
        let (start, legs) = (&memory.start.geometry, &self.model.side_by_side);
        let from = start.momenta(legs, &before.rates, before.turning);
        let hip_inertia = memory.start.hips[1];
        let half_step = HalfStep {
            model: &self.model,
            inertia: &memory.start.inertia,
            hip_inertia,
            seconds: half,
        };
        let initial = Rates {
            links: before.rates,
            turning: before.turning,
        };
        let (rates, last_momenta) = half_step.rates(&before.angles, initial, &from)?;
        let mut middle = *before;
        (middle.rates, middle.turning) = (rates.links, rates.turning);
        advance_joints(&mut middle, half);

        let dynamics = self.run.dynamics(&self.model, 0.0);
        let MeanDrive { drive, hip_damping } =
            self.drive_over(&dynamics, &middle, commanded, lines, seconds);
        self.unload_middle(&mut memory.middle, &middle, &drive, half);
        let geometry = Geometry::of(&self.model, &memory.middle);
        let mut momentum = None;
        if let Some((base, (body, middle_body))) = memory
            .middle
            .base
            .as_mut()
            .zip(start.body.zip(geometry.body))
        {
            let mut robot = Momentum::of(&self.model, before, &body, from.relative, from.spin);
            robot.drift(half);
            middle.attitude = rotated(before.attitude, rates.turning, half);
            let relative = geometry.relative(legs, &rates.links, rates.turning);
            robot.place_trunk(&mut middle, &middle_body, relative);
            base.rotation = rotation(middle.attitude);
            momentum = Some((robot, middle_body));
        }
        let kick = (&geometry, &rates, &last_momenta);
        let (accelerations, torques) =
            self.impulses(&mut memory.middle, &middle, &drive, kick, seconds)?;
        let tension = self.tension(seconds);

        let legs = &self.model.side_by_side;
        let h = Lanes::splat(seconds);
        let mut after = middle;
        for i in 0..N {
            after.rates[i] += h * accelerations.links[i];
        }
        for i in 0..3 {
            after.turning[i] += seconds * accelerations.trunk[3 + i];
        }
        let radius = legs.pulley_radius;
        let winding = drive.pulley_acceleration - drive.pulley_mobility * radius * tension;
        after.pulley_rate += h * winding;
        let mean = std::array::from_fn(|i| Lanes::splat(0.5) * (rates.links[i] + after.rates[i]));
        let last = Rates {
            links: after.rates,
            turning: after.turning,
        };
        // Momenta of the links under all forces.
        let change = std::array::from_fn(|i| last.links[i] - rates.links[i]);
        let damping = friction_torques(legs, &change);
        let mut momenta: [Lanes; N] = std::array::from_fn(|i| {
            from.links[i] + h * torques[i] + Lanes::splat(half) * damping[i]
        });
        momenta[0] += hip_inertia * before.rates[0] - Lanes::splat(half) * hip_damping * change[0];

        advance_joints(&mut after, half);
        self.renew(&mut memory.end, &after.angles);
        let (end, legs) = (&memory.end.geometry, &self.model.side_by_side);
        let mut spin = [0.0; 3];
        if let Some(((robot, body), end_body)) = momentum.as_mut().zip(end.body) {
            let velocity_change =
                robot.apply(&self.instant.wrench(), &memory.middle, body, seconds);
            let [forward, _, up] = velocity_change.map(Lanes::splat);
            let chain = &memory.middle.chain;
            for i in 0..N {
                let along = chain.cosines[i] * forward + chain.sines[i] * up;
                momenta[i] -= legs.moments[i] * along;
            }
            robot.drift(half);
            after.attitude = rotated(middle.attitude, last.turning, half);
            spin = robot.spin_in(after.attitude);
            *body = end_body;
        }
        let rates_after = memory.end.inertia.rates_of(&momenta, spin, last.links[0]);
        (after.rates, after.turning) = (rates_after.links, rates_after.turning);
        if let Some((robot, body)) = momentum {
            let relative = end.relative(legs, &after.rates, after.turning);
            robot.place_trunk(&mut after, &body, relative);
        }
        let mut solved = SolvedStep {
            after,
            mean,
            tension,
            torques: [Lanes::zero(); 2],
            hip_work: Lanes::zero(),
        };
        // A hip at constant rate changes its momentum as its leg bends.
        let at = |geometry: &Geometry<N>, rates: &Rates<N>| {
            let momenta = geometry.momenta(legs, &rates.links, rates.turning);
            momenta.links[0]
        };
        let ends = Rates {
            links: solved.after.rates,
            turning: solved.after.turning,
        };
        if self.model.drives.is_some() {
            let hip = Hip {
                rates: [rates.links[0], last.links[0]],
                acceleration: accelerations.links[0],
                damping: hip_damping,
                imposed_torque: memory.middle.mobility.forces(&accelerations.torques)[HIP],
                momentum_change: [
                    at(&geometry, &rates) - from.links[0],
                    at(end, &ends) - at(&geometry, &last),
                ],
            };
            self.drive_torques(&mut solved, &drive, &hip, winding, seconds);
        }
        Ok(solved)
    }

    /// Computes the inertia in the middle of a step, with the drives as constraints.
    fn unload_middle(
        &self,
        articulated: &mut Articulated<Lanes, N>,
        middle: &State<Lanes, N>,
        drive: &DriveAction<Lanes>,
        half: f64,
    ) {
        let mut mode = self.run.mode.drives_only();
        mode.update_any();
        let constraint_set = ConstraintSet {
            active: &mode.active,
            drive,
            recovery: Lanes::zero(),
            implicit_seconds: half,
            any: mode.any,
        };
        let moving = [&middle.angles, &middle.rates];
        articulated.unload(
            &self.model,
            &self.model.side_by_side,
            moving,
            &constraint_set,
        );
    }

    /// Computes the torques of the motors, mean over a step, and the work of the hip motors.
    fn drive_torques(
        &self,
        solved: &mut SolvedStep<N>,
        drive: &DriveAction<Lanes>,
        hip: &Hip,
        winding: Lanes,
        seconds: f64,
    ) {
        let Some(drives) = &self.model.drives else {
            return;
        };
        let h = Lanes::splat(seconds);
        let inertia = drives.inertias().map(Lanes::splat);
        let lost = Lanes::splat(0.5 * seconds) * hip.damping;
        let mut torque = drive.hip_torque - lost * hip.acceleration;
        solved.hip_work = h * torque * solved.mean[0];
        if let DriveModels::Servos(_) = drives {
            let saturated = self.run.mode.commands.hip_saturated;
            let follows = Lanes::splat(1.0) - saturated * saturated;
            let kick = h * (inertia[0] * hip.acceleration + hip.imposed_torque);
            let ([behind, beyond], [first, last]) = (hip.momentum_change, hip.rates);
            torque += follows * (behind + kick + beyond) / h;
            solved.hip_work += follows * (behind * first + kick * solved.mean[0] + beyond * last);
        }
        let radius = self.model.side_by_side.pulley_radius;
        solved.torques = [torque, inertia[1] * winding + radius * solved.tension];
    }

    /// Solves for the impulses; returns the accelerations under them, and the torques on the links.
    fn impulses(
        &mut self,
        articulated: &mut Articulated<Lanes, N>,
        middle: &State<Lanes, N>,
        drive: &DriveAction<Lanes>,
        (geometry, rates, before): (&Geometry<N>, &Rates<N>, &Momenta<N>),
        seconds: f64,
    ) -> Result<(Accelerations<Lanes, N>, [Lanes; N]), StepError> {
        let Self {
            model,
            run,
            instant,
            free_rates,
            last_impulses,
            ..
        } = self;
        let dynamics = run.dynamics(model, 0.0);
        let near = |gap: f64, rate: f64| gap + 0.5 * seconds * rate.min(0.0) < SEARCH_DISTANCE;
        let legs = [0, 1, 2, 3];
        let legs = &legs[..model.legs.len()];
        instant.find_entries(
            &dynamics,
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
        let ground = model.ground.as_ref();
        let [friction, restitution] =
            ground.map_or([0.0; 2], |ground| [ground.friction, ground.restitution]);
        instant.prepare(articulated, friction);
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
        (run.counts.solver_iterations, run.counts.factorisations) =
            (instant.iterations, instant.factorisations);
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

    /// Accepts the end of the step and enters its work in the energy balance.
    fn finish(
        &mut self,
        before: &State<Lanes, N>,
        solved: &SolvedStep<N>,
        memory: &mut Memory<N>,
        seconds: f64,
    ) {
        let (h, half) = (Lanes::splat(seconds), Lanes::splat(0.5 * seconds));
        let after = solved.after;
        let [hip, knee] = solved.torques;
        self.run.impulse_sums.hip += h * hip;
        self.run.impulse_sums.knee += h * knee;
        self.run.impulse_sums.cable += h * solved.tension;
        let wound = half * (before.pulley_rate + after.pulley_rate);
        self.run.ledger.actuator += (solved.hip_work + knee * wound).sum();
        let torques = friction_torques(&self.model.side_by_side, &solved.mean);
        for i in 0..N {
            self.run.ledger.dissipated -= (h * torques[i] * solved.mean[i]).sum();
        }
        self.record_impulses(seconds);
        let end = &mut memory.end.inertia;
        end.chain.rates = after.rates;
        if let Some(base) = &mut end.base {
            base.rotation = rotation(after.attitude);
        }
        let stored = end.stored(&self.model, &self.model.side_by_side, &after);
        self.run.ledger.close_step(stored);
        core::mem::swap(&mut memory.start, &mut memory.end);
        self.run.state = after;
        self.run.counts.steps += 1;
    }

    /// Enters the work of the impulses in the energy balance, and the ground impulses in the sums.
    fn record_impulses(&mut self, seconds: f64) {
        let restitution = self
            .model
            .ground
            .as_ref()
            .map_or(0.0, |ground| ground.restitution);
        let before = core::mem::take(&mut self.last_impulses).impulses;
        self.last_impulses.seconds = seconds;
        let losses = self.instant.losses(1.0, |row| {
            let entry = &self.instant.entries[row];
            self.instant.problem.w(row) - rate_offset(entry, restitution, seconds)
        });
        self.run.ledger.impact += losses.impact;
        self.run.ledger.dissipated += losses.friction;
        let impulses = self.instant.problem.unknowns();
        for (entry, impulse) in self.instant.entries.iter().zip(impulses) {
            let (leg, slot) = (entry.row.leg, entry.role.slot());
            self.last_impulses.impulses[leg][slot] = *impulse;
            let activated = *impulse > 0.0 && before[leg][slot] <= 0.0;
            self.run.counts.events += u64::from(activated && !entry.role.is_tangent());
        }
        let ground = self.instant.ground();
        self.run.impulse_sums.add_ground(&ground);
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

#[cfg(test)]
mod tests;
