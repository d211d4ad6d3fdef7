//! MuJoCo, as far as plants need it: a model and its state, stepped without surprises.

use mujoco_rs::error::MjEditError;
use mujoco_rs::prelude::{MjData, MjModel, MjtDisableBit, MjtIntegrator, MjtState};
use mujoco_rs::wrappers::mj_editing::MjSpec;

use self::refusal::{in_one_line, refused};
use crate::stages::Stages;

mod divergence;
pub(crate) mod refusal;

/// All that the way ahead depends on: positions, velocities, activations, warm start, controls, applied forces.
const STATE: u32 = MjtState::mjSTATE_INTEGRATION as u32;

/// Stages of the method of fourth order: where they are in the step, and their shares in it.
pub(crate) const STAGES: usize = 4;
const NODES: [f64; STAGES] = [0.0, 0.5, 0.5, 1.0];
const WEIGHTS: [f64; STAGES] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// A model and its state.
///
/// A step is [`forward`](Self::forward), which says how everything accelerates and which forces hold it, and then
/// [`integrate`](Self::integrate). Between the two, forces may be read and the step may be given up: nothing has moved. Both
/// together are MuJoCo's own step, bit for bit, with one difference: what MuJoCo would warn of on standard error and in a
/// file, setting the model back to its start, is an [`EngineFault`] here, and the state stays what it was.
pub struct Engine {
    data: MjData<Box<MjModel>>,
    /// A twin of the model, whose parameters are set while the other one is in use; then they change places.
    spare: Option<Box<MjModel>>,
    before: Vec<f64>,
    stages: Stages,
    warnings: [i32; EngineWarning::ALL.len()],
    steps: u64,
    forwards: u64,
    iterations: u64,
}

/// Why there is no engine, or it cannot be where it is asked to be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EngineError {
    /// Another version of the library than this was made for.
    #[error(
        "this needs MuJoCo {wanted} and found {found}; `ci/setup mujoco` fetches the right one"
    )]
    Version {
        /// What it was made for.
        wanted: &'static str,
        /// What is there.
        found: String,
    },
    /// MuJoCo refuses the model.
    #[error("MuJoCo refuses the model: {0}")]
    Model(String),
    /// A state of another model.
    #[error("a state of {found} numbers is not of this model, whose states have {expected}")]
    State {
        /// Numbers of a state of this model.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
}

/// Why a step could not be made. The state is what it was before.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EngineFault {
    /// A number gone wild, or none at all.
    #[error("the {what} of {of} is no longer a number, or beyond all measure; take a shorter step")]
    Wild {
        /// `acceleration`, `velocity`, `position` or `control`.
        what: &'static str,
        /// The joint or actuator.
        of: String,
    },
    /// What MuJoCo itself warns of.
    #[error("MuJoCo warns: {0}")]
    EngineWarning(EngineWarning),
}

/// What MuJoCo warns of besides numbers gone wild.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EngineWarning {
    /// The inertia matrix is close to singular.
    #[error("the inertia matrix is (close to) singular")]
    Inertia,
    /// There is no room for more contacts.
    #[error(
        "there are more contacts than there is memory for; raise `memory` in the model's <size>"
    )]
    Contacts,
    /// There is no room for more constraints.
    #[error(
        "there are more constraints than there is memory for; raise `memory` in the model's <size>"
    )]
    Constraints,
}

impl EngineWarning {
    /// In the order of MuJoCo's own numbers, of which these are the first.
    const ALL: [Self; 3] = [Self::Inertia, Self::Contacts, Self::Constraints];
}

impl Engine {
    /// The version of the library that this is made for.
    pub const VERSION: &'static str = "3.17.0";

    /// Compiles a model that is one text and needs no other files.
    ///
    /// # Errors
    /// [`EngineError`] with what MuJoCo says of the model.
    pub fn compile(mjcf: &str) -> Result<Self, EngineError> {
        Self::check_version()?;
        let model = MjModel::from_xml_string(mjcf);
        let parse = || {
            // What is no string for C cannot even be asked about.
            let sound = Some(mjcf).filter(|text| !text.contains('\0'));
            MjSpec::from_xml_string(sound.ok_or(MjEditError::UnsupportedOperation)?)
        };
        Self::of_model(model.map_err(|why| refused(&why, parse))?)
    }

    /// Takes a model that is compiled already, for what needs files beside it; [`Engine::check_version`] comes before that.
    ///
    /// # Errors
    /// [`EngineError`] where MuJoCo makes no state of it.
    pub fn of_model(model: MjModel) -> Result<Self, EngineError> {
        let mut spare = Box::new(model.clone());
        let data = MjData::try_new(Box::new(model));
        let mut data = data.map_err(|why| EngineError::Model(in_one_line(&why.to_string())))?;
        if data.model_opt().integrator == MjtIntegrator::mjINT_DISCRETE as i32 {
            // This integrator has its damping in its equations; `euler` then only moves on by what they say.
            data.model_opt_mut().disableflags |= MjtDisableBit::mjDSBL_EULERDAMP as i32;
        }
        spare.opt_mut().disableflags = data.model_opt().disableflags;
        let before = vec![0.0; data.model().state_size(STATE)];
        let stages = Stages::new(data.qpos().len(), data.qvel().len());
        let mut engine = Self {
            data,
            spare: Some(spare),
            before,
            stages,
            warnings: [0; EngineWarning::ALL.len()],
            steps: 0,
            forwards: 0,
            iterations: 0,
        };
        engine.warnings = engine.warned();
        Ok(engine)
    }

    /// Refuses another version of the library than [`Engine::VERSION`], of which the rest would be undefined.
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

    /// Finds accelerations and forces of the present state, under its controls.
    ///
    /// # Errors
    /// [`EngineFault`].
    pub fn forward(&mut self) -> Result<(), EngineFault> {
        // MuJoCo would reset it, and say so where nobody wants it said.
        if let Some(i) = divergence::first(self.data.ctrl()) {
            let of = divergence::actuator(self.model(), i);
            let what = "control";
            return Err(EngineFault::Wild { what, of });
        }
        self.data.forward();
        self.forwards += 1;
        self.found()
    }

    /// Finds accelerations and forces again, with other distances at which constraints are closed, one for each row \[m, rad\]:
    /// what [`Engine::forward`] found says which row is whose, and where the search begins.
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
        self.found()
    }

    /// Looks at what has been found.
    fn found(&mut self) -> Result<(), EngineFault> {
        let islands = self.data.solver_niter().iter();
        let iterations: i32 = islands.sum();
        self.iterations += u64::try_from(iterations).unwrap_or(0);
        let now = self.warned();
        let before = std::mem::replace(&mut self.warnings, now);
        let mut news = now.iter().zip(before).zip(EngineWarning::ALL);
        if let Some((_, warned)) = news.find(|((now, before), _)| *now > before) {
            return Err(EngineFault::EngineWarning(warned));
        }
        self.sound(self.data.qacc(), "acceleration")
    }

    /// Moves on by `seconds` with what [`Engine::forward`] found.
    ///
    /// # Errors
    /// [`EngineFault`]; the state is then what it was.
    pub fn integrate(&mut self, seconds: f64) -> Result<(), EngineFault> {
        self.data.read_state_into(STATE, &mut self.before);
        self.data.model_opt_mut().timestep = seconds;
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
        self.settle()
    }

    /// Looks at what a step has made of the state, and goes back where it is none.
    fn settle(&mut self) -> Result<(), EngineFault> {
        self.steps += 1;
        let sound = self.sound(self.data.qvel(), "velocity");
        let sound = sound.and_then(|()| self.sound_places());
        if sound.is_err() {
            self.step_back();
        }
        sound
    }

    pub(crate) fn step_back(&mut self) {
        let restored = self.data.set_state(&self.before, STATE);
        debug_assert!(restored.is_ok(), "its own state fits");
    }

    /// Goes on to a stage of MuJoCo's method of fourth order, the second (1) to the last (3), and finds forces and
    /// accelerations there: for who wants to see what acts in each. Stage 0 is where [`Engine::forward`] was last.
    ///
    /// # Errors
    /// [`EngineFault`]; the state is then what it was before the step.
    pub fn stage(&mut self, stage: usize, seconds: f64) -> Result<(), EngineFault> {
        if stage == 1 {
            self.data.read_state_into(STATE, &mut self.before);
            self.stages.begin(&self.data);
        }
        self.stages.note(&self.data, WEIGHTS[stage - 1]);
        self.stages.go(&mut self.data, NODES[stage], seconds);
        let found = self.forward();
        if found.is_err() {
            self.step_back();
        }
        found
    }

    /// The share of a stage in the step.
    pub fn weight(&self, stage: usize) -> f64 {
        WEIGHTS[stage]
    }

    /// Ends a step of stages.
    ///
    /// # Errors
    /// [`EngineFault`]; the state is then what it was before the step.
    pub fn finish_stages(&mut self, seconds: f64) -> Result<(), EngineFault> {
        self.stages.note(&self.data, WEIGHTS[STAGES - 1]);
        self.stages.end(&mut self.data, seconds);
        self.settle()
    }

    /// [`Engine::forward`] and [`Engine::integrate`].
    ///
    /// # Errors
    /// [`EngineFault`]; the state is then what it was.
    pub fn step(&mut self, seconds: f64) -> Result<(), EngineFault> {
        // Constraints know the step, too.
        self.set_timestep(seconds);
        self.forward()?;
        self.integrate(seconds)
    }

    /// The step that [`Engine::forward`] reckons with \[s\].
    pub fn set_timestep(&mut self, seconds: f64) {
        self.data.model_opt_mut().timestep = seconds;
    }

    /// Changes parameters of the model between steps: numbers that MuJoCo reads anew in every step (losses of friction,
    /// damping, armature, gains), and nothing that has a size. Two models take turns, so `change` has to set whatever is ever
    /// changed, each time.
    pub fn retune(&mut self, change: impl FnOnce(&mut MjModel)) {
        let Some(mut fresh) = self.spare.take() else {
            return;
        };
        change(&mut fresh);
        fresh.opt_mut().timestep = self.data.model_opt().timestep;
        self.spare = Some(self.data.swap_model(fresh));
    }

    /// The model.
    pub fn model(&self) -> &MjModel {
        self.data.model()
    }

    /// Everything that MuJoCo computes of it.
    pub fn data(&self) -> &MjData<Box<MjModel>> {
        &self.data
    }

    /// The same, to set controls and forces; what is set wild here is a fault in the next step.
    pub fn data_mut(&mut self) -> &mut MjData<Box<MjModel>> {
        &mut self.data
    }

    /// What makes the state again, bit for bit.
    pub fn save(&self) -> Vec<f64> {
        self.data.state(STATE).into_vec()
    }

    /// Goes back to a state. What follows from it ([`Engine::data`]'s lengths, forces and sensors) is there again after
    /// [`Engine::forward`].
    ///
    /// # Errors
    /// [`EngineError::State`] for one of another model.
    pub fn restore(&mut self, state: &[f64]) -> Result<(), EngineError> {
        let (expected, found) = (self.before.len(), state.len());
        let other = EngineError::State { expected, found };
        if expected != found {
            return Err(other);
        }
        self.data.set_state(state, STATE).map_err(|_| other)
    }

    /// Steps made, times that forces were found, iterations of the solver for them.
    pub fn counts(&self) -> [u64; 3] {
        [self.steps, self.forwards, self.iterations]
    }

    fn warned(&self) -> [i32; EngineWarning::ALL.len()] {
        let all = self.data.warning();
        std::array::from_fn(|i| all[i].number)
    }

    /// By velocities or accelerations.
    fn sound(&self, numbers: &[f64], what: &'static str) -> Result<(), EngineFault> {
        let Some(dof) = divergence::first(numbers) else {
            return Ok(());
        };
        let of = divergence::dof(self.model(), dof);
        Err(EngineFault::Wild { what, of })
    }

    fn sound_places(&self) -> Result<(), EngineFault> {
        let Some(place) = divergence::first(self.data.qpos()) else {
            return Ok(());
        };
        let (what, of) = ("position", divergence::place(self.model(), place));
        Err(EngineFault::Wild { what, of })
    }
}

#[cfg(test)]
#[path = "engine_tests.rs"]
mod tests;
