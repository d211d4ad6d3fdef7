//! One step in time.

use serde::{Deserialize, Serialize};
use twinrig_contact::Unsolved;
use twinrig_legged::{Base, LEGS, Ledger, Stored};
use twinrig_runtime::{EnergyBooks, WorkCounts};

use crate::constraints::{Constraints, GROUND, LegForces};
use crate::drives::{DriveStep, Inputs};
use crate::midpoint::{Midpoint, NoPose, Placement, carried};
use crate::mobility::{Mobility, Motion};
use crate::model::{GRAVITY, Model};
use crate::state::State;

/// Estimates of a step's end, at most. Each is (ωh/2)² times nearer than the one before: a hundredth, where the stiffest
/// mode of the leg meets a step of 2 ms.
const ESTIMATES_MAX: u32 = 12;

/// What a step's springs may lose or gain unaccounted for, as a share of the robot's weight times its leg's length:
/// 2e-8 J for Cheetah-cub, which exchanges 0.03 J in a millisecond of trot. The next step makes up for it, so that it does
/// not add up.
const UNACCOUNTED: f64 = 1e-8;

/// Times [`UNACCOUNTED`] that a step may leave open after its last estimate; a shorter one is tried where it leaves more.
const OPEN_MAX: f64 = 1e3;

/// Halvings of a step that leads out of a leg's reach, at most.
const HALVINGS_MAX: u32 = 8;

/// Why time cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum FlowError {
    #[error(transparent)]
    NoPose(#[from] NoPose),
    #[error(transparent)]
    Unsolved(#[from] Unsolved),
    #[error("the state is not a number")]
    NotFinite,
    #[error("a step of {seconds:e} s does not come to rest: {energy:e} J stay open")]
    NotConverged { seconds: f64, energy: f64 },
}

/// A [`Flow`] at rest, so to say.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct SavedFlow {
    state: State,
    inputs: Inputs,
    forces: [LegForces; LEGS],
    torques: [[f64; 2]; LEGS],
    impulses: [[f64; 3]; LEGS],
    owed: [f64; LEGS],
    ledger: Ledger,
    counts: WorkCounts,
}

/// The plant in motion.
#[derive(Debug, Clone)]
pub(crate) struct Flow {
    pub(crate) model: Model,
    pub(crate) state: State,
    /// What the drives of each leg are given.
    pub(crate) inputs: Inputs,
    /// Forces of the constraints in the last step.
    pub(crate) forces: [LegForces; LEGS],
    /// Mean torques of the drives in the last step.
    pub(crate) torques: [[f64; 2]; LEGS],
    /// Impulses of the ground on the feet since the start, world frame.
    pub(crate) impulses: [[f64; 3]; LEGS],
    /// What the springs of each leg have lost beyond the work they did \[J\]; the next step makes up for it.
    pub(crate) owed: [f64; LEGS],
    pub(crate) ledger: Ledger,
    pub(crate) counts: WorkCounts,
    /// Where things are now.
    pub(crate) here: Placement,
    there: Placement,
    middle: Midpoint,
    constraints: Constraints,
}

impl Flow {
    /// Starts at a state.
    pub(crate) fn new(model: Model, state: &State, inputs: Inputs) -> Result<Self, FlowError> {
        let mut flow = Self {
            model,
            state: *state,
            inputs,
            forces: [LegForces::default(); LEGS],
            torques: [[0.0; 2]; LEGS],
            impulses: [[0.0; 3]; LEGS],
            owed: [0.0; LEGS],
            ledger: Ledger::default(),
            counts: WorkCounts::default(),
            here: Placement::new(),
            there: Placement::new(),
            middle: Midpoint::new(),
            constraints: Constraints::default(),
        };
        flow.replace(state)?;
        flow.ledger = Ledger::opened(flow.stored());
        Ok(flow)
    }

    /// Puts another state in place of the present one.
    pub(crate) fn replace(&mut self, state: &State) -> Result<(), NoPose> {
        self.state = *state;
        self.here.place(&self.model, state)
    }

    /// What the drives of the legs that are there are given, in the order of the ports.
    pub(crate) fn given(&self) -> impl Iterator<Item = &f64> {
        let legs = self.inputs[..self.model.legs.len()].iter();
        legs.flat_map(|leg| &leg[..self.model.inputs])
    }

    /// The same, to be given anew.
    pub(crate) fn given_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let (legs, inputs) = (self.model.legs.len(), self.model.inputs);
        let legs = self.inputs[..legs].iter_mut();
        legs.flat_map(move |leg| &mut leg[..inputs])
    }

    /// Everything the way ahead depends on.
    pub(crate) fn save(&self) -> SavedFlow {
        let Self {
            state,
            inputs,
            forces,
            torques,
            impulses,
            owed,
            ledger,
            counts,
            ..
        } = self;
        SavedFlow {
            state: *state,
            inputs: *inputs,
            forces: *forces,
            torques: *torques,
            impulses: *impulses,
            owed: *owed,
            ledger: *ledger,
            counts: *counts,
        }
    }

    /// Goes back to what was saved.
    pub(crate) fn restore(&mut self, saved: &SavedFlow) -> Result<(), NoPose> {
        self.replace(&saved.state)?;
        (self.inputs, self.forces, self.torques) = (saved.inputs, saved.forces, saved.torques);
        (self.impulses, self.owed, self.ledger) = (saved.impulses, saved.owed, saved.ledger);
        self.counts = saved.counts;
        self.constraints.sweeps = saved.counts.solver_iterations;
        self.constraints.factorisations = saved.counts.factorisations;
        Ok(())
    }

    /// Moves on by `seconds`, in halves where a whole step leads out of a leg's reach. Where even those fail, everything
    /// stays as it was.
    pub(crate) fn run(&mut self, seconds: f64) -> Result<(), FlowError> {
        let Err(error) = self.step(seconds) else {
            return Ok(());
        };
        let before = self.save();
        let halved = self.run_halves(seconds, HALVINGS_MAX, error);
        if halved.is_err() {
            self.restore(&before)
                .expect("the plant has just been there, so its legs have that pose");
        }
        halved
    }

    /// Both halves of a step that failed with `error`, each in halves again where it fails, too.
    fn run_halves(
        &mut self,
        seconds: f64,
        halvings: u32,
        error: FlowError,
    ) -> Result<(), FlowError> {
        if halvings == 0 {
            return Err(error);
        }
        self.counts.fallbacks += 1;
        for _ in 0..2 {
            if let Err(error) = self.step(0.5 * seconds) {
                self.run_halves(0.5 * seconds, halvings - 1, error)?;
            }
        }
        Ok(())
    }

    /// A step of the midpoint rule: energy-conserving springs, constraints at velocity level, friction by the velocity at
    /// the end.
    fn step(&mut self, seconds: f64) -> Result<(), FlowError> {
        let before = self.state;
        let mut after = before;
        let mut drives = DriveStep::new(&self.model, &before, &self.inputs, seconds);
        let (mut owed, mut open) = (self.owed, 0.0);
        let mut mobility = Mobility::new(&self.model, &[]);
        for estimate in 0..ESTIMATES_MAX {
            self.counts.evaluations += 1;
            self.middle.place(&self.model, &before, &after, seconds)?;
            if estimate == 0 {
                mobility = Mobility::new(&self.model, &self.middle.legs);
            } else {
                let lost = std::array::from_fn(|i| {
                    self.here.springs[i] - self.there.springs[i] + self.owed[i]
                });
                self.middle.conserve(&self.model, &before, &after, &lost);
            }
            let motion =
                self.constrained_motion(&mut drives, &mut mobility, estimate == 0, seconds)?;
            after = before;
            motion.apply(&mut after, seconds, self.model.legs.len());
            let mut mean = self.middle.state;
            mean.take_mean_velocities(&before, &after, self.model.legs.len());
            let moved = carried(&self.model, &before, &mean, seconds);
            after.take_positions(&moved, self.model.legs.len());
            self.there.place(&self.model, &after)?;
            owed = self.unpaid(&before, &after);
            let most = owed
                .iter()
                .fold(0.0_f64, |most, energy| most.max(energy.abs()));
            open = most / (self.model.energy_scale * UNACCOUNTED);
            if estimate > 0 && open < 1.0 {
                break;
            }
        }
        if open > OPEN_MAX {
            let energy = open * self.model.energy_scale * UNACCOUNTED;
            return Err(FlowError::NotConverged { seconds, energy });
        }
        (self.owed, self.torques) = (owed, drives.torques);
        self.finish(&after, seconds)
    }

    /// The step's accelerations, with the impulses of the constraints and the torque limits of the drives in them. The first
    /// estimate finds the constraints; the later ones only solve for them again.
    fn constrained_motion(
        &mut self,
        drives: &mut DriveStep,
        mobility: &mut Mobility,
        first: bool,
        seconds: f64,
    ) -> Result<Motion, FlowError> {
        /// A drive that changes its mind more often is on the border of its torque; either answer is right there.
        const CHANGES_MAX: usize = 6;
        /// Tolerances of the impulses, relative to the greatest speed and in m/s: a tenth of a nanometre a step. The first
        /// estimate is on the way to another.
        const TOLERANCES: [[f64; 2]; 2] = [[1e-6, 1e-7], [1e-3, 1e-5]];
        let free = self.middle.free_motion(&self.model, mobility);
        let mut fresh = first;
        for change in 0.. {
            let mut motion = free;
            drives.impose(&self.model, &self.middle, mobility, &mut motion);
            if first && change == 0 {
                let Self {
                    model,
                    state,
                    here,
                    middle,
                    constraints,
                    ..
                } = self;
                constraints.find(model, state, here, middle, &motion, seconds);
            }
            if fresh {
                self.constraints
                    .prepare(&self.model, mobility, &self.forces, seconds);
            }
            let tolerance = TOLERANCES[usize::from(first)];
            let solved =
                self.constraints
                    .solve(&self.model, mobility, &mut motion, seconds, tolerance);
            (self.counts.solver_iterations, self.counts.factorisations) =
                (self.constraints.sweeps, self.constraints.factorisations);
            solved?;
            fresh = drives.exhausted(&self.model, &self.middle, &self.constraints, &motion);
            if !fresh || change == CHANGES_MAX {
                return Ok(motion);
            }
        }
        unreachable!("the loop returns")
    }

    /// What the springs of each leg will have lost beyond the work they did \[J\].
    fn unpaid(&self, before: &State, after: &State) -> [f64; LEGS] {
        let mut owed = [0.0; LEGS];
        for (i, leg) in self.middle.legs.iter().enumerate() {
            let work = -leg.spring.foot.dot(&(after.foot(i) - before.foot(i)))
                - leg.spring.hip * (after.hip(i) - before.hip(i));
            owed[i] = self.owed[i] + self.here.springs[i] - self.there.springs[i] - work;
        }
        owed
    }

    /// Takes the step's end as the present and writes up what has flowed.
    fn finish(&mut self, after: &State, seconds: f64) -> Result<(), FlowError> {
        if !after.is_finite() {
            return Err(FlowError::NotFinite);
        }
        let before = self.state;
        let (impact, sliding) = self.constraints.losses(after);
        self.ledger.impact += impact;
        self.ledger.dissipated += sliding;
        self.counts.events += self.constraints.met(&self.forces);
        self.forces = self.constraints.forces(seconds);
        for (i, leg) in self.middle.legs.iter().enumerate() {
            self.ledger.dissipated -= leg.friction.foot.dot(&(after.foot(i) - before.foot(i)))
                + leg.friction.hip * (after.hip(i) - before.hip(i));
            let turned = [
                after.hip(i) - before.hip(i),
                after.pulley(i) - before.pulley(i),
            ];
            self.ledger.actuator += self.torques[i][0] * turned[0] + self.torques[i][1] * turned[1];
            let surface = &self.here.surfaces[i];
            let [along, across] = surface.tangents();
            let [normal, first, second] = ground_force(&self.forces[i]);
            let impulse = (surface.normal * normal + along * first + across * second) * seconds;
            for (sum, part) in self.impulses[i].iter_mut().zip(impulse.iter()) {
                *sum += part;
            }
        }
        self.state = *after;
        std::mem::swap(&mut self.here, &mut self.there);
        self.counts.steps += 1;
        self.ledger.balance(self.stored());
        Ok(())
    }

    /// Kinetic, spring and gravity energy \[J\].
    fn stored(&self) -> Stored {
        let (velocity, rate) = (self.state.velocity(), self.state.rate());
        let height = self.state.position().z;
        let mut twice = self.model.mass * velocity.norm_squared()
            + rate.dot(&rate.component_mul(&self.model.inertia));
        // A trunk that is held has no energy to speak of.
        let held = self.model.base == Base::Fixed;
        let (mut springs, mut gravity) = (0.0, if held { 0.0 } else { self.model.mass * height });
        for (i, leg) in self.model.legs.iter().enumerate() {
            let foot = leg.foot_in_trunk(self.state.foot(i));
            let own = self.state.foot_velocity(i);
            let sideways = velocity.y + rate.z * foot.x - rate.x * foot.z;
            let (hip, pulley) = (self.state.hip_rate(i), self.state.pulley_rate(i));
            let [at_hip, at_pulley] = self.model.turning(i);
            twice += leg.mass * (own.norm_squared() + sideways * sideways)
                + at_hip * hip * hip
                + at_pulley * pulley * pulley;
            springs += self.here.springs[i];
            gravity += leg.mass * (height + (self.here.rotation * foot).z);
        }
        [0.5 * twice, springs, gravity * GRAVITY]
    }

    /// Where the energy is and where it went.
    pub(crate) fn energy(&self) -> EnergyBooks {
        self.ledger.books()
    }
}

/// The ground's force on a foot along normal and tangents \[N\].
pub(crate) fn ground_force(forces: &LegForces) -> [f64; 3] {
    [forces[GROUND], forces[GROUND + 1], forces[GROUND + 2]]
}
