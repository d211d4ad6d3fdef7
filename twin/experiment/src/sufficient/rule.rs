//! The rule by which a candidate is sufficient for an expectation.

use serde::Serialize;
use twinrig_report::number::quantity;

use super::MarginOutcome;
use crate::gait::run::median;

/// Share of the reference's margin below which the error of a candidate must be.
pub(super) const SHARE_MAX: f64 = 0.1;
/// Multiple of the scatter up to which a difference of reference and check is ascribed to it.
const SCATTER_MULTIPLE: f64 = 3.0;
/// Multiple of the allowed error at which one start suffices to refuse a candidate.
const CLEARLY: f64 = 2.0;

/// Criterion by which a candidate is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Equal verdicts from every start, and an error of the median margin below a tenth of the
    /// reference's margin.
    Error,
    /// Equal verdicts from most starts, and overlapping ranges of the margin: the reference itself
    /// scatters by more than a tenth of its margin, so that no candidate could satisfy the rule of
    /// the error.
    Overlap,
    /// Equal verdicts from every start: the reference has no margin.
    Verdict,
}

/// Margin of the reference in an expectation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceMargin {
    /// Name of the expectation.
    pub name: String,
    /// Unit of the margin.
    pub unit: String,
    /// Criterion for candidates.
    pub rule: Rule,
    /// Whether the expectation holds, from most starts.
    pub holds: bool,
    /// Median of the margins.
    pub margin: Option<f64>,
    /// Difference of the greatest and the least margin over the starts.
    pub scatter: f64,
    /// Difference of the medians of reference and check.
    pub uncertainty: f64,
    /// Least and greatest margin of reference and check.
    pub range: [f64; 2],
}

/// Difference of a candidate from the reference in an expectation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Deviation {
    /// Name of the expectation.
    pub name: String,
    /// Median of the candidate's margins.
    pub margin: Option<f64>,
    /// Error of the margin, with the uncertainty of the reference; none where errors are not
    /// judged.
    pub error: Option<f64>,
    /// The error as a share of the reference's margin; infinite for a margin of 0.
    pub share: Option<f64>,
    /// Reason why the candidate is not sufficient; none if it is.
    pub why: Option<String>,
}

/// Returns the margins, if every run has one.
fn margins(outcomes: &[&MarginOutcome]) -> Option<Vec<f64>> {
    outcomes.iter().map(|one| one.margin).collect()
}

fn range(values: &[f64]) -> [f64; 2] {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [least, greatest]
}

/// Returns the verdict of most runs; that of the first decides between equal numbers.
fn verdict(outcomes: &[&MarginOutcome]) -> bool {
    let held = outcomes.iter().filter(|one| one.holds).count();
    match (2 * held).cmp(&outcomes.len()) {
        core::cmp::Ordering::Equal => outcomes.first().is_none_or(|one| one.holds),
        order => order.is_gt(),
    }
}

fn word(holds: bool) -> &'static str {
    if holds { "holds" } else { "fails" }
}

impl ReferenceMargin {
    /// Returns the margin of an expectation from the outcomes of the reference and its check, one
    /// for each start.
    pub(super) fn of(reference: &[&MarginOutcome], check: &[&MarginOutcome]) -> Option<Self> {
        let first = reference.first()?;
        let none = Self {
            name: first.name.clone(),
            unit: first.unit.clone(),
            rule: Rule::Verdict,
            holds: verdict(reference),
            margin: None,
            scatter: 0.0,
            uncertainty: 0.0,
            range: [0.0; 2],
        };
        let (Some(own), Some(other)) = (margins(reference), margins(check)) else {
            return Some(none);
        };
        let [least, greatest] = range(&own);
        let all = range(&[&own[..], &other[..]].concat());
        let (Some(margin), Some(checked)) = (median(own), median(other)) else {
            return Some(none);
        };
        let (scatter, uncertainty) = (greatest - least, (margin - checked).abs());
        let allowed = SHARE_MAX * margin.abs();
        let is_scattered = scatter > allowed
            || (uncertainty > allowed && uncertainty <= SCATTER_MULTIPLE * scatter);
        Some(Self {
            rule: if is_scattered {
                Rule::Overlap
            } else {
                Rule::Error
            },
            margin: Some(margin),
            scatter,
            uncertainty,
            range: all,
            ..none
        })
    }

    /// Returns whether no candidate can have an error below a tenth of the margin, because the
    /// reference is not known that well.
    pub fn is_too_uncertain(&self) -> bool {
        let allowed = SHARE_MAX * self.margin.unwrap_or_default().abs();
        self.rule == Rule::Error && self.uncertainty > 0.0 && self.uncertainty >= allowed
    }

    /// Compares the outcomes of a candidate, one for each start. `is_complete`: all starts are
    /// there; else the candidate is refused only where further starts cannot change that.
    pub(super) fn deviation(&self, found: &[&MarginOutcome], is_complete: bool) -> Deviation {
        let mut deviation = Deviation {
            name: self.name.clone(),
            margin: margins(found).and_then(median),
            error: None,
            share: None,
            why: None,
        };
        match (self.rule, self.margin, margins(found)) {
            (Rule::Error, Some(margin), Some(found_margins)) => {
                self.judge_error(&mut deviation, margin, found_margins, is_complete);
            }
            (Rule::Overlap, _, Some(found_margins)) if is_complete => {
                self.judge_overlap(&mut deviation, verdict(found), &found_margins);
            }
            (Rule::Error, ..) | (Rule::Overlap, _, None) => {
                deviation.why = Some("it is not observed".to_owned());
            }
            // Further starts may overlap.
            (Rule::Overlap | Rule::Verdict, ..) => {}
        }
        if self.rule != Rule::Overlap
            && let Some(start) = found.iter().position(|one| one.holds != self.holds)
        {
            let from = if start == 0 {
                String::new()
            } else {
                format!(" from perturbed start {start}")
            };
            let [found, expected] = [!self.holds, self.holds].map(word);
            deviation.why = Some(format!("it {found}{from}, and {expected} in the reference"));
        }
        deviation
    }

    fn judge_error(
        &self,
        deviation: &mut Deviation,
        margin: f64,
        found: Vec<f64>,
        is_complete: bool,
    ) {
        let allowed = SHARE_MAX * margin.abs();
        let found = median(found).unwrap_or(f64::NAN);
        let error = (found - margin).abs() + self.uncertainty;
        let limit = if is_complete {
            allowed
        } else {
            CLEARLY * allowed + self.scatter
        };
        deviation.error = Some(error);
        deviation.share = Some(if error == 0.0 {
            0.0
        } else {
            error / margin.abs()
        });
        // A margin of 0 allows no error; a value that is not finite is none.
        let is_sufficient = error == 0.0 || error < limit;
        if !is_sufficient {
            deviation.why = Some(format!(
                "error {} of a margin of {}",
                quantity(error, &self.unit),
                quantity(margin.abs(), &self.unit)
            ));
        }
    }

    fn judge_overlap(&self, deviation: &mut Deviation, holds: bool, found: &[f64]) {
        let [least, greatest] = range(found);
        let [low, high] = self.range;
        if holds != self.holds {
            let [found, expected] = [holds, self.holds].map(word);
            let why = format!("it {found} from most starts, and {expected} in the reference");
            deviation.why = Some(why);
        } else if least > high || greatest < low {
            let [least, greatest, low, high] =
                [least, greatest, low, high].map(|value| quantity(value, &self.unit));
            deviation.why = Some(format!(
                "margins {least} … {greatest} do not overlap {low} … {high} of the reference"
            ));
        }
    }
}
