//! Results on the contact of the feet: penetration at rest, and residuals of the contact law.

use serde::{Deserialize, Serialize};

use crate::plants::row::{Status, VariantKey};

/// Contact of a plant by one method at the scenario's step. Values that do not apply are null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactResiduals {
    /// Plant, method and setting.
    #[serde(flatten)]
    pub key: VariantKey,
    /// Outcome.
    pub status: Status,
    /// Reason of a status other than `ok`, or of missing values.
    pub why: Option<String>,
    /// Standing under the first commands.
    pub rest: Option<RestContact>,
    /// The first seconds of the gait.
    pub gait: Option<GaitContact>,
}

/// Foot with the greatest load of a standing robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestContact {
    /// Load \[N\].
    pub load_n: f64,
    /// Penetration: 0 for rigid contact \[m\].
    pub penetration_m: f64,
    /// Penetration of a linear sole with the stiffness of the robot file, for compliant
    /// constraints \[m\].
    pub expected_m: Option<f64>,
    /// Stiffness realised: load over penetration, as a share of that of the robot file.
    pub stiffness_realised: Option<f64>,
    /// Speed of the foot: the robot is not at rest if this is large \[m/s\].
    pub speed_m_s: f64,
}

/// Residuals of unilateral contact with Coulomb friction and dissipation, all 0 for exact rigid
/// contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GaitContact {
    /// Greatest product of gap or penetration and load (Signorini) \[J\].
    pub signorini_j: f64,
    /// Greatest penetration \[m\].
    pub penetration_m: f64,
    /// Greatest friction beyond the cone, `|F_t| − µ F_n` \[N\].
    pub coulomb_n: Option<f64>,
    /// Work of friction in the direction of slip, which friction should oppose \[J\].
    pub along_slip_j: f64,
    /// Energy that contacts created: work of the ground on a foot from touch-down to lift-off,
    /// where positive \[J\].
    pub created_j: f64,
    /// Energy that contacts dissipated, where that work is negative \[J\].
    pub dissipated_j: f64,
}
