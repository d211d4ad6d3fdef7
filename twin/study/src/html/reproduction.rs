//! Section of a page with the data that repeat a study.

use crate::machine::Machine;

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

/// Returns the section on reproduction of a study without a budget, on all processors.
pub(super) fn reproduction(
    machine: &Machine,
    command: &str,
    files: &[String],
    definitions: &[(String, String)],
) -> String {
    let mut terms = Reproduction::default();
    terms.code("command", command);
    for file in files {
        terms.code("scenario", file);
    }
    let system = format!(
        "{}, {}, {} cores",
        machine.cpu, machine.system, machine.cores
    );
    terms.text("machine", &system);
    terms.text("build", &machine.build);
    for (name, text) in definitions {
        terms.text(name, text);
    }
    terms.section()
}
