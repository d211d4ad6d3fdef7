//! How a gait is followed, as text and in its serialised form.

use std::fmt::Write as _;

use serde::{Serialize, Serializer};
use twinrig_scenario::{
    LeftOut, Similarity, TrackedDrive, TrackedLeg, TrackedLift, TrackingReport,
};

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

/// Returns the line with the numbers of a gait; none where the robot makes no strides.
pub(super) fn numbers(tracking: Option<&TrackingReport>) -> Option<String> {
    let Similarity {
        froude,
        strouhal,
        cost_of_transport,
    } = tracking?.similarity?;
    let mut line = format!(
        "Froude number {:.2}, Strouhal number {:.2}",
        froude?, strouhal?
    );
    if let Some(cost) = cost_of_transport {
        let _ = write!(line, ", cost of transport {cost:.2}");
    }
    Some(line)
}

/// Returns the lines of a report: tracking error and saturation of the drives, with the leg that is
/// the worst, then the lift of the feet.
pub(super) fn lines(tracking: Option<&TrackingReport>) -> Vec<String> {
    let Some(tracking) = tracking else {
        return Vec::new();
    };
    let errors = TrackingReport::DRIVES.iter().filter_map(|&name| {
        let drives = tracking.drives(name);
        let (leg, worst) = drives.max_by(|(_, a), (_, b)| a.rms.total_cmp(&b.rms))?;
        let [rms, peak] = [worst.rms, worst.peak].map(f64::to_degrees);
        Some(format!("{name} {rms:.1}° rms, {peak:.1}° peak ({leg})"))
    });
    let errors: Vec<String> = errors.collect();
    let saturated = tracking.most_saturated().map(|(leg, drive, share)| {
        let share = share * 100.0;
        format!("saturated {share:.1} % of the time ({leg} {drive})")
    });
    let lift = tracking.least_lift().map(|(leg, lift)| {
        let TrackedLift {
            commanded, mean, ..
        } = lift;
        let [mean, commanded] = [mean, commanded].map(|metres| metres * 1e3);
        format!("feet lift {mean:.1} mm of {commanded:.1} mm commanded ({leg})")
    });
    let others: Vec<String> = saturated.into_iter().chain(lift).collect();
    let ramp = tracking.in_ramp && !(errors.is_empty() && others.is_empty());
    let ramp = ramp.then(|| "of the ramp only".to_owned());
    let lines = [ramp.into_iter().collect(), errors, others].into_iter();
    let lines = lines.filter(|parts| !parts.is_empty());
    lines.map(|parts| parts.join("; ")).collect()
}
