//! Interface of the equations of motion of a legged robot.

use serde::Serialize;
use serde::de::DeserializeOwned;
use twinrig_kernel::SimTime;
use twinrig_robot::Robot;
use twinrig_runtime::{PlantEvent, PlantState, WorkCounts};

use crate::error::LeggedError;
use crate::external_load::StepLoad;
use crate::friction::Friction;
use crate::posture::Posture;
use crate::readings::Readings;
use crate::setup::Setup;
use twinrig_actuator::StepInputs;

/// Equations of motion of a legged robot and their integration, from which
/// [`LeggedPlant`](crate::LeggedPlant) makes a plant.
///
/// Dynamics of several kinds that are selected at run time are one plant as
/// `LeggedPlant<dyn Dynamics<Saved = …>>`, at the cost of a virtual call a step.
pub trait Dynamics: Readings + Send {
    /// Serialised state: all that later steps depend on.
    type Saved: Serialize + DeserializeOwned;

    /// Returns the name of the plant.
    fn name(&self) -> &'static str;

    /// Writes the inputs that apply until the first command: servos keep their position, motors
    /// coast.
    fn initial_inputs(&self, inputs: &mut [f64]);

    /// Sets the inputs of the next steps, until the next call; those with rates are set at every
    /// step.
    fn set_inputs(&mut self, inputs: &StepInputs<'_>);

    /// Sets the coefficients of friction from the present time on; called only where they change.
    fn set_friction(&mut self, friction: &Friction);

    /// Sets the load of pushes in the next step; called before every step of a plant with pushes.
    /// Dynamics evaluate it at the times of their stages, or hold its mean. It is no part of the
    /// saved state.
    fn set_load(&mut self, load: &StepLoad);

    /// Advances by one step from the time `from`.
    ///
    /// # Errors
    /// [`PartFault`], in the state before the step.
    fn advance(&mut self, from: SimTime, seconds: f64) -> Result<(), PartFault>;

    /// Returns the work counts since the start.
    fn counts(&self) -> WorkCounts;

    /// Returns the maximum violation of the constraints \[m\]; none by default, for coordinates
    /// that satisfy them all.
    fn constraint_violation(&self) -> Option<f64> {
        None
    }

    /// Returns the least substep of an error control since the start, but for those cut short by
    /// the end of a step \[s\]; none by default.
    fn least_substep_s(&self) -> Option<f64> {
        None
    }

    /// Updates the readings before they are read, where the steps themselves do not: by default
    /// they do.
    fn update_readings(&mut self) {}

    /// Returns the state to be serialised.
    fn save(&self) -> Self::Saved;

    /// Restores a saved state, bit for bit.
    ///
    /// # Errors
    /// Description of the robot of which it was saved, where it does not fit.
    fn restore(&mut self, saved: Self::Saved) -> Result<(), String>;

    /// Returns the state in the coordinates that all plants of a robot share.
    fn posture(&self) -> Posture;

    /// Returns the entries of the state beyond the posture, by name.
    fn extra_state(&self) -> Vec<(String, Vec<f64>)> {
        Vec::new()
    }

    /// Resumes from a valid posture and the entries of [`Self::extra_state`] in `extra`, with a new
    /// energy balance and new counts. Returns a line for each part that was not taken over.
    ///
    /// # Errors
    /// [`PartFault`] if the posture cannot be represented; nothing has changed then.
    fn resume_from(
        &mut self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<Vec<String>, PartFault>;

    /// Enables or disables the event log; either clears it. By default no events are logged.
    fn log_events(&mut self, _enabled: bool) {}

    /// Moves the logged events to the end of `to`, in order of time; called only while events are
    /// logged.
    fn drain_events(&mut self, _to: &mut Vec<PlantEvent>) {}
}

/// Failure of a part of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct PartFault {
    /// The part: `leg/LF`, `contact`, `integrator`.
    pub part: String,
    /// The reason.
    pub why: String,
}

impl PartFault {
    /// Creates the fault of a part.
    pub fn new(part: impl Into<String>, why: impl Into<String>) -> Self {
        Self {
            part: part.into(),
            why: why.into(),
        }
    }
}

/// Construction of [`Dynamics`], for [`LeggedPlant::new`](crate::LeggedPlant::new).
pub trait FromRobot: Dynamics {
    /// Options of the plant.
    type Options;
    /// Inconsistency of robot and options.
    type Error: From<LeggedError>;

    /// Returns the part of the options that all plants have.
    fn setup(options: &Self::Options) -> &Setup;

    /// Builds the dynamics with the trunk level and at rest, the legs at their start, and the
    /// lowest foot at height zero, or on the ground where that is higher.
    ///
    /// # Errors
    /// If robot and options are inconsistent.
    fn from_robot(robot: &Robot, options: &Self::Options) -> Result<Box<Self>, Self::Error>;
}
