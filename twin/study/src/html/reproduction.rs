//! Section of a page with the data that repeat a study.

use twinrig_report::html::element::{element, escaped};

/// Terms and their values, in order.
#[derive(Default)]
pub(super) struct Reproduction {
    html: String,
}

impl Reproduction {
    /// Adds a value that is printed as code: a file, a command, a hash.
    pub(super) fn code(&mut self, name: &str, value: &str) {
        self.value(name, &element("code", "", &escaped(value)));
    }

    /// Adds a value in words.
    pub(super) fn text(&mut self, name: &str, value: &str) {
        self.value(name, &escaped(value));
    }

    fn value(&mut self, name: &str, html: &str) {
        self.html += &element("dt", "", &escaped(name));
        self.html += &element("dd", "", html);
        self.html.push('\n');
    }

    /// Returns the section.
    pub(super) fn section(self) -> String {
        let terms = element("dl", "", &format!("\n{}", self.html));
        format!("<h2>Reproduction</h2>\n{terms}\n")
    }
}
