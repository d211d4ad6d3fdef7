//! Styles of text on terminals. Reports are styled always; where standard output shows no styles,
//! they are stripped as the report is printed.

use anstyle::{AnsiColor, Style};

/// Style of success.
pub const GREEN: Style = AnsiColor::Green.on_default();
/// Style of failure.
pub const RED: Style = AnsiColor::Red.on_default().bold();
/// Style of a warning.
pub const YELLOW: Style = AnsiColor::Yellow.on_default();
/// Style of emphasis.
pub const BOLD: Style = Style::new().bold();
/// Style of secondary information.
pub const DIM: Style = Style::new().dimmed();

/// Adds a style to text.
pub fn styled(style: Style, text: &str) -> String {
    if text.is_empty() {
        String::new()
    } else {
        format!("{style}{text}{style:#}")
    }
}

#[cfg(test)]
mod tests {
    use anstream::adapter::strip_str;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn stripping_restores_the_text(text in "[\\PC\n]{0,40}") {
            for style in [Style::new(), GREEN, RED, YELLOW, BOLD, DIM] {
                let styled = styled(style, &text);
                prop_assert_eq!(styled == text, style.is_plain() || text.is_empty());
                prop_assert_eq!(strip_str(&styled).to_string(), &*text);
            }
        }
    }
}
