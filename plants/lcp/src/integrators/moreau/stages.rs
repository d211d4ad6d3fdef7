//! Stages of a step: the half step to the middle, the impulses there, and the half step to the end.
//! Each owns its results, and reads those of the stages before it.

use super::drift::{HalfStep, Momentum, Rates, advance_joints, rotated};
use super::drives::{Hip, MeanDrive, TorqueSpeedLines, drive_over, drive_torques};
use super::impulses::ImpulseSolver;
use super::inertia::{Memory, Node, compute_midpoint_inertia};
use super::momentum::{Body, Geometry, Momenta};
use super::overlaps::Shifting;
use super::solved_step::SolvedStep;
use crate::constraints::motion::Dynamics;
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::articulated::{Accelerations, Articulated};
use crate::model::chain::friction_torques;
use crate::model::constants::Constants;
use crate::model::leg_constraints::HIP;
use crate::model::load::PushForces;
use crate::model::real::{Lanes, Real};
use crate::model::rotation::rotation;
use crate::model::state::State;

/// Motion to the middle, at the momenta of the start.
pub(super) struct FirstHalf<const N: usize> {
    /// Momenta at the start: of trunk and links, and of the motors at the hips.
    momenta: Momenta<N>,
    motors: Lanes,
    /// Rates in the middle before the impulses, `u_a`, and the momenta there.
    rates: Rates<N>,
    middle_momenta: Momenta<N>,
    /// Momentum of a robot whose trunk moves, with its centre of mass in the middle.
    robot: Option<Momentum>,
    /// The state in the middle, but for position and velocity of the trunk.
    state: State<Lanes, N>,
}

impl<const N: usize> FirstHalf<N> {
    #[inline(always)]
    pub(super) fn of(
        model: &Model<N>,
        start: &Node<N>,
        before: &State<Lanes, N>,
        half: f64,
    ) -> Result<Self, StepError> {
        let legs = &model.side_by_side;
        let momenta = start.geometry.momenta(legs, &before.rates, before.turning);
        let half_step = HalfStep {
            model,
            inertia: &start.inertia,
            hip_inertia: start.hips[1],
            seconds: half,
        };
        let (rates, middle_momenta) =
            half_step.rates(&before.angles, Rates::of(before), &momenta)?;
        let mut state = *before;
        (state.rates, state.turning) = (rates.links, rates.turning);
        advance_joints(&mut state, half);
        let mut robot = None;
        if let Some(body) = &start.geometry.body {
            let mut momentum = Momentum::of(model, before, body, momenta.relative, momenta.spin);
            momentum.drift(half);
            robot = Some(momentum);
            state.attitude = rotated(before.attitude, rates.turning, half);
        }
        Ok(Self {
            momenta,
            motors: start.hips[1] * before.rates[0],
            rates,
            middle_momenta,
            robot,
            state,
        })
    }
}

/// The robot in the middle, before the impulses.
pub(super) struct Middle<const N: usize> {
    state: State<Lanes, N>,
    drive: MeanDrive,
    geometry: Geometry<N>,
    /// Momentum and mass distribution of a robot whose trunk moves.
    robot: Option<(Momentum, Body)>,
    /// Forces of pushes, if any.
    pushed: Option<PushForces<Lanes, N>>,
}

impl<const N: usize> Middle<N> {
    /// Computes the middle and its inertia, under drives with these commanded accelerations and
    /// torque–speed lines.
    #[inline(always)]
    pub(super) fn of(
        dynamics: &Dynamics<'_, Lanes, N>,
        inertia: &mut Articulated<Lanes, N>,
        first: &FirstHalf<N>,
        (commanded, lines): ([Lanes; 2], &TorqueSpeedLines),
        seconds: f64,
    ) -> Self {
        let (model, legs) = (dynamics.model, dynamics.legs);
        let mut state = first.state;
        let drive = drive_over(dynamics, &state, commanded, lines, seconds);
        let half = 0.5 * seconds;
        compute_midpoint_inertia(inertia, model, dynamics.mode, &state, &drive.drive, half);
        let geometry = Geometry::of(model, inertia);
        let robot = first.robot.zip(geometry.body);
        if let Some((momentum, body)) = &robot {
            let relative = geometry.relative(legs, &first.rates.links, first.rates.turning);
            momentum.place_trunk(&mut state, body, relative);
        }
        if let Some(base) = &mut inertia.base {
            base.rotation = rotation(state.attitude);
        }
        let pushed = dynamics.load.as_ref().map(|load| {
            let turns = [&inertia.chain.sines, &inertia.chain.cosines];
            load.forces(legs, turns, &inertia.rotation())
        });
        Self {
            state,
            drive,
            geometry,
            robot,
            pushed,
        }
    }

    /// Returns the work of the pushes over a step with these accelerations in the middle and these
    /// means of the rates before and after \[J\].
    fn work_of_pushes(
        &self,
        accelerations: &Accelerations<Lanes, N>,
        mean: [Lanes; N],
        seconds: f64,
    ) -> f64 {
        let half = 0.5 * seconds;
        self.pushed.map_or(0.0, |pushed| {
            let mut halfway = self.state;
            halfway.rates = mean;
            for i in 0..3 {
                halfway.velocity[i] += half * accelerations.trunk[i];
                halfway.turning[i] += half * accelerations.trunk[3 + i];
            }
            seconds * pushed.power(&halfway).sum()
        })
    }
}

/// The robot in the middle, after the impulses.
pub(super) struct Kicked<const N: usize> {
    /// Accelerations that change the velocities over the step, and torques on the links.
    accelerations: Accelerations<Lanes, N>,
    torques: [Lanes; N],
    /// Tension of the cables \[N\], and acceleration of their pulleys.
    tension: Lanes,
    winding: Lanes,
    /// The state in the middle with the rates after the impulses, `u_b`.
    state: State<Lanes, N>,
    /// Means of the rates before and after.
    mean: [Lanes; N],
    /// Correction of overlaps, if any.
    shifting: Option<Shifting<N>>,
}

impl<const N: usize> Kicked<N> {
    #[inline(always)]
    pub(super) fn of(
        solver: &mut ImpulseSolver<N>,
        dynamics: &Dynamics<'_, Lanes, N>,
        memory: &mut Memory<N>,
        (first, middle): (&FirstHalf<N>, &Middle<N>),
        seconds: f64,
    ) -> Result<Self, StepError> {
        let (rates, drive) = (&first.rates, &middle.drive.drive);
        let pushed = middle.pushed.as_ref();
        let kick = (&middle.geometry, rates, &first.middle_momenta, pushed);
        let inertia = &mut memory.middle;
        let (accelerations, torques) =
            solver.impulses(dynamics, inertia, &middle.state, drive, kick, seconds)?;
        let tension = solver.instant.tension(seconds);
        let h = Lanes::splat(seconds);
        let mut state = middle.state;
        for i in 0..N {
            state.rates[i] += h * accelerations.links[i];
        }
        for i in 0..3 {
            state.turning[i] += seconds * accelerations.trunk[3 + i];
        }
        let radius = dynamics.legs.pulley_radius;
        let winding = drive.pulley_acceleration - drive.pulley_mobility * radius * tension;
        state.pulley_rate += h * winding;
        let mean = std::array::from_fn(|i| Lanes::splat(0.5) * (rates.links[i] + state.rates[i]));
        let motors = (memory.start.hips[0], drive);
        let model = dynamics.model;
        let shifting = solver.correct_overlaps(model, &memory.middle, motors, &state, seconds);
        Ok(Self {
            accelerations,
            torques,
            tension,
            winding,
            state,
            mean,
            shifting,
        })
    }

    /// Moves to the end of the step, and returns the state there.
    #[inline(always)]
    pub(super) fn second_half(
        &self,
        solver: &ImpulseSolver<N>,
        dynamics: &Dynamics<'_, Lanes, N>,
        memory: &mut Memory<N>,
        (first, middle): (&FirstHalf<N>, &Middle<N>),
        seconds: f64,
    ) -> State<Lanes, N> {
        let (model, legs, half) = (dynamics.model, dynamics.legs, 0.5 * seconds);
        let mut after = self.state;
        if let Some(shifting) = &self.shifting {
            (after.rates, after.turning) = (shifting.rates.links, shifting.rates.turning);
            after.pulley += Lanes::splat(half) * shifting.pulley;
        }
        advance_joints(&mut after, half);
        memory.end.update(model, dynamics.mode, &after.angles);
        let Memory {
            end,
            middle: inertia,
            ..
        } = memory;
        let mut momenta = self.momenta(first, middle, legs, seconds);
        let mut spin = [0.0; 3];
        let mut robot = middle.robot;
        if let Some((momentum, body)) = &mut robot {
            let mut impulse = solver.instant.wrench();
            if let Some(pushed) = &middle.pushed {
                for (sum, force) in impulse.iter_mut().zip(pushed.trunk) {
                    *sum += seconds * force;
                }
            }
            let velocity_change = momentum.apply(&impulse, inertia, body, seconds);
            let [forward, _, up] = velocity_change.map(Lanes::splat);
            let chain = &inertia.chain;
            for i in 0..N {
                let along = chain.cosines[i] * forward + chain.sines[i] * up;
                momenta[i] -= legs.moments[i] * along;
            }
            momentum.drift(half);
            if let Some(shifting) = &self.shifting {
                momentum.shift(shifting.push, inertia, body, half);
            }
            after.attitude = rotated(middle.state.attitude, after.turning, half);
            spin = momentum.spin_in(after.attitude);
        }
        let rates = end.inertia.rates_of(&momenta, spin, self.state.rates[0]);
        (after.rates, after.turning) = (rates.links, rates.turning);
        if let Some((momentum, body)) = robot.map(|it| it.0).zip(end.geometry.body) {
            let relative = end.geometry.relative(legs, &after.rates, after.turning);
            momentum.place_trunk(&mut after, &body, relative);
        }
        after
    }

    /// Returns the momenta of the links after all forces but those on the robot as a whole.
    #[inline(always)]
    fn momenta(
        &self,
        first: &FirstHalf<N>,
        middle: &Middle<N>,
        legs: &Constants<Lanes, N>,
        seconds: f64,
    ) -> [Lanes; N] {
        let (h, half) = (Lanes::splat(seconds), Lanes::splat(0.5 * seconds));
        let from = &first.momenta.links;
        let change = std::array::from_fn(|i| self.state.rates[i] - first.rates.links[i]);
        let damping = friction_torques(legs, &change);
        let mut momenta: [Lanes; N] =
            std::array::from_fn(|i| from[i] + h * self.torques[i] + half * damping[i]);
        momenta[0] += first.motors - half * middle.drive.hip_damping * change[0];
        momenta
    }

    /// Returns the solution of a step that ends in this state.
    #[inline(always)]
    pub(super) fn solved(
        &self,
        dynamics: &Dynamics<'_, Lanes, N>,
        memory: &Memory<N>,
        (first, middle): (&FirstHalf<N>, &Middle<N>),
        after: State<Lanes, N>,
        seconds: f64,
    ) -> SolvedStep<N> {
        let mut solved = SolvedStep {
            after,
            mean: self.mean,
            external: middle.work_of_pushes(&self.accelerations, self.mean, seconds),
            tension: self.tension,
            torques: [Lanes::zero(); 2],
            hip_work: Lanes::zero(),
        };
        if dynamics.model.drives.is_none() {
            return solved;
        }
        // A hip at constant rate changes its momentum as its leg bends.
        let momentum = |geometry: &Geometry<N>, rates: &Rates<N>| {
            let momenta = geometry.momenta(dynamics.legs, &rates.links, rates.turning);
            momenta.links[0]
        };
        let (geometry, last) = (&middle.geometry, Rates::of(&self.state));
        let end = &memory.end.geometry;
        let hip = Hip {
            rates: [first.rates.links[0], last.links[0]],
            acceleration: self.accelerations.links[0],
            damping: middle.drive.hip_damping,
            imposed_torque: memory.middle.mobility.forces(&self.accelerations.torques)[HIP],
            momentum_change: [
                momentum(geometry, &first.rates) - first.momenta.links[0],
                momentum(end, &Rates::of(&after)) - momentum(geometry, &last),
            ],
        };
        let drive = &middle.drive.drive;
        drive_torques(dynamics, &mut solved, drive, &hip, self.winding, seconds);
        solved
    }
}
