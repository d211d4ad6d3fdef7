//! State of a running study of precision, which its parts share.

use crate::measured::Parts;
use crate::plants::precision_plan::PrecisionPlan;
use crate::plants::reference::{RunContext, Trust};
use crate::plants::row::Row;

/// Greatest distance at which a reference and its check are trusted \[m\]: the aimed-for error, and
/// 0.1 mm with ground contact, where impacts make any two methods diverge.
const NEAR_M: f64 = 1e-6;
const NEAR_ON_GROUND_M: f64 = 1e-4;

/// Runs of a study: their environment and plan.
#[derive(Clone, Copy)]
pub(crate) struct Runs<'a> {
    pub(crate) context: RunContext<'a>,
    pub(crate) plan: &'a PrecisionPlan,
}

impl Runs<'_> {
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
}

/// State of a running study.
pub(crate) struct Job<'a> {
    pub(crate) runs: Runs<'a>,
    pub(crate) parts: Parts<'a>,
    pub(crate) rows: Vec<Row>,
}
