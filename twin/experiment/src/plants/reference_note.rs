//! Description of references in the results of a study.

use serde::{Deserialize, Serialize};
use twinrig_rig::PlantId;

/// Description of a reference in the results of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceNote {
    /// Plant.
    #[serde(flatten)]
    pub plant: PlantId,
    /// Plant simulated in the reference run, where it is another plant of the same model.
    pub of_plant: Option<String>,
    /// Method; `None` if there is no reference.
    pub method: Option<String>,
    /// Step size \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Check of the reference.
    pub check: Option<CheckNote>,
    /// End of the agreement of reference and check, after which nothing is compared; `None`: the
    /// end of the run \[s\].
    pub holds_until_s: Option<f64>,
    /// Reason for a missing reference or check, or a remark.
    pub why: Option<String>,
}

/// The check of a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckNote {
    /// Method.
    pub method: String,
    /// Step size \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Whether the check uses another method.
    pub independent: bool,
    /// RMS distance between the two \[m\].
    pub disagreement_rms_m: f64,
    /// Greatest distance between the two \[m\].
    pub disagreement_max_m: f64,
}

impl ReferenceNote {
    /// The note of a `plant` without a reference.
    pub(crate) fn missing(plant: &PlantId, why: String) -> Self {
        Self {
            plant: plant.clone(),
            of_plant: None,
            method: None,
            step_s: None,
            tolerance: None,
            check: None,
            holds_until_s: None,
            why: Some(why),
        }
    }
}
