//! Verdicts of a sweep as `JUnit` XML.

use std::fmt::Write as _;

use twinrig_campaign::sweep::{RowVerdict, Share, ShareVerdict, SweepResult, SweepVerdict};

use crate::report::junit::escape;
use crate::sweep::table;

/// Returns the document with a test suite of the shares and one of the runs. Where shares are
/// asserted, a run that fails is skipped, as its share is judged instead. While points are missing,
/// shares are skipped.
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
    let missing = result.counts.missing;
    let judged = |share: &Share| match share.verdict {
        // A later run may still decide otherwise.
        _ if missing > 0 => Some(("skipped", format!("{missing} points are missing"))),
        ShareVerdict::Pass => None,
        verdict => Some(("failure", verdict.word().to_owned())),
    };
    let count = |kind: &str| {
        let judged = result.shares.iter().filter_map(judged);
        judged.filter(|(word, _)| *word == kind).count()
    };
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "  <testsuite name=\"{suite}\" tests=\"{}\" failures=\"{}\" errors=\"0\" skipped=\"{}\">",
        result.shares.len(),
        count("failure"),
        count("skipped")
    );
    for share in &result.shares {
        let _ = write!(
            out,
            "    <testcase classname=\"{suite}\" name=\"{}\"",
            escape(&share.of)
        );
        let _ = match judged(share) {
            None => writeln!(out, "/>"),
            Some((kind, reason)) => {
                let message = format!("{reason}: {}", table::share_sentence(share));
                let message = escape(&message);
                writeln!(out, "><{kind} message=\"{message}\"/></testcase>")
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
    let interrupted = result.verdict == SweepVerdict::Interrupted;
    let further = usize::from(interrupted);
    let _ = writeln!(
        out,
        "  <testsuite name=\"{suite}\" tests=\"{}\" failures=\"{failures}\" errors=\"{}\" skipped=\"{skipped}\">",
        result.rows.len() + further,
        counts.error + further
    );
    if interrupted {
        let message = escape(&result.error().unwrap_or_default());
        let _ = writeln!(
            out,
            "    <testcase classname=\"{suite}\" name=\"all runs\"><error message=\"{message}\"/></testcase>"
        );
    }
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
