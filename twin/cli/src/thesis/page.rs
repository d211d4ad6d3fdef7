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
    let counts: Vec<String> = Verdict::ALL
        .into_iter()
        .map(|verdict| (result.count(verdict), verdict.words()))
        .filter(|(count, _)| *count > 0)
        .map(|(count, words)| format!("{count} {words}"))
        .collect();
    let counts = counts.join(", ");
    let _ = writeln!(text, "{counts}. Run times (⏱) are of {}.\n", result.cpu);
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
        Verdict::Contradicted | Verdict::Misprint => format!("**{}**", figure.verdict.words()),
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
