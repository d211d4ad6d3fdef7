//! The plant in motion: what of it is saved, and how far a step leads.

use serde::{Deserialize, Serialize};
use twinrig_contact::Unsolved;
use twinrig_legged::{Base, LEGS, Ledger, NegativeDissipation, Stored};
use twinrig_runtime::{EnergyBalance, WorkCounts};

use crate::constraints::{Constraints, GROUND, LegForces};
use crate::drives::Inputs;
use crate::midpoint::{Midpoint, NoPose, Placement};
use crate::model::{GRAVITY, Model};
use crate::state::State;

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
    #[error(
        "the end of a step of {seconds:e} s does not converge: its springs' energy is open by {energy:e} J, its feet by {metres:e} m"
    )]
    NotConverged {
        seconds: f64,
        energy: f64,
        metres: f64,
    },
    #[error("a step of {seconds:e} s is too long: a foot goes {metres:e} m deep")]
    Deep { seconds: f64, metres: f64 },
    #[error("a step of {seconds:e} s is too long: {why}")]
    Dissipation {
        seconds: f64,
        why: NegativeDissipation,
    },
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
    damped: bool,
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
    /// Whether the friction of the joints is too stiff for repetition and counts as a part of the inertia.
    pub(crate) damped: bool,
    pub(crate) ledger: Ledger,
    pub(crate) counts: WorkCounts,
    /// Where things are now.
    pub(crate) here: Placement,
    pub(crate) there: Placement,
    pub(crate) middle: Midpoint,
    pub(crate) constraints: Constraints,
}

impl Flow {
    /// Starts at a state.
    pub(crate) fn new(model: Model, state: &State, inputs: Inputs) -> Result<Self, FlowError> {
        // A hip without a drive has next to no inertia beside its friction.
        let damped = model.drives.is_none();
        let mut flow = Self {
            model,
            state: *state,
            inputs,
            forces: [LegForces::default(); LEGS],
            torques: [[0.0; 2]; LEGS],
            impulses: [[0.0; 3]; LEGS],
            owed: [0.0; LEGS],
            damped,
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
            damped,
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
            damped: *damped,
            ledger: *ledger,
            counts: *counts,
        }
    }

    /// Goes back to what was saved.
    pub(crate) fn restore(&mut self, saved: &SavedFlow) -> Result<(), NoPose> {
        self.replace(&saved.state)?;
        (self.inputs, self.forces, self.torques) = (saved.inputs, saved.forces, saved.torques);
        (self.impulses, self.owed, self.ledger) = (saved.impulses, saved.owed, saved.ledger);
        (self.damped, self.counts) = (saved.damped, saved.counts);
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

    /// Kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(&self) -> Stored {
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
    pub(crate) fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }
}

/// The ground's force on a foot along normal and tangents \[N\].
pub(crate) fn ground_force(forces: &LegForces) -> [f64; 3] {
    [forces[GROUND], forces[GROUND + 1], forces[GROUND + 2]]
}
