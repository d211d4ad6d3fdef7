//! State of a running study of stability, which its parts share.

use crate::budget::{Budget, Share};
use crate::error::StudyError;
use crate::plants::reference::RunContext;
use crate::plants::stability_plan::StabilityPlan;
use crate::progress::ProgressObserver;

/// State of a running study.
pub(crate) struct Job<'a> {
    pub(crate) context: RunContext<'a>,
    pub(crate) plan: &'a StabilityPlan,
    pub(crate) budget: Budget,
    pub(crate) progress: &'a mut dyn ProgressObserver,
}

impl Job<'_> {
    pub(crate) fn begin(&mut self, doing: &str) -> Result<Share, StudyError> {
        let share = self.budget.next(false);
        let (part, of) = self.budget.progress();
        if self.progress.at(part, of, doing) {
            Ok(share)
        } else {
            Err(StudyError::Interrupted { done: part, of })
        }
    }
}
