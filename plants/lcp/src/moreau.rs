//! Moreau's midpoint rule: constraints as impulses over a step, no matter when in it they act.
//!
//! ```text
//! q̄ = q ⊕ ½h u_a                                               q⁺ = q̄ ⊕ ½h u_b
//! (H(q̄) + ½h D)(u_b − u_a) = h (f(q̄, u_a) + ½(g(u_a) + g(u_b))) + Jᵀ P
//! 0 ≤ P ⊥ J u_b + γ g/h ≥ 0      D: friction of the joints, damping of the motors
//! ```
//!
//! In the half steps momenta stay as they are ([`drift`]), in the middle forces and impulses change
//! them ([`kick`]). Without impulses this is the generalised leapfrog: of second order, symplectic,
//! the same backwards in time. Momentum is balanced to round-off; energy swings by an error of
//! second order and does not drift. J, P and the gaps g are those at q̄.
//!
//! No event is looked for, so a step costs the same whatever happens in it, and is of first order
//! where something opens or closes.

mod drift;
mod drives;
mod kick;
mod momentum;

use twinrig_contact::Method;
use twinrig_legged::Fitted;

use crate::articulated::{Accelerations, Articulated, rotation};
use crate::chain::rubbed;
use crate::constraints::{ConstraintSet, Driven, HIP};
use crate::events::{Entry, Feet, PLACES, Role, Stop};
use crate::flow::{Flow, FlowError};
use crate::motion::Scene;
use crate::motors::Effort;
use crate::real::{Lanes, Real};
use crate::state::State;

use drift::{Ahead, Momentum, Rates, bend, turned};
use drives::{Demand, Lines};
use kick::Kick;
use momentum::{Geometry, Momenta};

/// Share γ of a gap that a step takes away, or of an overlap that it gives back, where a constraint
/// holds: as large as leaves an overlap decaying without a swing, since positions move by the mean
/// of the velocities at both ends.
const RECOVERY: f64 = 1.0 / 3.0;

/// Approach below which an impact gives nothing back, and the speed at which overlaps are \[m/s\].
const RESTING: f64 = 0.05;

/// Gaps that come nearer than this count as closing \[m\].
const TOUCHING: f64 = 1e-6;

/// Gaps farther from closing than this after a step are not looked at \[m\].
const REACH: f64 = 2e-3;

/// Tolerances of the impulses, relative to the greatest speed and in m/s.
const TOLERANCE: [f64; 2] = [1e-6, 1e-7];

/// Violation that is accepted where no method comes nearer \[m/s\]: over a step of a millisecond a
/// hundredth of a micrometre, which the next step gives back.
const ENOUGH: f64 = 1e-5;

/// A motor that changes its mind more often is on the border of its torque; either answer is right
/// there.
const CHANGES_MAX: u32 = 4;

/// Halvings of a step whose impulses are not to be found, at most.
const HALVINGS_MAX: u32 = 8;

/// Impulses of a step, from which the next one begins to look for its own.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pushed {
    /// By leg and place \[N·s, N·m·s\].
    pub(crate) impulses: [[f64; PLACES]; 4],
    /// Length of that step \[s\].
    pub(crate) seconds: f64,
}

impl Pushed {
    /// Mean force of that step at one place.
    fn force(&self, leg: usize, place: usize) -> f64 {
        let impulse = self.impulses[leg][place];
        // Nothing was pushed before the first step, which had no length.
        if impulse == 0.0 {
            return 0.0;
        }
        impulse / self.seconds
    }

    /// Forces to expect in a step of length `seconds`: those of that step, but never with more of an
    /// impulse. An impact in a short step is no force that goes on in a long one.
    fn forces_over(&self, seconds: f64) -> [[f64; PLACES]; 4] {
        let longer = self.seconds.max(seconds);
        self.impulses
            .map(|places| places.map(|impulse| impulse / longer))
    }
}

/// The robot's inertia at an end of a step.
#[derive(Debug, Clone)]
struct Node<const N: usize> {
    angles: [Lanes; N],
    /// Which hips follow their commands, and the inertia of the motors at the others.
    hips: [Lanes; 2],
    inertia: Articulated<Lanes, N>,
    geometry: Geometry<N>,
    /// Whether it has been found at all.
    known: bool,
}

/// The memory of a step: what is large, and passed on rather than copied.
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

/// A step as it is solved.
struct Solved<const N: usize> {
    after: State<Lanes, N>,
    /// Means of the rates before and after the impulses.
    mean: [Lanes; N],
    /// Tension of the cables and torques of the motors, mean over the step, and the work of the
    /// hips' \[J\].
    tension: Lanes,
    torques: [Lanes; 2],
    hip_work: Lanes,
}

/// The hips over a step.
struct Hip {
    /// Rates before and after the forces of the middle.
    rates: [Lanes; 2],
    acceleration: Lanes,
    /// Damping of motors that impose no acceleration \[N·m·s/rad\].
    damping: Lanes,
    /// Torque that imposes the acceleration of the others \[N·m\].
    held: Lanes,
    /// Changes of momentum in the half steps before and after, as legs bend \[kg·m²/s\].
    bent: [Lanes; 2],
}

impl<const N: usize> Flow<N> {
    /// Moves on by `seconds`, in halves where the impulses of a whole step are not to be found.
    pub(crate) fn run_moreau(&mut self, seconds: f64) -> Result<(), FlowError> {
        self.moreau_halved(seconds, HALVINGS_MAX)
    }

    fn moreau_halved(&mut self, seconds: f64, halvings: u32) -> Result<(), FlowError> {
        let mut memory = self.midpoint.take().unwrap_or_default();
        let done = self.moreau_step(seconds, &mut memory);
        self.midpoint = Some(memory);
        match done {
            Err(FlowError::Unsolved(_) | FlowError::Unsettled { .. }) if halvings > 0 => {
                self.counts.fallbacks += 1;
                self.moreau_halved(0.5 * seconds, halvings - 1)?;
                self.moreau_halved(0.5 * seconds, halvings - 1)
            }
            done => done,
        }
    }

    fn moreau_step(&mut self, seconds: f64, memory: &mut Memory<N>) -> Result<(), FlowError> {
        let before = self.state;
        let wanted = self.wanted_over(&before, seconds);
        let mut lines = self.lines([before.rates[0], before.pulley_rate]);
        for change in 0.. {
            let solved = self.solve_step(memory, &before, wanted, &lines, seconds)?;
            let (half, per) = (Lanes::splat(0.5), Lanes::splat(1.0 / seconds));
            let after = &solved.after;
            let effort = Effort {
                torques: solved.torques,
                given: [
                    (after.rates[0] - before.rates[0]) * per,
                    (after.pulley_rate - before.pulley_rate) * per,
                ],
                wanted,
                rates: [
                    solved.mean[0],
                    half * (before.pulley_rate + after.pulley_rate),
                ],
            };
            let saturated = self.saturate(&effort);
            let now = self.lines(effort.rates);
            if change == CHANGES_MAX || !saturated && now == lines {
                self.finish(&before, &solved, memory, seconds);
                break;
            }
            lines = now;
        }
        self.finite()
    }

    /// The inertia with links at these angles, motors as they are.
    fn renew(&self, node: &mut Node<N>, angles: &[Lanes; N]) {
        let mut drive = Driven::none();
        // What hips that follow their commands impose is for one radian a second.
        drive.hip_acceleration = Lanes::splat(1.0);
        if let Some(drives) = &self.model.drives {
            let saturated = self.mode.commands.hip_saturated;
            drive.hip_inertia = saturated * saturated * Lanes::splat(drives.inertias()[0]);
        }
        let mode = self.mode.clone_without_stops();
        let hips = [mode.active.hip, drive.hip_inertia];
        if node.known && node.angles == *angles && node.hips == hips {
            return;
        }
        let mut mode = mode;
        mode.recount();
        let constraint_set = ConstraintSet {
            active: &mode.active,
            drive: &drive,
            recovery: Lanes::zero(),
            ahead: 0.0,
            any: mode.any,
        };
        let still = [Lanes::zero(); N];
        let inertia = &mut node.inertia;
        inertia.unload(
            &self.model,
            &self.model.side_by_side,
            [angles, &still],
            &constraint_set,
        );
        node.geometry = Geometry::of(&self.model, inertia);
        (node.angles, node.hips, node.known) = (*angles, hips, true);
    }

    /// The end of a step from here under these drives.
    #[expect(
        clippy::too_many_lines,
        reason = "the stages of one step, in the order of the equations"
    )]
    fn solve_step(
        &mut self,
        memory: &mut Memory<N>,
        before: &State<Lanes, N>,
        wanted: [Lanes; 2],
        lines: &Lines,
        seconds: f64,
    ) -> Result<Solved<N>, FlowError> {
        self.counts.evaluations += 1;
        let half = 0.5 * seconds;
        self.renew(&mut memory.start, &before.angles);
        let (start, legs) = (&memory.start.geometry, &self.model.side_by_side);
        let from = start.momenta(legs, &before.rates, before.turning);
        let hip_inertia = memory.start.hips[1];
        let ahead = Ahead {
            model: &self.model,
            inertia: &memory.start.inertia,
            hip_inertia,
            seconds: half,
        };
        let begun = Rates {
            links: before.rates,
            turning: before.turning,
        };
        let (rates, here) = ahead.rates(&before.angles, begun, &from)?;
        let mut middle = *before;
        (middle.rates, middle.turning) = (rates.links, rates.turning);
        bend(&mut middle, half);

        let scene = Scene::new(&self.model, legs, &self.mode, 0.0);
        let Demand { drive, hip_damping } =
            self.drive_over(&scene, &middle, wanted, lines, seconds);
        self.unload_middle(&mut memory.middle, &middle, &drive, half);
        let geometry = Geometry::of(&self.model, &memory.middle);
        let mut momentum = None;
        if let Some((base, (body, there))) = memory
            .middle
            .base
            .as_mut()
            .zip(start.body.zip(geometry.body))
        {
            let mut own = Momentum::of(&self.model, before, &body, from.relative, from.spin);
            own.drift(half);
            middle.attitude = turned(before.attitude, rates.turning, half);
            let relative = geometry.relative(legs, &rates.links, rates.turning);
            own.carry(&mut middle, &there, relative);
            base.rotation = rotation(middle.attitude);
            momentum = Some((own, there));
        }
        let kick = (&geometry, &rates, &here);
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
        // Momenta of the links, by all that acts on them.
        let change = std::array::from_fn(|i| last.links[i] - rates.links[i]);
        let rubbed = rubbed(legs, &change);
        let mut momenta: [Lanes; N] = std::array::from_fn(|i| {
            from.links[i] + h * torques[i] + Lanes::splat(half) * rubbed[i]
        });
        momenta[0] += hip_inertia * before.rates[0] - Lanes::splat(half) * hip_damping * change[0];

        bend(&mut after, half);
        self.renew(&mut memory.end, &after.angles);
        let (end, legs) = (&memory.end.geometry, &self.model.side_by_side);
        let mut spin = [0.0; 3];
        if let Some(((own, body), there)) = momentum.as_mut().zip(end.body) {
            let pushed = own.push(&self.instant.wrench(), &memory.middle, body, seconds);
            let [forward, _, up] = pushed.map(Lanes::splat);
            let chain = &memory.middle.chain;
            for i in 0..N {
                let along = chain.cosines[i] * forward + chain.sines[i] * up;
                momenta[i] -= legs.moments[i] * along;
            }
            own.drift(half);
            after.attitude = turned(middle.attitude, last.turning, half);
            spin = own.spin_in(after.attitude);
            *body = there;
        }
        let rates_after = memory.end.inertia.rates_of(&momenta, spin, last.links[0]);
        (after.rates, after.turning) = (rates_after.links, rates_after.turning);
        if let Some((own, body)) = momentum {
            let relative = end.relative(legs, &after.rates, after.turning);
            own.carry(&mut after, &body, relative);
        }
        let mut solved = Solved {
            after,
            mean,
            tension,
            torques: [Lanes::zero(); 2],
            hip_work: Lanes::zero(),
        };
        // A hip that turns evenly changes its momentum where its leg bends.
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
                held: memory.middle.give.forces(&accelerations.torques)[HIP],
                bent: [
                    at(&geometry, &rates) - from.links[0],
                    at(end, &ends) - at(&geometry, &last),
                ],
            };
            self.drive_torques(&mut solved, &drive, &hip, winding, seconds);
        }
        Ok(solved)
    }

    /// The inertia in the middle of a step, with the drives in what holds.
    fn unload_middle(
        &self,
        articulated: &mut Articulated<Lanes, N>,
        middle: &State<Lanes, N>,
        drive: &Driven<Lanes>,
        half: f64,
    ) {
        let mut mode = self.mode.clone_without_stops();
        mode.recount();
        let constraint_set = ConstraintSet {
            active: &mode.active,
            drive,
            recovery: Lanes::zero(),
            ahead: half,
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

    /// The torques of the motors, mean over a step, and the work of the hips'.
    fn drive_torques(
        &self,
        solved: &mut Solved<N>,
        drive: &Driven<Lanes>,
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
        if let Fitted::Servos(_) = drives {
            let saturated = self.mode.commands.hip_saturated;
            let follows = Lanes::splat(1.0) - saturated * saturated;
            let kick = h * (inertia[0] * hip.acceleration + hip.held);
            let ([behind, beyond], [first, last]) = (hip.bent, hip.rates);
            torque += follows * (behind + kick + beyond) / h;
            solved.hip_work += follows * (behind * first + kick * solved.mean[0] + beyond * last);
        }
        let radius = self.model.side_by_side.pulley_radius;
        solved.torques = [torque, inertia[1] * winding + radius * solved.tension];
    }

    /// Finds the impulses; returns the accelerations with them, and the torques on the links.
    fn impulses(
        &mut self,
        articulated: &mut Articulated<Lanes, N>,
        middle: &State<Lanes, N>,
        drive: &Driven<Lanes>,
        (geometry, rates, before): (&Geometry<N>, &Rates<N>, &Momenta<N>),
        seconds: f64,
    ) -> Result<(Accelerations<Lanes, N>, [Lanes; N]), FlowError> {
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
        instant.find(&scene, middle, articulated, drive, legs, Feet::Held, &near);
        let kick = Kick {
            model,
            geometry,
            hip_torque: drive.hip_torque,
            rates,
            before,
            seconds,
        };
        kick.load(articulated, &instant.load(&pushed.forces_over(seconds)))?;
        let accelerations = articulated.accelerations();
        free_rates.clear();
        let mut kept = false;
        instant.entries.retain(|entry| {
            let free = entry.rate + seconds * pushed_by(entry, &accelerations);
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
            let last = pushed.force(entry.row.leg, entry.role.place());
            instant.problem.guess(i, last * seconds);
        }
        instant.solve(ENOUGH, Method::Newton, |problem, method| match method {
            Method::Newton => problem.solve_within(TOLERANCE[0], TOLERANCE[1]),
            _ => problem.solve_by(method),
        })?;
        instant.problem.keep_within_bounds();
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
        Ok((articulated.with_trunk(trunk, &torques), torques))
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

    /// Takes the step's end as the present and enters its work in the energy balance.
    fn finish(
        &mut self,
        before: &State<Lanes, N>,
        solved: &Solved<N>,
        memory: &mut Memory<N>,
        seconds: f64,
    ) {
        let (h, half) = (Lanes::splat(seconds), Lanes::splat(0.5 * seconds));
        let after = solved.after;
        let [hip, knee] = solved.torques;
        self.impulse_sums.hip += h * hip;
        self.impulse_sums.knee += h * knee;
        self.impulse_sums.cable += h * solved.tension;
        let wound = half * (before.pulley_rate + after.pulley_rate);
        self.ledger.actuator += (solved.hip_work + knee * wound).sum();
        let torques = rubbed(&self.model.side_by_side, &solved.mean);
        for i in 0..N {
            self.ledger.dissipated -= (h * torques[i] * solved.mean[i]).sum();
        }
        self.take_toll(seconds);
        let end = &mut memory.end.inertia;
        end.chain.rates = after.rates;
        if let Some(base) = &mut end.base {
            base.rotation = rotation(after.attitude);
        }
        let stored = end.stored(&self.model, &self.model.side_by_side, &after);
        self.ledger.close_step(stored);
        core::mem::swap(&mut memory.start, &mut memory.end);
        self.state = after;
        self.counts.steps += 1;
    }

    /// Enters the work of the impulses in the energy balance, and the ground's impulses in the
    /// sums.
    fn take_toll(&mut self, seconds: f64) {
        let restitution = self
            .model
            .ground
            .as_ref()
            .map_or(0.0, |ground| ground.restitution);
        let before = core::mem::take(&mut self.pushed).impulses;
        self.pushed.seconds = seconds;
        let losses = self.instant.losses(1.0, |row| {
            let entry = &self.instant.entries[row];
            self.instant.problem.w(row) - allowed(entry, restitution, seconds)
        });
        self.ledger.impact += losses.impact;
        self.ledger.dissipated += losses.friction;
        let impulses = self.instant.problem.unknowns();
        for (entry, impulse) in self.instant.entries.iter().zip(impulses) {
            let (leg, place) = (entry.row.leg, entry.role.place());
            self.pushed.impulses[leg][place] = *impulse;
            let met = *impulse > 0.0 && before[leg][place] <= 0.0;
            self.counts.events += u64::from(met && !entry.role.is_tangent());
        }
        let ground = self.instant.ground();
        self.impulse_sums.push(&ground);
    }
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

/// What a gap's rate at the end of the step may fall short of zero by, for the gap there is or the
/// rebound there shall be.
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

#[cfg(test)]
#[path = "moreau_tests.rs"]
mod tests;
