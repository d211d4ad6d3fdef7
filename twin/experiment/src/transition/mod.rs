//! Study of gait transitions: gaits classified over time by the loads of the feet while a variable
//! of the controller changes in steps (thesis, section 3.3.2.3, figure 3.7).

mod cases;
mod classify;
mod events;
mod gait_diagram;
mod options;
mod request;
mod results;
mod run;
mod view;

pub use classify::{GaitCycle, GaitPattern, MIXED, STANDING};
pub use events::{Hysteresis, RampDirection, Transition};
pub use options::TransitionOptions;
pub use results::{ClassAgreement, TransitionResult, TransitionStudy};
pub use run::transition;

use twinrig_kernel::{SimTime, Unit};

/// A run of the scenario: a plant, and plateaus of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct TransitionCase {
    /// Plant.
    pub plant: String,
    /// Usual time between two changes of the variable \[s\].
    pub plateau_s: f64,
    /// Values of the variable, each with the time from which it applies \[s\].
    pub values: Vec<[f64; 2]>,
    /// End of the run.
    pub end: SimTime,
}

/// Subject of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct TransitionInput {
    /// Name of the scenario.
    pub name: String,
    /// Path of the scenario file.
    pub file: String,
    /// Name of the changing variable.
    pub variable: String,
    /// Its unit.
    pub unit: Unit,
    /// Patterns of the gaits; a cycle belongs to the nearest one.
    pub patterns: Vec<GaitPattern>,
    /// Runs.
    pub cases: Vec<TransitionCase>,
    /// Parts that are left out, each with the reason.
    pub left_out: Vec<String>,
}

/// Parameters of a study of transitions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransitionPlan {
    /// Greatest deviation of a leg from a pattern, as a share of the cycle. The patterns of walk
    /// and trot are an eighth of a cycle apart, those of bound and gallop a twentieth.
    pub tolerance: f64,
    /// Cycles in a row after which a gait is established.
    pub lasting: usize,
}

impl Default for TransitionPlan {
    fn default() -> Self {
        Self {
            tolerance: 0.1,
            lasting: 3,
        }
    }
}
