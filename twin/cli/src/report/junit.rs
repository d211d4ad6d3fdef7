//! Verdicts as `JUnit` XML, for CI systems.

use std::fmt::Write as _;

use twinrig_scenario::Verdict;

use crate::report::table;
use crate::report::{Line, Report};

/// Returns the document with one test suite per scenario and one test case per expectation.
pub fn document(reports: &[Report]) -> String {
    let mut out =
        String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"twinrig\">\n");
    for report in reports {
        suite(&mut out, report);
    }
    out.push_str("</testsuites>\n");
    out
}

fn suite(out: &mut String, report: &Report) {
    let lines = &report.expectations;
    let failed = lines.iter().filter(|line| !line.holds()).count();
    let excused = |line: &&Line| line.holds() && line.outcome.verdict == Verdict::Unobserved;
    let skipped = lines.iter().filter(excused).count();
    let errors = usize::from(report.error.is_some());
    let suite = escape(&report.scenario);
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "  <testsuite name=\"{suite}\" tests=\"{}\" failures=\"{failed}\" errors=\"{errors}\" skipped=\"{skipped}\" time=\"{:.6}\">",
        lines.len() + errors,
        report.wall_s.unwrap_or(0.0),
    );
    for line in lines {
        let name = escape(&line.outcome.name);
        let _ = write!(out, "    <testcase classname=\"{suite}\" name=\"{name}\"");
        let message = escape(&table::line_sentence(line));
        let _ = match (line.outcome.verdict, line.holds()) {
            (Verdict::Pass, true) => writeln!(out, "/>"),
            (_, true) => writeln!(out, "><skipped message=\"{message}\"/></testcase>"),
            (_, false) => writeln!(out, "><failure message=\"{message}\"/></testcase>"),
        };
    }
    if let Some(error) = &report.error {
        let _ = writeln!(
            out,
            "    <testcase classname=\"{suite}\" name=\"runs to its end\"><error message=\"{}\">{}</error></testcase>",
            escape(error.lines().next().unwrap_or_default()),
            escape(error)
        );
    }
    out.push_str("  </testsuite>\n");
}

/// Escapes the five special characters of XML and replaces characters that XML does not allow.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&apos;"),
            '\n' => out.push_str("&#10;"),
            '\t' => out.push_str("&#9;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_and_invalid_characters_are_escaped() {
        assert_eq!(
            escape("a < b & \"c\"\n\u{1}"),
            "a &lt; b &amp; &quot;c&quot;&#10;\u{fffd}"
        );
    }
}
