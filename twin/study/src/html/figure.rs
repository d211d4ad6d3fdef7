//! Figures of a page: plots with heading, legend and caption.

use twinrig_report::html::element::{element, escaped};
use twinrig_report::html::marker::{doubtful_swatch, floor_swatch};
use twinrig_report::html::plot::Plot;

/// Returns a legend of swatches (HTML) and texts.
pub(super) fn legend(entries: &[(String, String)]) -> String {
    let item = |(swatch, text): &(String, String)| {
        let text = element("span", "", &escaped(text));
        element("li", "", &format!("{swatch}{text}"))
    };
    let items: String = entries.iter().map(item).collect();
    element("ul", "legend", &items) + "\n"
}

/// Returns a plot with legend and caption.
pub(super) fn figure(
    heading: &str,
    entries: &[(String, String)],
    plot: &Plot,
    caption: &str,
) -> String {
    let floor = plot.floor_label().map(|text| (floor_swatch(), text));
    let doubtful = plot.has_doubtful().then(|| {
        let text = "contradicts the settings next to it";
        (doubtful_swatch(), text.to_owned())
    });
    let marked = floor.into_iter().chain(doubtful);
    let entries: Vec<_> = entries.iter().cloned().chain(marked).collect();
    drawing(heading, &entries, &plot.svg(), caption)
}

/// Returns an SVG element with legend and caption.
pub(super) fn drawing(
    heading: &str,
    entries: &[(String, String)],
    svg: &str,
    caption: &str,
) -> String {
    let heading = if heading.is_empty() {
        String::new()
    } else {
        element("h3", "", &escaped(heading))
    };
    let legend = if entries.is_empty() {
        String::new()
    } else {
        legend(entries)
    };
    let caption = if caption.is_empty() {
        String::new()
    } else {
        element("figcaption", "", &escaped(caption))
    };
    format!("<figure>{heading}{legend}{svg}{caption}</figure>\n")
}
