//! Runs of a study of stability.

use crate::plants::reference::RunContext;
use crate::plants::stability_plan::StabilityPlan;

/// Runs of a study: their environment and plan.
#[derive(Clone, Copy)]
pub(crate) struct Runs<'a> {
    pub(crate) context: RunContext<'a>,
    pub(crate) plan: &'a StabilityPlan,
}
