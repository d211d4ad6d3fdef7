//! The table of the documentation.

use std::fmt::Write as _;

use crate::thesis::result::{FigureResult, ThesisResult};
use crate::thesis::verdict::Verdict;

/// Mark before the generated part of the page.
pub(crate) const BEGIN: &str = "<!-- results -->\n";
/// Mark after it.
pub(crate) const END: &str = "<!-- end -->";

/// Returns the table of all results in Markdown, and the numbers of verdicts.
pub(crate) fn table(result: &ThesisResult) -> String {
    let mut text = String::new();
    let count = |verdict| result.count(verdict);
    let _ = writeln!(
        text,
        "{} reproduced, {} refuted, {} not reproducible. Run times (⏱) are of {}.\n",
        count(Verdict::Reproduced),
        count(Verdict::Refuted),
        count(Verdict::NotReproducible),
        result.cpu,
    );
    text.push_str("| item | figure | printed | ours | verdict | ground |\n");
    text.push_str("|---|---|---|---|---|---|\n");
    for item in &result.items {
        for (n, figure) in item.figures.iter().enumerate() {
            let id = match n {
                0 => format!("`{}`", item.id),
                _ => String::new(),
            };
            let _ = writeln!(text, "| {id} {}", row(figure));
        }
    }
    text
}

fn row(figure: &FigureResult) -> String {
    let clock = if figure.timing && figure.ours.is_some() {
        " ⏱"
    } else {
        ""
    };
    let verdict = match figure.verdict {
        Verdict::Refuted => format!("**{}**", figure.verdict.words()),
        verdict => verdict.words().to_owned(),
    };
    format!(
        "| {} ({}) | {} | {}{clock} | {verdict} | {} |",
        figure.quantity,
        figure.place,
        figure.printed,
        figure.ours_text(),
        figure.ground(),
    )
}
