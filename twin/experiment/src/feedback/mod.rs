//! Study of load feedback: a controller on the true load of its legs, and on loads that are
//! measured, estimated or filtered.

mod cases;
pub(crate) mod latency;
mod load_match;
mod load_observer;
mod options;
mod request;
mod results;
mod run;
mod step_slope;
pub(crate) mod task;
mod view;

pub use load_match::LegLoad;
pub use options::FeedbackOptions;
pub use results::{FeedbackResult, FeedbackStudy};
pub use run::feedback;
pub use step_slope::StepSlope;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;

use crate::gait::run::GaitRun;
use crate::modulation::ModulationPlan;

/// A gait on a plant and on loads of one source.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackCase {
    /// Plant.
    pub plant: String,
    /// Name of the source: that of its scenario file, and the lag if that is varied.
    pub source: String,
    /// Name of the signal, with `*` for the leg.
    pub signal: String,
    /// Time constant of the controller's filter of the load \[s\].
    pub lag_s: f64,
    /// Index of the case with which it is compared: its own for the reference.
    pub reference: usize,
    /// Names of the fore legs.
    pub fore: Vec<String>,
    /// End of the run.
    pub end: SimTime,
}

/// Subject of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackInput {
    /// Name of the comparison.
    pub name: String,
    /// Paths of the scenario files.
    pub files: Vec<String>,
    /// Cases.
    pub cases: Vec<FeedbackCase>,
    /// Parts that are left out, each with the reason.
    pub left_out: Vec<String>,
}

/// Values at a step of the controller.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ControlStep {
    /// Time \[s\].
    pub at_s: f64,
    /// Load of each leg that the rule takes, after the controller's filter \[N\].
    pub loads_n: Vec<f64>,
    /// Phase of each leg \[rad\].
    pub phases_rad: Vec<f64>,
    /// Commands of the drives.
    pub commands: Vec<f64>,
}

/// Run of a controller with feedback, from the side of the controller and of the plant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FeedbackRun {
    /// Footsteps and trunk.
    pub gait: GaitRun,
    /// Steps of the controller.
    pub control: Vec<ControlStep>,
    /// Times at which the plant was observed \[s\], ascending.
    pub observed_s: Vec<f64>,
    /// Load of each leg at these times \[N\].
    pub loads_n: Vec<Vec<f64>>,
}

/// Parameters of a study of load feedback.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackPlan {
    /// Time from which speed, footsteps and loads count \[s\].
    pub after_s: f64,
    /// Time from the first step of the controller over which phases are compared \[s\].
    pub phases_s: f64,
    /// Changes of a variable, and the footsteps after them.
    pub modulation: ModulationPlan,
}
