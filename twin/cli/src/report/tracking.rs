//! Lines of a report on how a gait is followed.

use std::fmt::Write as _;

use twinrig_scenario::{Similarity, TrackedLift, TrackingReport};

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
