//! Drawings of pages.

/// SVG element, whose texts its author has escaped.
#[derive(Clone, Debug, Default)]
pub struct Drawing(String);

impl Drawing {
    /// Takes an SVG element.
    pub fn of_svg(svg: String) -> Self {
        Self(svg)
    }

    /// Returns the element.
    pub fn svg(&self) -> &str {
        &self.0
    }
}
