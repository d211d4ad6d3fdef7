//! The generated parts of the documentation.

use std::fmt::Write as _;

use crate::thesis::result::{FigureResult, ThesisResult};
use crate::thesis::verdict::Verdict;

/// Marks around the generated parts of the page: the numbers of verdicts and the table.
pub(crate) const MARKS: [(&str, &str); 2] = [
    ("<!-- counts -->\n", "<!-- end of counts -->"),
    ("<!-- results -->\n", "<!-- end -->"),
];

/// Returns the numbers of verdicts.
pub(crate) fn counts(result: &ThesisResult) -> String {
    let counts: Vec<String> = Verdict::ALL
        .into_iter()
        .map(|verdict| (result.count(verdict), verdict.words()))
        .filter(|(count, _)| *count > 0)
        .map(|(count, words)| format!("{count} {words}"))
        .collect();
    let figures: usize = result.items.iter().map(|item| item.figures.len()).sum();
    format!("Of {figures} figures: {}.\n", counts.join(", "))
}

/// Returns the table of all results in Markdown.
pub(crate) fn table(result: &ThesisResult) -> String {
    let mut text = format!("Run times (⏱) are of {}.\n\n", result.cpu);
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
