//! Result of one run.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Name of the share of runs in which all expectations hold.
pub const VERDICT_SHARE: &str = "verdict";

/// Verdict of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RowVerdict {
    /// All expectations hold.
    Pass,
    /// At least one expectation fails.
    Fail,
    /// The run did not complete.
    Error,
}

impl RowVerdict {
    /// Returns the word of reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Error => "error",
        }
    }
}

/// Result of a run: a function of its settings and of the build.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepRow {
    /// Verdict.
    pub verdict: RowVerdict,
    /// Seed of the run; none if it did not start.
    pub seed: Option<u64>,
    /// Simulated time reached \[s\].
    pub simulated_s: Option<f64>,
    /// Time of the fall \[s\].
    pub fell_at_s: Option<f64>,
    /// Fingerprint up to the end of the run.
    pub fingerprint: Option<String>,
    /// Error that prevented the run or ended it prematurely.
    pub error: Option<String>,
    /// Expectations, in the order of the scenario.
    pub expectations: Vec<RowExpectation>,
}

/// Outcome of an expectation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RowExpectation {
    /// Name.
    pub name: String,
    /// Whether it was observed, and satisfied.
    pub verdict: ExpectationVerdict,
    /// Whether the run may pass with this outcome: satisfied, or optional and not observed.
    pub holds: bool,
    /// Measured value with the least margin.
    pub measured: Option<f64>,
    /// Limit that it is closest to.
    pub bound: Option<f64>,
    /// Distance to the limit; negative if it is violated.
    pub margin: Option<f64>,
    /// Symbol of the unit of all three.
    pub unit: String,
    /// Place of the value with the least margin, or the reason for not being observed.
    pub detail: String,
}

/// Verdict of an expectation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ExpectationVerdict {
    /// Observed and satisfied.
    Pass,
    /// Observed and violated.
    Fail,
    /// Not observable in the run.
    Unobserved,
}

impl ExpectationVerdict {
    /// Returns the word of reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Unobserved => "unobserved",
        }
    }
}

impl SweepRow {
    /// Returns the result of a run that did not complete.
    pub fn of_error(error: impl Into<String>) -> Self {
        Self {
            verdict: RowVerdict::Error,
            seed: None,
            simulated_s: None,
            fell_at_s: None,
            fingerprint: None,
            error: Some(error.into()),
            expectations: Vec::new(),
        }
    }

    /// Returns whether an expectation, or the run as a whole, holds; none if the run has no such
    /// expectation.
    pub fn holds(&self, of: &str) -> Option<bool> {
        if of == VERDICT_SHARE || self.verdict == RowVerdict::Error {
            return Some(self.verdict == RowVerdict::Pass);
        }
        self.expectation(of).map(|expectation| expectation.holds)
    }

    /// Returns the outcome of an expectation. A scenario numbers those of equal name, so that names
    /// are unique.
    pub fn expectation(&self, name: &str) -> Option<&RowExpectation> {
        self.expectations.iter().find(|one| one.name == name)
    }

    /// Returns the reason for a run that does not pass: its error, or the names of the expectations
    /// that do not hold.
    pub fn reason(&self) -> String {
        if let Some(error) = &self.error {
            return error.clone();
        }
        let failed = self.expectations.iter().filter(|one| !one.holds);
        let names: Vec<&str> = failed.map(|one| one.name.as_str()).collect();
        names.join(", ")
    }
}

/// Key of a row: the hash of everything that its run depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RowKey([u8; 32]);

impl RowKey {
    /// Returns the key of a run that depends on `parts`, in this order: the build, the texts of all
    /// files, the settings.
    pub fn of<'p>(parts: impl IntoIterator<Item = &'p [u8]>) -> Self {
        let mut hasher = blake3::Hasher::new_derive_key("twinrig row of a sweep, version 1");
        for part in parts {
            // With its length, so that no two lists have the same bytes.
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        Self(*hasher.finalize().as_bytes())
    }

    /// Reads 64 hexadecimal digits.
    pub(super) fn parse(digits: &str) -> Option<Self> {
        let hash = blake3::Hash::from_hex(digits).ok()?;
        // Upper case would be another spelling of the same key.
        (hash.to_hex().as_str() == digits).then_some(Self(*hash.as_bytes()))
    }
}

impl fmt::Display for RowKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        blake3::Hash::from_bytes(self.0).to_hex().fmt(f)
    }
}

impl Serialize for RowKey {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
