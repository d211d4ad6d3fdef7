//! Rows of a sweep from reports of runs.

use twinrig_campaign::sweep::{ExpectationVerdict, RowExpectation, RowVerdict, SweepRow};
use twinrig_scenario::{Outcome, Verdict};

use super::{Line, Report, Status};

/// Returns the row of a report.
pub fn of_report(report: Report) -> SweepRow {
    SweepRow {
        verdict: match report.verdict {
            Status::Pass => RowVerdict::Pass,
            Status::Fail => RowVerdict::Fail,
            Status::Error => RowVerdict::Error,
        },
        seed: report.seed,
        simulated_s: report.simulated_s,
        fell_at_s: report.fell_at_s,
        fingerprint: report.fingerprint,
        error: report.error,
        expectations: report.expectations.into_iter().map(expectation).collect(),
    }
}

fn expectation(Line { outcome, .. }: Line) -> RowExpectation {
    let holds = outcome.holds();
    let Outcome {
        name,
        verdict,
        measured,
        bound,
        margin,
        unit,
        detail,
        ..
    } = outcome;
    RowExpectation {
        name,
        verdict: match verdict {
            Verdict::Pass => ExpectationVerdict::Pass,
            Verdict::Fail => ExpectationVerdict::Fail,
            Verdict::Unobserved => ExpectationVerdict::Unobserved,
        },
        holds,
        measured,
        bound,
        margin,
        unit: unit.symbol().to_owned(),
        detail,
    }
}
