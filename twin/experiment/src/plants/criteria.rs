//! Definitions of the terms of a stability study.

use twinrig_kernel::SimDuration;
use twinrig_report::number::duration;

use crate::plants::precision::RUNAWAY;
use crate::plants::stability_plan::StabilityPlan;
use crate::plants::trial::{GROWTH, REST, STEPS_MOST};

/// Returns the definitions as pairs of name and text, for the report.
pub(crate) fn of(plan: &StabilityPlan, period: Option<SimDuration>) -> Vec<(String, String)> {
    let text = |name: &str, text: String| (name.to_owned(), text);
    let mut criteria = vec![
        text(
            "unstable",
            format!(
                "over {}, or {STEPS_MOST} steps where those are shorter: the plant fails, a value is not \
                 finite, the kinetic energy exceeds {RUNAWAY} times the energy available to the reference, or \
                 its peak in the last quarter exceeds {GROWTH} times that of the first quarter and {GROWTH} times \
                 that of the reference's last quarter, or exceeds the latter without falling any more where that \
                 of the reference falls (below {REST:e} of the available energy counts as rest): growth that stops \
                 bound neither diverges nor decays; where commands change and there is no reference, growth is not \
                 judged",
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
                "choose their steps and have no limit; their stability and error are those at a tolerance of {:e}; \
                 `refused` is one that reported a fault, with the reason, in place of a result",
                plan.tolerance
            ),
        ),
    ];
    if let Some(period) = period {
        criteria.push(text(
            "commands",
            format!(
                "arrive every {}, which no step exceeds: a limit of that length is a lower bound",
                duration(period)
            ),
        ));
    }
    criteria
}
