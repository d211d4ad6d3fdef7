//! Definitions of the terms of a stability study.

use twinrig_kernel::SimDuration;

use crate::number::duration;
use crate::precision::RUNAWAY;
use crate::stability::StabilityPlan;
use crate::trial::{GROWTH, REST, STEPS_MOST};

/// Returns the definitions as pairs of name and text, for the report.
pub(crate) fn of(plan: &StabilityPlan, period: Option<SimDuration>) -> Vec<(String, String)> {
    let text = |name: &str, text: String| (name.to_owned(), text);
    let mut criteria = vec![
        text(
            "unstable",
            format!(
                "over {}, or {STEPS_MOST} steps where those are shorter, the plant fails or something is no longer a number, or kinetic energy at any time exceeds {RUNAWAY} \
                 times all that the reference had to give, or its peak in the last quarter exceeds {GROWTH} times that of the first \
                 quarter and {GROWTH} times that of the reference's last, or it exceeds the latter and does not fall any more where \
                 the reference's does (below {REST:e} of all there is to give it counts as rest): what grows until stops bound it \
                 does not explode, and does not come to rest either",
                duration(plan.duration)
            ),
        ),
        text(
            "search",
            format!(
                "bisection of the logarithm of the step from {} to {}, until the shortest unstable step is at most {} times \
                 the longest stable one; steps of 0.8 and 0.5 of the limit must be stable, too",
                duration(plan.least),
                duration(plan.most),
                plan.ratio
            ),
        ),
        text(
            "wrong",
            format!(
                "stable, but the feet are {} mm or more (RMS) from the reference",
                plan.wrong_m * 1e3
            ),
        ),
        text(
            "methods with a tolerance",
            format!(
                "choose their steps themselves and have no limit; at a tolerance of {:e} it is asked whether they are stable, and their error",
                plan.tolerance
            ),
        ),
    ];
    if let Some(period) = period {
        criteria.push(text(
            "commands",
            format!("arrive every {}, and no step is longer than that: a limit of so much is a lower bound", duration(period)),
        ));
    }
    criteria
}
