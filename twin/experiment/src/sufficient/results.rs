//! Results of the search of the cheapest sufficient twin.

use serde::{Serialize, Serializer};

use super::Candidate;
use super::rule::{Deviation, ReferenceMargin};
use twinrig_rig::MethodSetting;

/// Result of a search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sufficiency {
    /// Number of starts of each candidate.
    pub starts: usize,
    /// Reference.
    pub reference: ReferenceRuns,
    /// Margins of the reference.
    pub margins: Vec<ReferenceMargin>,
    /// Candidates: the scenario's own first, then in the order of the search.
    pub rows: Vec<CandidateRow>,
    /// Index of the cheapest sufficient candidate; none if none is sufficient and cheaper than the
    /// reference.
    pub chosen: Option<usize>,
    /// Sum of the computation times of all runs \[s\].
    pub spent_s: f64,
}

/// Reference and its check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceRuns {
    /// Reference.
    pub reference: Candidate,
    /// Check.
    pub check: Candidate,
    /// Shortest computation time of the reference per simulated second.
    pub run_s_per_s: f64,
    /// Names of the expectations about the computation that fail in the reference.
    pub failed_of_computation: Vec<String>,
}

/// A candidate and the verdict about it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidateRow {
    /// Candidate.
    #[serde(flatten)]
    pub candidate: Candidate,
    /// Verdict.
    pub status: CandidateStatus,
    /// Reason for a verdict other than sufficient.
    pub why: Option<String>,
    /// Shortest computation time per simulated second; of sufficient candidates, and of the
    /// scenario's own choice.
    pub run_s_per_s: Option<f64>,
    /// Sum of the work counts of the plant.
    pub work: Option<u64>,
    /// Differences from the reference, in the order of its margins.
    pub deviations: Vec<Deviation>,
}

/// Verdict about a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CandidateStatus {
    /// It answers every expectation.
    Sufficient,
    /// It does not answer an expectation.
    Insufficient,
    /// The scenario cannot have these settings.
    Refused,
    /// Its run ended prematurely.
    Failed,
    /// It takes longer than a sufficient candidate, or than the reference.
    Slower,
    /// It was not run.
    NotRun,
}

impl CandidateRow {
    /// Returns a row without a complete run.
    pub(super) fn without_run(candidate: &Candidate, status: CandidateStatus, why: &str) -> Self {
        Self {
            candidate: candidate.clone(),
            status,
            why: Some(why.to_owned()),
            run_s_per_s: None,
            work: None,
            deviations: Vec::new(),
        }
    }

    /// Returns the deviation with the greatest error as a share of the margin.
    pub fn worst(&self) -> Option<&Deviation> {
        let judged = self.deviations.iter().filter(|one| one.share.is_some());
        judged.max_by(|a, b| {
            let [a, b] = [a, b].map(|one| one.share.unwrap_or_default());
            a.total_cmp(&b)
        })
    }
}

impl Sufficiency {
    /// Returns the row of the choice.
    pub fn choice(&self) -> Option<&CandidateRow> {
        self.rows.get(self.chosen?)
    }

    /// Returns the row of the scenario's own choice.
    pub fn own(&self) -> Option<&CandidateRow> {
        self.rows.first()
    }

    /// Returns by which factor the scenario's own choice, and the reference, take longer than the
    /// choice; none without a choice, or where the own one is not sufficient.
    pub fn savings(&self) -> [Option<f64>; 2] {
        let Some(chosen) = self.choice().and_then(|row| row.run_s_per_s) else {
            return [None; 2];
        };
        let own = self
            .own()
            .filter(|row| row.status == CandidateStatus::Sufficient);
        let own = own.and_then(|row| row.run_s_per_s);
        [own, Some(self.reference.run_s_per_s)].map(|time| Some(time? / chosen))
    }
}

impl Serialize for Candidate {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Written<'a> {
            plant: &'a str,
            constraints: Option<&'a str>,
            method: Option<&'a str>,
            step_s: Option<f64>,
            tolerance: Option<f64>,
            settings: &'a [[String; 2]],
        }
        Written {
            plant: &self.plant.name,
            constraints: self.plant.constraints.as_deref(),
            method: self.method.as_deref(),
            step_s: self.setting.and_then(MethodSetting::step_s),
            tolerance: self.setting.and_then(MethodSetting::tolerance),
            settings: &self.settings,
        }
        .serialize(serializer)
    }
}
