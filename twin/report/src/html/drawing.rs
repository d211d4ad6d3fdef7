//! Drawings of pages.

use super::element::escaped;

/// Least width on narrow screens, where a drawing scrolls, as a share of its own: so that its
/// letters stay legible.
const LEAST_WIDTH: f64 = 0.7;

/// Begins an SVG element of a size \[px\], with a text for readers that do not see it.
pub fn begin(width: f64, height: f64, label: &str) -> String {
    format!(
        "<svg viewBox=\"0 0 {width} {height:.0}\" style=\"min-width:{:.0}px\" role=\"img\" \
         aria-label=\"{}\">\n",
        LEAST_WIDTH * width,
        escaped(label)
    )
}

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
