//! An SVG document under construction. Coordinates are pixels of the page, y down.

use std::fmt::Write as _;

use twinrig_document::escape_xml;

/// Point of the page \[px\].
pub(super) type Px = [f64; 2];

/// Height of text \[px\].
pub(super) const TEXT: f64 = 12.0;
/// Distance of lines of text \[px\].
pub(super) const LINE: f64 = 18.0;
/// Advance of a character of the fixed-width fonts, as a share of the height: 0.600 to 0.602.
const ADVANCE: f64 = 0.61;
/// Height of the characters above and below the base line, as shares of the height of text.
const ASCENT: f64 = 0.95;
const DESCENT: f64 = 0.25;

/// Styles of all elements. Lines keep their width at every size of the page.
const STYLE: &str = "\
text{font:12px 'DejaVu Sans Mono',Menlo,Consolas,monospace;fill:#222}\
.title{font-weight:bold}\
.page{fill:#fff}\
.segment{stroke:#1f4e79;stroke-width:5;stroke-linecap:round;fill:none}\
.toe{stroke:#1f4e79;stroke-width:3;stroke-linecap:round;fill:none}\
.spring{stroke:#c0392b;stroke-width:1.5;fill:none}\
.cable{stroke:#7a7a00;stroke-width:1.2;stroke-dasharray:6 3;fill:none}\
.pulley{stroke:#7a7a00;stroke-width:1.2;fill:none}\
.joint{fill:#fff;stroke:#1f4e79;stroke-width:2}\
.pin{fill:#c0392b}\
.trunk{fill:#dfe8f1;stroke:#1f4e79;stroke-width:1.5}\
.ground{stroke:#555;stroke-width:1.5}\
.dimension{stroke:#555;stroke-width:1;fill:none}\
.leader{stroke:#aaa;stroke-width:0.7}\
.anchor{fill:#777}\
.frame{stroke:#ccc;stroke-width:1;fill:none}";

/// Rectangle of the page: left, top, right, bottom \[px\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rect {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Rect {
    pub fn new(left: f64, top: f64, width: f64, height: f64) -> Self {
        let (right, bottom) = (left + width, top + height);
        Self {
            left,
            top,
            right,
            bottom,
        }
    }

    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }
}

/// Returns the width of a text \[px\].
pub(super) fn text_width(text: &str) -> f64 {
    text.chars().count() as f64 * ADVANCE * TEXT
}

/// Returns a text of at most `most` characters, the end replaced by `…`.
pub(super) fn truncated(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let kept = text.chars().take(most.saturating_sub(1));
    kept.chain(['…']).collect()
}

/// Elements of a page.
#[derive(Default)]
pub(super) struct Canvas {
    text: String,
    labels: Vec<Rect>,
}

impl Canvas {
    /// Begins a group with an identifier and further attributes.
    pub fn begin(&mut self, id: &str, attributes: &[(&str, String)]) {
        // Writing to a string cannot fail.
        let _ = write!(self.text, "<g id=\"{}\"", escape_xml(id));
        for (key, value) in attributes {
            let _ = write!(self.text, " {key}=\"{}\"", escape_xml(value));
        }
        self.text.push_str(">\n");
    }

    /// Ends a group.
    pub fn end(&mut self) {
        self.text.push_str("</g>\n");
    }

    pub fn line(&mut self, class: &str, points: &[Px]) {
        let points: Vec<_> = points
            .iter()
            .map(|[x, y]| format!("{x:.3},{y:.3}"))
            .collect();
        let _ = writeln!(
            self.text,
            "<polyline class=\"{class}\" points=\"{}\"/>",
            points.join(" ")
        );
    }

    pub fn circle(&mut self, class: &str, [x, y]: Px, radius: f64) {
        let _ = writeln!(
            self.text,
            "<circle class=\"{class}\" cx=\"{x:.3}\" cy=\"{y:.3}\" r=\"{radius:.3}\"/>"
        );
    }

    pub fn rectangle(&mut self, class: &str, rect: Rect) {
        let _ = writeln!(
            self.text,
            "<rect class=\"{class}\" x=\"{:.3}\" y=\"{:.3}\" width=\"{:.3}\" height=\"{:.3}\"/>",
            rect.left,
            rect.top,
            rect.width(),
            rect.height()
        );
    }

    /// Adds a text whose base line begins at a point.
    pub fn label(&mut self, class: &str, [x, y]: Px, text: &str) {
        let _ = writeln!(
            self.text,
            "<text class=\"{class}\" x=\"{x:.3}\" y=\"{y:.3}\">{}</text>",
            escape_xml(text)
        );
        let (ascent, height) = (ASCENT * TEXT, (ASCENT + DESCENT) * TEXT);
        self.labels
            .push(Rect::new(x, y - ascent, text_width(text), height));
    }

    /// Adds a line with ticks at its ends.
    pub fn dimension(&mut self, from: Px, to: Px) {
        const TICK: f64 = 4.0;
        let (x, y) = (to[0] - from[0], to[1] - from[1]);
        let length = libm::hypot(x, y).max(1e-9);
        let tick = [-y / length * TICK, x / length * TICK];
        self.line("dimension", &[from, to]);
        for [x, y] in [from, to] {
            let ends = [[x - tick[0], y - tick[1]], [x + tick[0], y + tick[1]]];
            self.line("dimension", &ends);
        }
    }

    /// Returns the document, and the boxes of its texts for tests.
    pub fn finish(self, title: &str, width: f64, height: f64) -> Page {
        let text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\">\n<title>{}</title>\n<style>{STYLE}</style>\n\
             <rect class=\"page\" width=\"{width:.0}\" height=\"{height:.0}\"/>\n{}</svg>\n",
            escape_xml(title),
            self.text
        );
        Page {
            text,
            labels: self.labels,
            size: [width, height],
        }
    }
}

/// A finished document.
pub(crate) struct Page {
    /// The SVG file.
    pub text: String,
    /// Boxes of all texts.
    #[cfg_attr(not(test), expect(dead_code, reason = "tests look for overlaps"))]
    pub(super) labels: Vec<Rect>,
    /// Width and height \[px\].
    #[cfg_attr(not(test), expect(dead_code, reason = "tests look for texts outside"))]
    pub(super) size: [f64; 2],
}
