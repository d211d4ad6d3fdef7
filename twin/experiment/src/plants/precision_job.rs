//! State of a running study of precision, which its parts share.

use crate::budget::{Budget, Share};
use crate::error::StudyError;
use crate::plants::precision_plan::PrecisionPlan;
use crate::plants::reference::{RunContext, Trust};
use crate::plants::row::Row;
use crate::progress::ProgressObserver;

/// Greatest distance at which a reference and its check are trusted \[m\]: the aimed-for error, and
/// 0.1 mm with ground contact, where impacts make any two methods diverge.
const NEAR_M: f64 = 1e-6;
const NEAR_ON_GROUND_M: f64 = 1e-4;

/// State of a running study.
pub(crate) struct Job<'a> {
    pub(crate) context: RunContext<'a>,
    pub(crate) plan: &'a PrecisionPlan,
    pub(crate) budget: Budget,
    pub(crate) progress: &'a mut dyn ProgressObserver,
    pub(crate) rows: Vec<Row>,
}

impl Job<'_> {
    /// Returns the required agreement of references and their checks.
    pub(crate) fn trust(&self) -> Trust {
        Trust {
            apart_m: if self.context.factory.input().ground {
                NEAR_ON_GROUND_M
            } else {
                NEAR_M
            },
            rough: false,
        }
    }

    /// Begins a part with the still larger share of many walks.
    pub(crate) fn begin_very_heavy(&mut self, doing: &str) -> Result<Share, StudyError> {
        let share = self.budget.next_very_heavy();
        self.report(doing).map(|()| share)
    }

    pub(crate) fn begin(&mut self, doing: &str) -> Result<Share, StudyError> {
        self.begin_part(doing, false)
    }

    /// Begins a part with the larger share of a reference run or a complete walk.
    pub(crate) fn begin_heavy(&mut self, doing: &str) -> Result<Share, StudyError> {
        self.begin_part(doing, true)
    }

    fn begin_part(&mut self, doing: &str, heavy: bool) -> Result<Share, StudyError> {
        let share = self.budget.next(heavy);
        self.report(doing).map(|()| share)
    }

    fn report(&mut self, doing: &str) -> Result<(), StudyError> {
        let (part, of) = self.budget.progress();
        if self.progress.at(part, of, doing) {
            Ok(())
        } else {
            Err(StudyError::Interrupted { done: part, of })
        }
    }
}
