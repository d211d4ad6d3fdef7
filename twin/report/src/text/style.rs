//! Styles of text on terminals. Reports are styled always; where standard output shows no styles,
//! they are stripped as the report is printed.

use anstyle::{AnsiColor, Style};
use twinrig_document::escaped;

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

/// Adds a style to text, whose control characters are escaped.
pub fn styled(style: Style, text: &str) -> String {
    with_style(style, &escaped(text))
}

/// Adds a style to text that is harmless.
pub(super) fn with_style(style: Style, text: &str) -> String {
    if text.is_empty() {
        String::new()
    } else {
        format!("{style}{text}{style:#}")
    }
}
