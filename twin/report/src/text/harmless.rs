//! Reports without control characters of others.

use twinrig_document::escaped;

use super::grid::MARKS;

/// Sequences of which the styles consist, and their end.
const SEQUENCES: [&str; 6] = [
    "\u{1b}[0m",
    "\u{1b}[1m",
    "\u{1b}[2m",
    "\u{1b}[31m",
    "\u{1b}[32m",
    "\u{1b}[33m",
];

/// Escapes the control characters of a report other than line breaks, styles and the marks of
/// tables, so that no text of others in it moves the cursor.
pub fn harmless(report: &str) -> String {
    let mut out = String::with_capacity(report.len());
    let mut rest = report;
    while let Some(c) = rest.chars().next() {
        let style = SEQUENCES.into_iter().find(|style| rest.starts_with(style));
        let part = style.map_or(c.len_utf8(), str::len);
        let (kept, after) = rest.split_at(part);
        if style.is_some() || MARKS.contains(&c) {
            out.push_str(kept);
        } else {
            out.push_str(&escaped(kept));
        }
        rest = after;
    }
    out
}

#[cfg(test)]
mod tests {
    use anstream::adapter::strip_str;
    use anstyle::Style;
    use proptest::prelude::*;

    use super::*;
    use crate::text::style::{BOLD, DIM, GREEN, RED, YELLOW, styled};

    proptest! {
        #[test]
        fn stripping_restores_the_text(text in "[\\PC\n]{0,40}") {
            for style in [Style::new(), GREEN, RED, YELLOW, BOLD, DIM] {
                let styled = styled(style, &text);
                prop_assert_eq!(styled == text, style.is_plain() || text.is_empty());
                prop_assert_eq!(strip_str(&styled).to_string(), &*text);
                prop_assert_eq!(harmless(&styled), styled);
            }
        }
    }

    #[test]
    fn only_styles_and_marks_remain_of_control_characters() {
        let own = format!("{}\n{}a", styled(RED, "fails\u{1b}[31m"), MARKS[0]);
        let other = "\u{1b}[2K\r\u{0}\u{202e}\u{9b}2J";
        let expected = "\\u{1b}[2K\\u{d}\\u{0}\\u{202e}\\u{9b}2J";
        assert_eq!(
            harmless(&format!("{own}{other}")),
            format!("{own}{expected}")
        );
        assert!(own.contains("fails\\u{1b}[31m"), "{own}");
    }
}
