//! Study of robustness: ensembles of runs of a scenario from perturbed starts, the margins of its
//! expectations over them, and the time up to which its trajectory is predictable.

mod cases;
mod divergence;
pub(crate) mod options;
mod request;
mod results;
mod run;
pub(crate) mod task;
mod view;

pub use divergence::{Divergence, Growth, Trajectory};
pub use results::{EnsembleRun, GrowthRate, RobustnessResult, RobustnessStudy};

use serde::{Deserialize, Serialize};
use twinrig_campaign::spread::{EnsembleKind, ExpectationSpread, Magnitude};
use twinrig_campaign::sweep::SweepRow;
use twinrig_report::number::quantity;

/// Returns a margin of an expectation with its unit.
pub(crate) fn margin_text(expectation: &ExpectationSpread, margin: f64) -> String {
    quantity(margin, &expectation.unit)
}

/// A scenario on a plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobustnessCase {
    /// Name of the scenario.
    pub scenario: String,
    /// Path of the scenario file.
    pub file: String,
    /// Plant.
    pub plant: String,
    /// Difference between the runs.
    pub kind: EnsembleKind,
    /// Reason why the start is not perturbed.
    pub why_seeds: Option<String>,
    /// Unit of the distance between trajectories: `m`, or `rad` of a plant that observes angles
    /// only; none if it observes neither.
    pub unit: Option<String>,
    /// Duration of a run \[s\].
    pub duration_s: f64,
}

/// Run of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MemberRun {
    /// Verdict and expectations.
    pub row: SweepRow,
    /// Positions over time.
    pub trajectory: Trajectory,
    /// Times from each touch-down of a leg to its next \[s\].
    pub strides_s: Vec<f64>,
}

/// Parameters of a study of robustness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobustnessPlan {
    /// Runs of each ensemble, the unperturbed one included; at least 2.
    pub runs: usize,
    /// Distance of two trajectories beyond which one does not predict the other, in m or rad.
    pub tolerance: f64,
}

impl RobustnessPlan {
    /// Returns the magnitudes of the perturbed runs of an ensemble, in their order.
    pub fn magnitudes(&self) -> Vec<Magnitude> {
        Magnitude::spaced(self.runs.saturating_sub(1))
    }
}
