//! Verdict and measured value of an expectation.

use serde::Serialize;
use twinrig_document::Place;
use twinrig_kernel::{SimTime, Unit};

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
    /// Position of the expectation in its file.
    pub place: Place,
    /// Key of its claim: `footstep`, `signal`.
    pub subject: &'static str,
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
    /// Where and when the measured value occurred.
    pub witness: Witness,
    /// Details for display: leg, footstep, reason for not being observed. May be empty.
    pub detail: String,
}

/// Observation that decides an expectation: leg, signal, instant and value of the least margin.
/// What a claim does not have is none: a mean has no instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Witness {
    /// Leg.
    pub leg: Option<String>,
    /// Signal.
    pub signal: Option<String>,
    /// Element of a signal with several, counted from 0.
    pub element: Option<usize>,
    /// Instant; of a footstep its touch-down.
    pub at: Option<SimTime>,
    /// Value of the signal at the instant, in the unit of its limits; of a footstep that of the
    /// measure.
    pub value: Option<f64>,
}

impl Witness {
    /// Returns the witness of a leg.
    pub(crate) fn of_leg(leg: &str) -> Self {
        Witness {
            leg: Some(leg.to_owned()),
            ..Witness::default()
        }
    }

    /// Returns the same witness with an instant and a value; values that are not finite are
    /// omitted.
    pub(crate) fn at(self, at: SimTime, value: f64) -> Self {
        Witness {
            at: Some(at),
            value: value.is_finite().then_some(value),
            ..self
        }
    }
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

/// Detail of a signal that is not finite.
const NOT_A_NUMBER: &str = "not a number";
/// Reason why a time is unobserved that the end of the run leaves open.
pub(super) const WITHIN_NOT_OVER: &str = "the observation ended before `within` was over";
/// Part of the detail of a finding of the trunk whose values are angles instead of heights.
pub(super) const TILT: &str = "greatest tilt";

/// An outcome without the data of its expectation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Finding {
    pub verdict: Verdict,
    pub comparison: Option<Comparison>,
    pub first_violation: Option<SimTime>,
    pub witness: Witness,
    /// Index of the element of the samples that the witness is of.
    pub element: Option<usize>,
    pub detail: String,
}

impl Finding {
    /// Returns the finding that nothing was observed, with the reason.
    pub fn unobserved(reason: impl Into<String>) -> Self {
        Finding {
            verdict: Verdict::Unobserved,
            comparison: None,
            first_violation: None,
            witness: Witness::default(),
            element: None,
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
            witness: Witness::default(),
            element: None,
            detail: detail.into(),
        }
    }

    /// Returns the same finding with its witness.
    pub fn seen(self, witness: Witness) -> Self {
        Finding { witness, ..self }
    }

    /// Returns the same finding with an element of the samples as its witness.
    pub fn seen_in(self, element: usize, at: SimTime, value: f64) -> Self {
        Finding {
            element: Some(element),
            witness: Witness::default().at(at, value),
            ..self
        }
    }

    /// Requires `least` observations for a verdict. A violation at a known instant fails with fewer
    /// of them; every other verdict becomes unobserved. What was measured by fewer ones stays,
    /// since a search must not know a value of one side of the bound alone.
    pub fn require_count(self, count: u64, least: u64, noun: &str) -> Self {
        let certain = self.verdict == Verdict::Fail && self.first_violation.is_some();
        if count >= least || certain || self.verdict == Verdict::Unobserved {
            return self;
        }
        Finding {
            comparison: self.comparison.filter(|_| count > 0),
            ..Finding::unobserved(format!("{count} {noun}, and {least} are needed"))
        }
    }

    /// Returns the finding that an observed signal was not finite.
    pub fn not_a_number(at: Option<SimTime>) -> Self {
        Finding {
            verdict: Verdict::Fail,
            comparison: None,
            first_violation: at,
            witness: Witness {
                at,
                ..Witness::default()
            },
            element: None,
            detail: NOT_A_NUMBER.into(),
        }
    }
}

/// Returns the outcome of an expectation with this finding.
pub(super) fn outcome(expectation: &Expectation, finding: Finding) -> Outcome {
    let finite = |value: f64| value.is_finite().then_some(value);
    let numbers = finding.comparison;
    let unit = match expectation.unit() {
        Unit::Meter if finding.detail.contains(TILT) => Unit::Radian,
        unit => unit,
    };
    Outcome {
        name: expectation.name.clone(),
        place: expectation.place.clone(),
        subject: expectation.claim.subject(),
        verdict: finding.verdict,
        optional: expectation.optional,
        measured: numbers.and_then(|numbers| finite(numbers.measured)),
        bound: numbers.and_then(|numbers| finite(numbers.bound)),
        other_bound: numbers.and_then(|numbers| numbers.other),
        unit,
        margin: numbers
            .filter(|_| finding.verdict != Verdict::Unobserved)
            .and_then(|numbers| finite(numbers.margin)),
        first_violation: finding.first_violation,
        witness: finding.witness,
        detail: finding.detail,
    }
}
