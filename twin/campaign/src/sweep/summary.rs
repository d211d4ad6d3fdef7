//! Summary of the rows of a sweep in memory: all that shares, effects and plots need.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::row::{RowVerdict, SweepRow, VERDICT_SHARE};

/// Summary of a row.
#[derive(Clone, Debug, PartialEq)]
pub struct RowSummary {
    /// Verdict.
    pub verdict: RowVerdict,
    /// Whether an error prevented the run or ended it prematurely.
    pub has_error: bool,
    /// Fingerprint up to the end of the run.
    pub fingerprint: Option<Box<str>>,
    /// Expectations, in the order of the scenario.
    pub expectations: Box<[ExpectationSummary]>,
}

/// Outcome of an expectation.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectationSummary {
    quantity: Arc<Quantity>,
    /// NaN: there is none.
    measured: f64,
    margin: f64,
    /// Whether the run may pass with this outcome.
    pub holds: bool,
}

/// Name and unit of an expectation, which many runs have.
#[derive(Debug, PartialEq)]
struct Quantity {
    name: String,
    unit: String,
}

impl ExpectationSummary {
    /// Returns the name of the expectation.
    pub fn name(&self) -> &str {
        &self.quantity.name
    }

    /// Returns the symbol of the unit of both values.
    pub fn unit(&self) -> &str {
        &self.quantity.unit
    }

    /// Returns the measured value with the least margin.
    pub fn measured(&self) -> Option<f64> {
        (!self.measured.is_nan()).then_some(self.measured)
    }

    /// Returns the distance to the limit; negative if it is violated.
    pub fn margin(&self) -> Option<f64> {
        (!self.margin.is_nan()).then_some(self.margin)
    }
}

impl RowSummary {
    /// Returns whether an expectation, or the run as a whole, holds; none if the run has no such
    /// expectation.
    pub fn holds(&self, of: &str) -> Option<bool> {
        if of == VERDICT_SHARE || self.verdict == RowVerdict::Error {
            return Some(self.verdict == RowVerdict::Pass);
        }
        self.expectation(of).map(|expectation| expectation.holds)
    }

    /// Returns the outcome of an expectation.
    pub fn expectation(&self, name: &str) -> Option<&ExpectationSummary> {
        self.expectations.iter().find(|one| one.name() == name)
    }
}

/// Summarises rows, which share the texts of their expectations.
#[derive(Debug, Default)]
pub struct RowSummaries {
    /// By the name.
    quantities: BTreeMap<String, Vec<Arc<Quantity>>>,
}

impl RowSummaries {
    /// Returns the summary of a row.
    pub fn summary(&mut self, row: SweepRow) -> RowSummary {
        let expectations = row.expectations.into_iter();
        let expectations = expectations.map(|one| ExpectationSummary {
            measured: one.measured.unwrap_or(f64::NAN),
            margin: one.margin.unwrap_or(f64::NAN),
            holds: one.holds,
            quantity: self.quantity(one.name, one.unit),
        });
        RowSummary {
            expectations: expectations.collect(),
            verdict: row.verdict,
            has_error: row.error.is_some(),
            fingerprint: row.fingerprint.map(String::into_boxed_str),
        }
    }

    fn quantity(&mut self, name: String, unit: String) -> Arc<Quantity> {
        let known = self.quantities.get(&name);
        let known = known.and_then(|of_name| of_name.iter().find(|one| one.unit == unit));
        if let Some(known) = known {
            return Arc::clone(known);
        }
        let new = Arc::new(Quantity {
            name: name.clone(),
            unit,
        });
        let of_name = self.quantities.entry(name).or_default();
        of_name.push(Arc::clone(&new));
        new
    }
}
