//! Verdicts of a sweep as `JUnit` XML.

use std::fmt::Write as _;

use twinrig_campaign::sweep::{RowVerdict, Share, ShareVerdict, SweepResult};

use crate::report::junit::escape;
use crate::sweep::table;

/// Returns the document with a test suite of the shares and one of the runs. Where shares are
/// asserted, a run that fails is skipped, as its share is what is judged.
pub(crate) fn document(result: &SweepResult) -> String {
    let mut out =
        String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"twinrig\">\n");
    if !result.shares.is_empty() {
        shares(&mut out, result);
    }
    runs(&mut out, result);
    out.push_str("</testsuites>\n");
    out
}

fn shares(out: &mut String, result: &SweepResult) {
    let suite = escape(&format!("{}: shares", result.name));
    let failed = |share: &&Share| share.verdict != ShareVerdict::Pass;
    let failures = result.shares.iter().filter(failed).count();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "  <testsuite name=\"{suite}\" tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"0\">",
        result.shares.len()
    );
    for share in &result.shares {
        let _ = write!(
            out,
            "    <testcase classname=\"{suite}\" name=\"{}\"",
            escape(&share.of)
        );
        let _ = match share.verdict {
            ShareVerdict::Pass => writeln!(out, "/>"),
            verdict => {
                let message = format!("{}: {}", verdict.word(), table::share_sentence(share));
                let message = escape(&message);
                writeln!(out, "><failure message=\"{message}\"/></testcase>")
            }
        };
    }
    out.push_str("  </testsuite>\n");
}

fn runs(out: &mut String, result: &SweepResult) {
    let suite = escape(&result.name);
    let judged = result.shares.is_empty();
    let counts = &result.counts;
    let (failures, skipped) = if judged {
        (counts.fail, 0)
    } else {
        (0, counts.fail)
    };
    let _ = writeln!(
        out,
        "  <testsuite name=\"{suite}\" tests=\"{}\" failures=\"{failures}\" errors=\"{}\" skipped=\"{skipped}\">",
        result.rows.len(),
        counts.error
    );
    for row in &result.rows {
        let name = escape(&row.name);
        let _ = write!(out, "    <testcase classname=\"{suite}\" name=\"{name}\"");
        let kind = if judged { "failure" } else { "skipped" };
        let _ = match row.row.verdict {
            RowVerdict::Pass => writeln!(out, "/>"),
            RowVerdict::Fail => {
                let message = format!("{}; {}", row.row.reason(), row.command);
                let message = escape(&message);
                writeln!(out, "><{kind} message=\"{message}\"/></testcase>")
            }
            RowVerdict::Error => {
                let error = row.row.error.as_deref().unwrap_or_default();
                let first = error.lines().next().unwrap_or_default();
                let text = format!("{error}\n{}", row.command);
                let (first, text) = (escape(first), escape(&text));
                writeln!(out, "><error message=\"{first}\">{text}</error></testcase>")
            }
        };
    }
    out.push_str("  </testsuite>\n");
}
