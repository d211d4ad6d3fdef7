//! Island of the plant with its state: steps with subdivision, snapshots, stored energy.

use serde::{Deserialize, Serialize};
use twinrig_legged::{Base, ExternalLoad, LEGS, Ledger, StepLoad, Stored};
use twinrig_runtime::{EnergyBalance, WorkCounts};

use crate::constraints::{Constraints, GROUND, LegForces};
use crate::drives::Inputs;
use crate::flow_error::FlowError;
use crate::midpoint::{Midpoint, NoPose, Placement};
use crate::model::{GRAVITY, Method, Model};
use crate::state::State;

/// Maximum number of halvings of a step that fails.
const HALVINGS_MAX: u32 = 8;

/// Serialised state of a [`Flow`].
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct SavedFlow {
    state: State,
    inputs: Inputs,
    forces: [LegForces; LEGS],
    torques: [[f64; 2]; LEGS],
    impulses: [[f64; 3]; LEGS],
    energy_defect: [f64; LEGS],
    overlap: f64,
    damped: bool,
    ledger: Ledger,
    counts: WorkCounts,
}

/// Island: coordinates that interact, with all that a step needs.
#[derive(Debug, Clone)]
pub(crate) struct Flow {
    pub(crate) model: Model,
    pub(crate) state: State,
    /// Inputs of the drives of each leg.
    pub(crate) inputs: Inputs,
    /// Forces of the constraints in the last step \[N\].
    pub(crate) forces: [LegForces; LEGS],
    /// Mean torques of the drives in the last step \[N·m\].
    pub(crate) torques: [[f64; 2]; LEGS],
    /// Impulses of the ground on the feet since the start, world frame \[N·s\].
    pub(crate) impulses: [[f64; 3]; LEGS],
    /// Energy that the springs of each leg released beyond the work they did \[J\]; the next step
    /// compensates it.
    pub(crate) energy_defect: [f64; LEGS],
    /// Whether the friction of the joints is a part of the inertia, because it is too stiff for
    /// fixed-point iteration.
    pub(crate) damped: bool,
    pub(crate) ledger: Ledger,
    pub(crate) counts: WorkCounts,
    /// Load of pushes in a step of the plant, the index of the first leg in it, and the time since
    /// the begin of that step \[s\].
    load: StepLoad,
    first_leg: usize,
    pub(crate) elapsed_s: f64,
    /// Placement of the present state.
    pub(crate) placement: Placement,
    pub(crate) next_placement: Placement,
    pub(crate) middle: Midpoint,
    pub(crate) constraints: Constraints,
}

impl Flow {
    /// Creates the island in a state.
    pub(crate) fn new(model: Model, state: &State, inputs: Inputs) -> Result<Self, FlowError> {
        // Apart from its friction, a hip without a drive has almost no inertia.
        let damped = model.drives.is_none();
        let mut flow = Self {
            model,
            state: *state,
            inputs,
            forces: [LegForces::default(); LEGS],
            torques: [[0.0; 2]; LEGS],
            impulses: [[0.0; 3]; LEGS],
            energy_defect: [0.0; LEGS],
            damped,
            ledger: Ledger::default(),
            counts: WorkCounts::default(),
            load: StepLoad::default(),
            first_leg: 0,
            elapsed_s: 0.0,
            placement: Placement::new(),
            next_placement: Placement::new(),
            middle: Midpoint::new(),
            constraints: Constraints::default(),
        };
        flow.replace(state)?;
        flow.ledger = Ledger::opened(flow.stored());
        Ok(flow)
    }

    /// Replaces the present state.
    pub(crate) fn replace(&mut self, state: &State) -> Result<(), NoPose> {
        self.state = *state;
        self.placement.place(&self.model, state)
    }

    /// Inputs of the legs that are present, in the order of the ports.
    pub(crate) fn port_inputs(&self) -> impl Iterator<Item = &f64> {
        let legs = self.inputs[..self.model.legs.len()].iter();
        legs.flat_map(|leg| &leg[..self.model.inputs])
    }

    /// Mutable inputs, in the same order.
    pub(crate) fn port_inputs_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let (legs, inputs) = (self.model.legs.len(), self.model.inputs);
        let legs = self.inputs[..legs].iter_mut();
        legs.flat_map(move |leg| &mut leg[..inputs])
    }

    /// Serialisable state: everything that later steps depend on.
    pub(crate) fn save(&self) -> SavedFlow {
        let Self {
            state,
            inputs,
            forces,
            torques,
            impulses,
            energy_defect,
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
            energy_defect: *energy_defect,
            overlap: self.constraints.overlap,
            damped: *damped,
            ledger: *ledger,
            counts: *counts,
        }
    }

    /// Restores a saved state.
    pub(crate) fn restore(&mut self, saved: &SavedFlow) -> Result<(), NoPose> {
        self.replace(&saved.state)?;
        (self.inputs, self.forces, self.torques) = (saved.inputs, saved.forces, saved.torques);
        (self.impulses, self.energy_defect, self.ledger) =
            (saved.impulses, saved.energy_defect, saved.ledger);
        (self.damped, self.counts) = (saved.damped, saved.counts);
        self.load = StepLoad::default();
        self.constraints.overlap = saved.overlap;
        self.constraints.sweeps = saved.counts.solver_iterations;
        self.constraints.factorisations = saved.counts.factorisations;
        Ok(())
    }

    /// Sets the load of pushes in the next step, in which this island's first leg has an index.
    pub(crate) fn set_load(&mut self, load: &StepLoad, first_leg: usize) {
        self.load.copy_from(load);
        self.first_leg = first_leg;
    }

    /// Returns the mean load of pushes over the next `seconds`, if any.
    pub(crate) fn mean_load(&self, seconds: f64) -> Option<ExternalLoad> {
        if self.load.is_empty() {
            return None;
        }
        let mut load = self.load.mean(self.elapsed_s, self.elapsed_s + seconds);
        load.feet.rotate_left(self.first_leg);
        Some(load)
    }

    /// Advances by `seconds`, in halves if the whole step of the midpoint rule fails. The state is
    /// unchanged if these fail, too.
    pub(crate) fn run(&mut self, seconds: f64) -> Result<(), FlowError> {
        self.elapsed_s = 0.0;
        if self.model.method == Method::ExplicitEuler {
            return self.explicit_step(seconds);
        }
        let Err(error) = self.step(seconds) else {
            return Ok(());
        };
        let before = self.save();
        let halved = self.run_halves(seconds, HALVINGS_MAX, error);
        if halved.is_err() {
            self.restore(&before)
                .expect("the legs have a pose in every state that was saved");
        }
        halved
    }

    /// Advances by both halves of a step that failed with `error`, each subdivided again if it
    /// fails.
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

    /// Kinetic, spring and gravity energy \[J\]; that of overlaps counts as that of springs.
    pub(crate) fn stored(&self) -> Stored {
        let (velocity, rate) = (self.state.velocity(), self.state.rate());
        let height = self.state.position().z;
        let mut twice =
            self.model.mass * velocity.norm_squared() + rate.dot(&self.model.spin(&rate));
        // The energy of a fixed trunk is constant, and counts as zero.
        let held = self.model.base == Base::Fixed;
        let (mut springs, mut gravity) = (
            self.constraints.overlap,
            if held { 0.0 } else { self.model.mass * height },
        );
        for (i, leg) in self.model.legs.iter().enumerate() {
            let foot = leg.foot_in_trunk(self.state.foot(i));
            let foot_velocity = self.state.foot_velocity(i);
            let sideways = velocity.y + rate.z * foot.x - rate.x * foot.z;
            let (hip, pulley) = (self.state.hip_rate(i), self.state.pulley_rate(i));
            let [at_hip, at_pulley] = self.model.drive_inertias(i);
            twice += leg.mass * (foot_velocity.norm_squared() + sideways * sideways)
                + at_hip * hip * hip
                + at_pulley * pulley * pulley;
            springs += self.placement.springs[i];
            gravity += leg.mass * (height + (self.placement.rotation * foot).z);
        }
        [0.5 * twice, springs, gravity * GRAVITY]
    }

    /// Energy balance.
    pub(crate) fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }
}

/// Force of the ground on a foot along normal and tangents \[N\].
pub(crate) fn ground_force(forces: &LegForces) -> [f64; 3] {
    [forces[GROUND], forces[GROUND + 1], forces[GROUND + 2]]
}
