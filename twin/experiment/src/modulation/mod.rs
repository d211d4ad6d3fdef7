//! Study of footstep modulation: displacement of the footsteps after a change of a variable of the
//! controller, against the run without the change (thesis, section 3.2.5.1, figures 3.5 and 3.8).

pub(crate) mod cases;
mod cycles;
mod fit;
mod options;
mod request;
mod rerun;
mod results;
mod run;
mod table;
mod view;

pub use fit::{LinearModel, ModelForm};
pub use options::ModulationOptions;
pub use results::{CaseResult, IdealSlope, ModulationStudy};
pub use run::{Modulation, ModulationRun};
pub use table::{Counting, Displacement, DisplacementCell, DisplacementTable};

use twinrig_kernel::{SimTime, Unit};

/// A gait on a plant, with or without a factor.
#[derive(Clone, Debug, PartialEq)]
pub struct ModulationCase {
    /// Name of the gait: that of its scenario file.
    pub gait: String,
    /// Plant.
    pub plant: String,
    /// Factor that differs from the scenario: `as given`, `unsaturated servos`.
    pub factor: String,
    /// Time from which the reference run is in its limit cycle.
    pub after: SimTime,
    /// Value of the variable there.
    pub value: f64,
    /// Mean duty factor that the controller commands, where it does.
    pub duty: Option<f64>,
}

/// Subject of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct ModulationInput {
    /// Name of the scenario, or of the comparison of several.
    pub name: String,
    /// Paths of the scenario files.
    pub files: Vec<String>,
    /// Name of the changed variable.
    pub variable: String,
    /// Its unit.
    pub unit: Unit,
    /// Cases.
    pub cases: Vec<ModulationCase>,
    /// Parts that are left out, each with the reason.
    pub left_out: Vec<String>,
}

/// Change of the variable in a re-run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VariableChange {
    /// Time.
    pub at: SimTime,
    /// Difference from the value before, in its unit.
    pub by: f64,
}

/// Parameters of a study of modulation.
#[derive(Clone, Debug, PartialEq)]
pub struct ModulationPlan {
    /// Changes of the variable, in its unit.
    pub changes: Vec<f64>,
    /// Number of points of the gait cycle at which the variable changes.
    pub points: usize,
    /// Number of footsteps of each leg after the change.
    pub steps: usize,
}

impl Default for ModulationPlan {
    /// The changes of the thesis \[m\], at ten points of the cycle.
    fn default() -> Self {
        let changes = [2.5, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0];
        Self {
            changes: changes.map(|change| -1e-3 * change).into(),
            points: 10,
            steps: 10,
        }
    }
}
