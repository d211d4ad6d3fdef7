//! Colour for terminals, and for nothing else.

use std::io::IsTerminal;

/// Puts colour around a text, or leaves it alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Paint {
    on: bool,
}

impl Paint {
    /// No colour at all.
    pub const PLAIN: Self = Self { on: false };

    /// Colour if `stream` is a terminal that shows it and nobody asked for none (<https://no-color.org>).
    pub fn of(stream: &impl IsTerminal) -> Self {
        let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|value| value == "dumb");
        Self {
            on: stream.is_terminal() && !refused && !dumb,
        }
    }

    fn with(self, code: &str, text: &str) -> String {
        if self.on && !text.is_empty() {
            format!("\x1b[{code}m{text}\x1b[0m")
        } else {
            text.to_owned()
        }
    }

    /// What is good.
    pub fn green(self, text: &str) -> String {
        self.with("32", text)
    }

    /// What is wrong.
    pub fn red(self, text: &str) -> String {
        self.with("1;31", text)
    }

    /// What wants a second look.
    pub fn yellow(self, text: &str) -> String {
        self.with("33", text)
    }

    /// What stands out.
    pub fn bold(self, text: &str) -> String {
        self.with("1", text)
    }

    /// What stands back.
    pub fn dim(self, text: &str) -> String {
        self.with("2", text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_paint_is_no_paint() {
        assert_eq!(Paint::PLAIN.red("no"), "no");
        assert_eq!(Paint { on: true }.red("no"), "\x1b[1;31mno\x1b[0m");
        assert_eq!(Paint { on: true }.dim(""), "");
    }
}
