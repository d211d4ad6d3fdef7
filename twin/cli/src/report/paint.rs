//! Colours on terminals.

use std::io::IsTerminal;

/// Adds ANSI colours to text, if enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Paint {
    enabled: bool,
}

impl Paint {
    /// Colours disabled.
    pub const PLAIN: Self = Self { enabled: false };

    /// Enables colours if `stream` is a terminal that supports them and `NO_COLOR` is not set
    /// (<https://no-color.org>).
    pub fn of(stream: &impl IsTerminal) -> Self {
        let disabled = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|value| value == "dumb");
        Self {
            enabled: stream.is_terminal() && !disabled && !dumb,
        }
    }

    fn with(self, code: &str, text: &str) -> String {
        if self.enabled && !text.is_empty() {
            format!("\x1b[{code}m{text}\x1b[0m")
        } else {
            text.to_owned()
        }
    }

    /// Marks success.
    pub fn green(self, text: &str) -> String {
        self.with("32", text)
    }

    /// Marks failure.
    pub fn red(self, text: &str) -> String {
        self.with("1;31", text)
    }

    /// Marks a warning.
    pub fn yellow(self, text: &str) -> String {
        self.with("33", text)
    }

    /// Emphasises text.
    pub fn bold(self, text: &str) -> String {
        self.with("1", text)
    }

    /// Marks secondary information.
    pub fn dim(self, text: &str) -> String {
        self.with("2", text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_added_to_text_only_if_enabled() {
        let colours = Paint { enabled: true };
        assert_eq!(Paint::PLAIN.red("no"), "no");
        assert_eq!(colours.red("no"), "\x1b[1;31mno\x1b[0m");
        assert_eq!(colours.dim(""), "");
    }
}
