//! Elements of an XML document, one a line, indented by depth.

use std::fmt::Write as _;

use twinrig_document::escape_xml;

/// A document under construction.
pub(crate) struct Xml {
    text: String,
    open: Vec<&'static str>,
}

impl Xml {
    pub(crate) fn new() -> Self {
        Self {
            text: "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned(),
            open: Vec::new(),
        }
    }

    /// Begins an element.
    pub(crate) fn begin(&mut self, name: &'static str, attributes: &[(&str, &str)]) {
        self.tag(name, attributes, ">");
        self.open.push(name);
    }

    /// Ends the innermost element that has begun.
    pub(crate) fn end(&mut self) {
        if let Some(name) = self.open.pop() {
            // Writing to a string cannot fail.
            let _ = writeln!(self.text, "{}</{name}>", self.indent());
        }
    }

    /// Adds an element without content.
    pub(crate) fn leaf(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.tag(name, attributes, "/>");
    }

    /// Ends all elements and returns the document.
    pub(crate) fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.end();
        }
        self.text
    }

    fn tag(&mut self, name: &str, attributes: &[(&str, &str)], end: &str) {
        let _ = write!(self.text, "{}<{name}", self.indent());
        for (key, value) in attributes {
            let _ = write!(self.text, " {key}=\"{}\"", escape_xml(value));
        }
        let _ = writeln!(self.text, "{end}");
    }

    fn indent(&self) -> String {
        "  ".repeat(self.open.len())
    }
}

/// Returns a number as XML has it, which reads back to the same bits.
pub(crate) fn number(value: f64) -> String {
    format!("{value:?}")
}
