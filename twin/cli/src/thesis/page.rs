//! The generated parts of the documentation.

use crate::thesis::result::ThesisResult;
use crate::thesis::text::results;
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

/// Returns the results in Markdown.
pub(crate) fn table(result: &ThesisResult) -> String {
    let table = results(result).markdown();
    format!("Run times (⏱) are of {}.\n\n{table}", result.cpu)
}
