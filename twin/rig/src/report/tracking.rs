//! How a gait is followed, in its serialised form.

use serde::{Serialize, Serializer};
use twinrig_scenario::{LeftOut, TrackedDrive, TrackedLeg, TrackingReport};

use crate::report::seconds;

#[derive(Serialize)]
struct Written<'a> {
    /// Time from which on it is evaluated \[s\].
    from_s: f64,
    /// Whether it is that of the ramp, in which the run ended.
    in_ramp: bool,
    legs: Vec<WrittenLeg<'a>>,
    froude: Option<f64>,
    strouhal: Option<f64>,
    cost_of_transport: Option<f64>,
    left_out: &'a [LeftOut],
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct WrittenLeg<'a> {
    leg: &'a str,
    drives: Vec<WrittenDrive>,
    step_height_m: Option<f64>,
    lift_mean_m: Option<f64>,
    lift_least_m: Option<f64>,
    swings: u64,
}

#[derive(Serialize)]
struct WrittenDrive {
    drive: &'static str,
    error_rms_rad: f64,
    error_peak_rad: f64,
    peak_at_s: f64,
    saturated_share: Option<f64>,
}

impl From<&TrackedDrive> for WrittenDrive {
    fn from(drive: &TrackedDrive) -> Self {
        Self {
            drive: drive.drive,
            error_rms_rad: drive.rms,
            error_peak_rad: drive.peak,
            peak_at_s: seconds(drive.peak_at.as_nanos()),
            saturated_share: drive.saturated,
        }
    }
}

impl<'a> From<&'a TrackedLeg> for WrittenLeg<'a> {
    fn from(leg: &'a TrackedLeg) -> Self {
        Self {
            leg: &leg.leg,
            drives: leg.drives.iter().map(Into::into).collect(),
            step_height_m: leg.lift.map(|lift| lift.commanded),
            lift_mean_m: leg.lift.map(|lift| lift.mean),
            lift_least_m: leg.lift.map(|lift| lift.least),
            swings: leg.lift.map_or(0, |lift| lift.count),
        }
    }
}

/// Serialises the tracking of a run; null without a gait.
#[expect(clippy::ref_option, reason = "serde passes a reference to the field")]
pub(super) fn serialize<S: Serializer>(
    tracking: &Option<TrackingReport>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let written = tracking.as_ref().map(|tracking| Written {
        from_s: seconds(tracking.from.as_nanos()),
        in_ramp: tracking.in_ramp,
        legs: tracking.legs.iter().map(Into::into).collect(),
        froude: tracking.similarity.and_then(|it| it.froude),
        strouhal: tracking.similarity.and_then(|it| it.strouhal),
        cost_of_transport: tracking.similarity.and_then(|it| it.cost_of_transport),
        left_out: &tracking.left_out,
        warnings: tracking.warnings(),
    });
    written.serialize(serializer)
}

/// Returns the warnings about a gait that is not followed.
pub(super) fn warnings(tracking: Option<&TrackingReport>) -> Vec<String> {
    tracking.map_or_else(Vec::new, TrackingReport::warnings)
}
