//! Figures of a page: plots with heading, legend and caption.

use twinrig_report::html::plot::Plot;
use twinrig_report::page::{Figure, Swatch};

/// Returns the swatch of a curve: dashed if of a method with error control.
pub(crate) fn curve_swatch(number: usize, is_adaptive: bool) -> Swatch {
    if is_adaptive {
        Swatch::Dashed(number)
    } else {
        Swatch::Curve(number)
    }
}

/// Returns a plot with legend and caption.
pub(crate) fn figure(
    heading: &str,
    legend: Vec<(Swatch, String)>,
    plot: &Plot,
    caption: impl Into<String>,
) -> Figure {
    Figure {
        heading: heading.to_owned(),
        legend,
        drawing: plot.drawing(),
        caption: caption.into(),
    }
    .with_marks(plot)
}
