//! Verdict and measured value of an expectation.

use serde::Serialize;
use twinrig_kernel::{SimTime, Unit};

use super::resolve;
use super::trunk::TILT;
use crate::expect::Expectation;
use crate::limits::Comparison;

/// Verdict of an expectation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Observed and satisfied.
    Pass,
    /// Observed and violated.
    Fail,
    /// Not observable in the run.
    Unobserved,
}

/// Outcome of one expectation.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Name of the expectation.
    pub name: String,
    /// Verdict.
    pub verdict: Verdict,
    /// Whether it counts as satisfied if it is unobserved.
    pub optional: bool,
    /// Measured value with the least margin; none if nothing was observed, or if it is not finite.
    pub measured: Option<f64>,
    /// Limit that it is closest to.
    pub bound: Option<f64>,
    /// Opposite limit, if there are two.
    pub other_bound: Option<f64>,
    /// Unit of measured value, bound and margin.
    pub unit: Unit,
    /// Distance to the limit; negative if it is violated.
    pub margin: Option<f64>,
    /// Time of the first violation, if it has one.
    pub first_violation: Option<SimTime>,
    /// Details for display: leg, footstep, reason for not being observed. May be empty.
    pub detail: String,
}

impl Outcome {
    /// Returns whether the run may pass with this outcome.
    pub fn holds(&self) -> bool {
        match self.verdict {
            Verdict::Pass => true,
            Verdict::Fail => false,
            Verdict::Unobserved => self.optional,
        }
    }
}

/// An outcome without the data of its expectation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Finding {
    pub verdict: Verdict,
    pub comparison: Option<Comparison>,
    pub first_violation: Option<SimTime>,
    pub detail: String,
}

impl Finding {
    /// Returns the finding that nothing was observed, with the reason.
    pub fn unobserved(reason: impl Into<String>) -> Self {
        Finding {
            verdict: Verdict::Unobserved,
            comparison: None,
            first_violation: None,
            detail: reason.into(),
        }
    }

    /// Returns the finding of a comparison. A NaN margin fails.
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

    /// Requires `least` observations for a verdict. A violation at a known instant fails with fewer
    /// of them; every other verdict becomes unobserved.
    pub fn require_count(self, count: u64, least: u64, noun: &str) -> Self {
        let certain = self.verdict == Verdict::Fail && self.first_violation.is_some();
        if count >= least || certain || self.verdict == Verdict::Unobserved {
            return self;
        }
        Finding::unobserved(format!("{count} {noun}, and {least} are needed"))
    }

    /// Returns the finding that an observed signal was not finite.
    pub fn not_a_number(at: Option<SimTime>) -> Self {
        Finding {
            verdict: Verdict::Fail,
            comparison: None,
            first_violation: at,
            detail: "not a number".into(),
        }
    }
}

/// Returns the outcome of an expectation with this finding.
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
