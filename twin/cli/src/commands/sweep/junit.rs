//! Verdicts of a sweep as `JUnit` XML.

use twinrig_campaign::sweep::{
    CompleteRow, RowVerdict, Share, ShareVerdict, StoreError, SweepResult, SweepVerdict,
};
use twinrig_experiment::{SweepRows, share_sentence};

use crate::report::junit::{Case, CaseProblem, ProblemKind, Suite, written};

/// Returns the document with a test suite of the shares and one of the runs. Where shares are
/// asserted, a run that fails is skipped, as its share is judged instead. While points are missing,
/// shares are skipped.
pub(crate) fn document(result: &SweepResult, rows: &mut SweepRows) -> Result<String, StoreError> {
    let shares = (!result.shares.is_empty()).then(|| shares(result));
    let runs = runs(result, rows)?;
    let suites: Vec<Suite> = shares.into_iter().chain([runs]).collect();
    Ok(written(&suites))
}

fn suite(name: String, cases: Vec<Case>) -> Suite {
    Suite {
        name,
        properties: Vec::new(),
        time_s: 0.0,
        cases,
        output: String::new(),
    }
}

fn shares(result: &SweepResult) -> Suite {
    let missing = result.counts.missing;
    let judged = |share: &Share| match share.verdict {
        // A later run may still decide otherwise.
        _ if missing > 0 => Some((
            ProblemKind::Skipped,
            format!("{missing} points are missing"),
        )),
        ShareVerdict::Pass => None,
        verdict => Some((ProblemKind::Failure, verdict.word().to_owned())),
    };
    let case = |share: &Share| match judged(share) {
        None => Case::passed(share.of.as_str()),
        Some((kind, reason)) => {
            let message = format!("{reason}: {}", share_sentence(share));
            let problem = CaseProblem {
                kind,
                of_type: "share".to_owned(),
                text: message.clone(),
                message,
            };
            Case::of(share.of.as_str(), problem)
        }
    };
    let name = format!("{}: shares", result.name);
    suite(name, result.shares.iter().map(case).collect())
}

fn runs(result: &SweepResult, rows: &mut SweepRows) -> Result<Suite, StoreError> {
    let kind = if result.shares.is_empty() {
        ProblemKind::Failure
    } else {
        ProblemKind::Skipped
    };
    let mut cases = Vec::new();
    if result.verdict == SweepVerdict::Interrupted {
        let message = result.error().unwrap_or_default();
        let problem = CaseProblem {
            kind: ProblemKind::Error,
            of_type: "sweep".to_owned(),
            text: message.clone(),
            message,
        };
        cases.push(Case::of("all runs", problem));
    }
    for row in &result.rows {
        let name = result.name_of(row);
        if row.summary.verdict == RowVerdict::Pass {
            cases.push(Case::passed(name));
            continue;
        }
        let CompleteRow { command, row } = rows.read(result, row)?;
        cases.push(match row.verdict {
            RowVerdict::Pass => Case::passed(name),
            RowVerdict::Fail => {
                let message = format!("{}; {command}", row.reason());
                let problem = CaseProblem {
                    kind,
                    of_type: "run".to_owned(),
                    text: message.clone(),
                    message,
                };
                Case::of(name, problem)
            }
            RowVerdict::Error => {
                let error = row.error.as_deref().unwrap_or_default();
                let problem = CaseProblem {
                    kind: ProblemKind::Error,
                    of_type: "run".to_owned(),
                    message: error.lines().next().unwrap_or_default().to_owned(),
                    text: format!("{error}\n{command}"),
                };
                Case::of(name, problem)
            }
        });
    }
    Ok(suite(result.name.clone(), cases))
}
