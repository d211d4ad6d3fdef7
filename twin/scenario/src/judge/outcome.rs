//! What became of an expectation.

use serde::Serialize;
use twinrig_kernel::{SimTime, Unit};

use super::resolve;
use super::trunk::TILT;
use crate::expect::Expectation;
use crate::limits::Comparison;

/// Whether an expectation holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It was observed and holds.
    Pass,
    /// It was observed and does not hold.
    Fail,
    /// The run could not observe it.
    Unobserved,
}

/// What became of one expectation.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The expectation's name.
    pub name: String,
    /// Whether it holds.
    pub verdict: Verdict,
    /// Whether it counts as held if it could not be observed.
    pub optional: bool,
    /// The measured value that is nearest to violating the expectation; none if nothing was observed, or no number.
    pub measured: Option<f64>,
    /// The limit that it is nearest to.
    pub bound: Option<f64>,
    /// The limit on the other side, where there are two.
    pub other_bound: Option<f64>,
    /// The unit of measured, bound and margin.
    pub unit: Unit,
    /// Distance to the limit, negative on its wrong side.
    pub margin: Option<f64>,
    /// When it was first violated, where that has a time.
    pub first_violation: Option<SimTime>,
    /// A few words for a person: which leg, which footstep, why unobserved. May be empty.
    pub detail: String,
}

impl Outcome {
    /// Whether the run may pass with this outcome.
    pub fn holds(&self) -> bool {
        match self.verdict {
            Verdict::Pass => true,
            Verdict::Fail => false,
            Verdict::Unobserved => self.optional,
        }
    }
}

/// An outcome before it has a name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Finding {
    pub verdict: Verdict,
    pub comparison: Option<Comparison>,
    pub first_violation: Option<SimTime>,
    pub detail: String,
}

impl Finding {
    /// Nothing was observed.
    pub fn unobserved(why: impl Into<String>) -> Self {
        Finding {
            verdict: Verdict::Unobserved,
            comparison: None,
            first_violation: None,
            detail: why.into(),
        }
    }

    /// Something was, and compares thus. What is not a number never passes.
    pub fn of(
        comparison: Comparison,
        first_violation: Option<SimTime>,
        detail: impl Into<String>,
    ) -> Self {
        let holds = comparison.margin >= 0.0;
        Finding {
            verdict: if holds { Verdict::Pass } else { Verdict::Fail },
            comparison: Some(comparison),
            first_violation: first_violation.filter(|_| !holds),
            detail: detail.into(),
        }
    }

    /// The same of `count` observations, where fewer than `least` say nothing: a violation that was
    /// seen at an instant is one nevertheless, all else is unobserved.
    pub fn of_few(self, count: u64, least: u64, what: &str) -> Self {
        let certain = self.verdict == Verdict::Fail && self.first_violation.is_some();
        if count >= least || certain || self.verdict == Verdict::Unobserved {
            return self;
        }
        Finding::unobserved(format!("{count} {what}, and {least} are needed"))
    }

    /// A signal that is watched held something that is not a number.
    pub fn not_a_number(at: Option<SimTime>) -> Self {
        Finding {
            verdict: Verdict::Fail,
            comparison: None,
            first_violation: at,
            detail: "not a number".into(),
        }
    }
}

/// The outcome of an expectation of which this was found.
pub(super) fn outcome(expectation: &Expectation, finding: Finding) -> Outcome {
    let finite = |value: f64| value.is_finite().then_some(value);
    let numbers = finding.comparison;
    let unit = match resolve::unit(&expectation.claim) {
        Unit::Meter if finding.detail == TILT => Unit::Radian,
        unit => unit,
    };
    Outcome {
        name: expectation.name.clone(),
        verdict: finding.verdict,
        optional: expectation.optional,
        measured: numbers.and_then(|numbers| finite(numbers.measured)),
        bound: numbers.and_then(|numbers| finite(numbers.bound)),
        other_bound: numbers.and_then(|numbers| numbers.other),
        unit,
        margin: numbers.and_then(|numbers| finite(numbers.margin)),
        first_violation: finding.first_violation,
        detail: finding.detail,
    }
}
