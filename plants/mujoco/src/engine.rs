//! The engine: a MuJoCo model and its state, with checked steps.

use mujoco_rs::error::MjEditError;
use mujoco_rs::prelude::{MjData, MjModel, MjtDisableBit, MjtIntegrator, MjtState};
use mujoco_rs::wrappers::mj_editing::MjSpec;

pub use self::error::{EngineError, EngineFault, EngineWarning};
use self::refusal::{in_one_line, refused};
use crate::stages::Stages;

mod divergence;
mod error;
pub(crate) mod refusal;

/// The state that determines further motion: positions, velocities, activations, warm start,
/// controls, applied forces.
const STATE: u32 = MjtState::mjSTATE_INTEGRATION as u32;

/// Stages of the fourth-order Runge–Kutta method, with nodes and weights.
pub(crate) const STAGES: usize = 4;
const NODES: [f64; STAGES] = [0.0, 0.5, 0.5, 1.0];
const WEIGHTS: [f64; STAGES] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// A model and its state.
///
/// A step is [`forward`](Self::forward), which computes accelerations and constraint forces, and
/// then [`integrate`](Self::integrate). Between the two, forces may be read and the step may be
/// abandoned: the state is unchanged. Both together equal MuJoCo's own step bit for bit, except
/// that a condition at which MuJoCo writes a warning to standard error and a file and resets the
/// model is an [`EngineFault`] here, with the state unchanged.
pub struct Engine {
    data: MjData<Box<MjModel>>,
    /// Copy of the model whose parameters are set while the other one is in use; then the two are
    /// swapped.
    spare: Option<Box<MjModel>>,
    previous: Vec<f64>,
    stages: Stages,
    warnings: [i32; EngineWarning::ALL.len()],
    steps: u64,
    forwards: u64,
    iterations: u64,
}

impl Engine {
    /// Required version of the library.
    pub const VERSION: &'static str = "3.17.0";

    /// Compiles a model from a single text without other files.
    ///
    /// # Errors
    /// [`EngineError`] with MuJoCo's message.
    pub fn compile(mjcf: &str) -> Result<Self, EngineError> {
        Self::check_version()?;
        let model = MjModel::from_xml_string(mjcf);
        let parse = || {
            // A text with a NUL is not a C string.
            let c_string = Some(mjcf).filter(|text| !text.contains('\0'));
            MjSpec::from_xml_string(c_string.ok_or(MjEditError::UnsupportedOperation)?)
        };
        Self::of_model(model.map_err(|why| refused(&why, parse))?)
    }

    /// Builds an engine from a compiled model, for models with other files. Call
    /// [`Engine::check_version`] first.
    ///
    /// # Errors
    /// [`EngineError`] if MuJoCo cannot create its state.
    pub fn of_model(model: MjModel) -> Result<Self, EngineError> {
        let mut spare = Box::new(model.clone());
        let data = MjData::try_new(Box::new(model));
        let mut data = data.map_err(|why| EngineError::Model(in_one_line(&why.to_string())))?;
        if data.model_opt().integrator == MjtIntegrator::mjINT_DISCRETE as i32 {
            // The equations of this integrator contain the damping; `euler` then only advances by
            // their result.
            data.model_opt_mut().disableflags |= MjtDisableBit::mjDSBL_EULERDAMP as i32;
        }
        spare.opt_mut().disableflags = data.model_opt().disableflags;
        let previous = vec![0.0; data.model().state_size(STATE)];
        let stages = Stages::new(data.qpos().len(), data.qvel().len());
        let mut engine = Self {
            data,
            spare: Some(spare),
            previous,
            stages,
            warnings: [0; EngineWarning::ALL.len()],
            steps: 0,
            forwards: 0,
            iterations: 0,
        };
        engine.warnings = engine.warning_counts();
        Ok(engine)
    }

    /// Checks the version of the library; with another one than [`Engine::VERSION`] behaviour is
    /// undefined.
    ///
    /// # Errors
    /// [`EngineError::Version`].
    pub fn check_version() -> Result<(), EngineError> {
        let found = mujoco_rs::mujoco_version();
        if found == Self::VERSION {
            return Ok(());
        }
        Err(EngineError::Version {
            wanted: Self::VERSION,
            found: found.to_owned(),
        })
    }

    /// Computes accelerations and forces of the present state under its controls.
    ///
    /// # Errors
    /// [`EngineFault`].
    pub fn forward(&mut self) -> Result<(), EngineFault> {
        // MuJoCo would reset the control and write a warning to standard error.
        if let Some(i) = divergence::first_index(self.data.ctrl()) {
            let of = divergence::actuator_name(self.model(), i);
            let what = "control";
            return Err(EngineFault::Diverged { what, of });
        }
        self.data.forward();
        self.forwards += 1;
        self.check_solution()
    }

    /// Solves for accelerations and forces again with changed margins, the distances at which
    /// constraints become active, one per row \[m, rad\]. Rows and warm start are those of
    /// [`Engine::forward`].
    ///
    /// # Errors
    /// [`EngineFault`].
    pub fn resolve(&mut self, change: impl FnOnce(&mut [f64])) -> Result<(), EngineFault> {
        change(self.data.efc_margin_mut());
        for dof in 0..self.data.qacc().len() {
            let last = self.data.qacc()[dof];
            self.data.qacc_warmstart_mut()[dof] = last;
        }
        self.data.reference_constraint();
        self.data.fwd_constraint();
        self.check_solution()
    }

    /// Checks the solution for warnings and diverged accelerations.
    fn check_solution(&mut self) -> Result<(), EngineFault> {
        let islands = self.data.solver_niter().iter();
        let iterations: i32 = islands.sum();
        self.iterations += u64::try_from(iterations).unwrap_or(0);
        let now = self.warning_counts();
        let previous = std::mem::replace(&mut self.warnings, now);
        let mut counts = now.iter().zip(previous).zip(EngineWarning::ALL);
        if let Some((_, warning)) = counts.find(|((now, previous), _)| *now > previous) {
            return Err(EngineFault::EngineWarning(warning));
        }
        self.check_finite(self.data.qacc(), "acceleration")
    }

    /// Advances by `seconds` with the result of [`Engine::forward`].
    ///
    /// # Errors
    /// [`EngineFault`]; the state is then that before the step.
    pub fn integrate(&mut self, seconds: f64) -> Result<(), EngineFault> {
        self.data.read_state_into(STATE, &mut self.previous);
        self.data.model_opt_mut().timestep = seconds;
        self.advance_state();
        self.check_state()
    }

    /// Advances by the result of MuJoCo's forward computation.
    fn advance_state(&mut self) {
        match self.data.model_opt().integrator {
            i if i == MjtIntegrator::mjINT_RK4 as i32 => {
                self.data.runge_kutta(4);
                self.forwards += 3;
            }
            i if i == MjtIntegrator::mjINT_IMPLICIT as i32
                || i == MjtIntegrator::mjINT_IMPLICITFAST as i32 =>
            {
                self.data.implicit();
            }
            _ => self.data.euler(),
        }
    }

    /// Performs a step without checks: a diverged state remains.
    pub(crate) fn step_unchecked(&mut self, seconds: f64) {
        self.set_timestep(seconds);
        self.data.forward();
        self.advance_state();
        self.forwards += 1;
        self.steps += 1;
    }

    /// Checks the state after a step, and restores the previous one if it diverged.
    fn check_state(&mut self) -> Result<(), EngineFault> {
        self.steps += 1;
        let checked = self.check_finite(self.data.qvel(), "velocity");
        let checked = checked.and_then(|()| self.check_positions());
        if checked.is_err() {
            self.restore_previous();
        }
        checked
    }

    pub(crate) fn restore_previous(&mut self) {
        let restored = self.data.set_state(&self.previous, STATE);
        debug_assert!(restored.is_ok(), "a state of this model");
    }

    /// Advances to a stage of MuJoCo's fourth-order method, the second (1) to the last (3), and
    /// computes forces and accelerations there, so that the forces of each stage can be read. Stage
    /// 0 is the last call of [`Engine::forward`].
    ///
    /// # Errors
    /// [`EngineFault`]; the state is then that before the step.
    pub fn stage(&mut self, stage: usize, seconds: f64) -> Result<(), EngineFault> {
        if stage == 1 {
            self.data.read_state_into(STATE, &mut self.previous);
            self.stages.begin(&self.data);
        }
        self.stages.accumulate(&self.data, WEIGHTS[stage - 1]);
        self.stages
            .advance_to(&mut self.data, NODES[stage], seconds);
        let computed = self.forward();
        if computed.is_err() {
            self.restore_previous();
        }
        computed
    }

    /// Returns the weight of a stage in the step.
    pub fn weight(&self, stage: usize) -> f64 {
        WEIGHTS[stage]
    }

    /// Completes a step of stages.
    ///
    /// # Errors
    /// [`EngineFault`]; the state is then that before the step.
    pub fn finish_stages(&mut self, seconds: f64) -> Result<(), EngineFault> {
        self.stages.accumulate(&self.data, WEIGHTS[STAGES - 1]);
        self.stages.finish(&mut self.data, seconds);
        self.check_state()
    }

    /// Performs a step: [`Engine::forward`] and [`Engine::integrate`].
    ///
    /// # Errors
    /// [`EngineFault`]; the state is then that before the step.
    pub fn step(&mut self, seconds: f64) -> Result<(), EngineFault> {
        // The forces of constraints depend on the step, too.
        self.set_timestep(seconds);
        self.forward()?;
        self.integrate(seconds)
    }

    /// Sets the step that [`Engine::forward`] assumes \[s\].
    pub fn set_timestep(&mut self, seconds: f64) {
        self.data.model_opt_mut().timestep = seconds;
    }

    /// Changes parameters of the model between steps: values that MuJoCo reads anew in every step
    /// (friction losses, damping, armature, gains), and no sizes. Two copies of the model
    /// alternate, so `change` has to set every parameter that is ever changed, each time.
    pub fn set_parameters(&mut self, change: impl FnOnce(&mut MjModel)) {
        let Some(mut fresh) = self.spare.take() else {
            return;
        };
        change(&mut fresh);
        fresh.opt_mut().timestep = self.data.model_opt().timestep;
        self.spare = Some(self.data.swap_model(fresh));
    }

    /// Returns the model.
    pub fn model(&self) -> &MjModel {
        self.data.model()
    }

    /// Returns MuJoCo's state and results.
    pub fn data(&self) -> &MjData<Box<MjModel>> {
        &self.data
    }

    /// Returns MuJoCo's state and results mutably, to set controls and forces; a diverged value is
    /// a fault in the next step.
    pub fn data_mut(&mut self) -> &mut MjData<Box<MjModel>> {
        &mut self.data
    }

    /// Returns the state, which [`Engine::restore`] restores bit for bit.
    pub fn save(&self) -> Vec<f64> {
        self.data.state(STATE).into_vec()
    }

    /// Restores a state. Derived quantities in [`Engine::data`] (lengths, forces, sensors) are
    /// updated by the next [`Engine::forward`].
    ///
    /// # Errors
    /// [`EngineError::State`] for a state of another model.
    pub fn restore(&mut self, state: &[f64]) -> Result<(), EngineError> {
        let (expected, found) = (self.previous.len(), state.len());
        let other = EngineError::State { expected, found };
        if expected != found {
            return Err(other);
        }
        self.data.set_state(state, STATE).map_err(|_| other)
    }

    /// Returns the numbers of steps, of force computations, and of solver iterations.
    pub fn counts(&self) -> [u64; 3] {
        [self.steps, self.forwards, self.iterations]
    }

    fn warning_counts(&self) -> [i32; EngineWarning::ALL.len()] {
        let all = self.data.warning();
        std::array::from_fn(|i| all[i].number)
    }

    /// Checks values per degree of freedom.
    fn check_finite(&self, numbers: &[f64], what: &'static str) -> Result<(), EngineFault> {
        let Some(dof) = divergence::first_index(numbers) else {
            return Ok(());
        };
        let of = divergence::dof_name(self.model(), dof);
        Err(EngineFault::Diverged { what, of })
    }

    fn check_positions(&self) -> Result<(), EngineFault> {
        let Some(place) = divergence::first_index(self.data.qpos()) else {
            return Ok(());
        };
        let (what, of) = ("position", divergence::position_name(self.model(), place));
        Err(EngineFault::Diverged { what, of })
    }
}

#[cfg(test)]
mod tests;
