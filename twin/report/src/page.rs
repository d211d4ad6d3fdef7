//! Self-contained HTML pages of typed parts: no caller writes HTML.
//!
//! ```
//! use twinrig_report::page::{Page, Term};
//!
//! let page = Page {
//!     kind: "Study of gaits".to_owned(),
//!     title: "a < b".to_owned(),
//!     terms: vec![Term::code("command", "twin study")],
//!     ..Page::default()
//! };
//! assert!(page.html().contains("<h1>a &lt; b</h1>"));
//! ```

use crate::html::STYLE;
use crate::html::drawing::Drawing;
use crate::html::element::{element, escaped, paragraph};
use crate::html::marker::{doubtful_swatch, floor_swatch, foreign_swatch, swatch};
use crate::html::plot::Plot;
use crate::table::Table;

/// Contents of a page.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// Kind of report, above the title.
    pub kind: String,
    /// Title.
    pub title: String,
    /// Sentence with the result; may be empty.
    pub headline: String,
    /// Parts, in their order.
    pub blocks: Vec<Block>,
    /// Data that repeat the result, definitions and omissions.
    pub terms: Vec<Term>,
}

/// Script of a page, or data of one.
#[derive(Clone, Debug)]
pub enum Script {
    /// Data that a script reads by the identifier of their element.
    Data {
        /// Identifier.
        id: &'static str,
        /// Base64 or JSON, whose `<` is escaped: no text in it ends the script.
        text: String,
    },
    /// Code with the names of the whole page: a library.
    Library(&'static str),
    /// Code with names of its own, executed after the page is parsed.
    Module(String),
}

impl Script {
    fn html(&self) -> String {
        match self {
            Self::Data { id, text } => {
                // Entities are not decoded in scripts.
                let text = text.replace('<', "\\u003c");
                format!("<script type=\"text/plain\" id=\"{id}\">{text}</script>\n")
            }
            Self::Library(code) => format!("<script>\n{code}</script>\n"),
            Self::Module(code) => format!("<script type=\"module\">\n{code}</script>\n"),
        }
    }
}

/// Part of a page.
#[derive(Clone, Debug)]
pub enum Block {
    /// Heading of a section.
    Heading(String),
    /// Heading within a section.
    Subheading(String),
    /// Paragraph.
    Text(String),
    /// Text to be copied, line by line.
    Code(String),
    /// The most important values.
    Cards(Vec<Card>),
    /// Table.
    Table(Table),
    /// Swatches and their meaning, of several figures.
    Legend(Vec<(Swatch, String)>),
    /// Figure over the full width.
    Figure(Figure),
    /// Small figures beside each other.
    Figures(Vec<Figure>),
    /// Part that a script of the page fills.
    Live {
        /// Identifier of the element, and its class.
        id: &'static str,
        /// Description, for readers that do not see it.
        label: &'static str,
    },
}

/// An important value.
#[derive(Clone, Debug)]
pub struct Card {
    what: String,
    value: String,
    more: String,
}

/// Drawing with its legend.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Heading; may be empty.
    pub heading: String,
    /// Swatches and their meaning.
    pub legend: Vec<(Swatch, String)>,
    /// The drawing.
    pub drawing: Drawing,
    /// Text below; may be empty.
    pub caption: String,
}

/// Sample in a legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Swatch {
    /// Curve of this colour.
    Curve(usize),
    /// Dashed curve of this colour.
    Dashed(usize),
    /// Shaded region.
    Region,
    /// Point from another source.
    Foreign,
    /// Point that contradicts its neighbours.
    Doubtful,
    /// None.
    Nothing,
}

impl Swatch {
    fn html(self) -> String {
        match self {
            Self::Curve(number) => swatch(number, false),
            Self::Dashed(number) => swatch(number, true),
            Self::Region => floor_swatch(),
            Self::Foreign => foreign_swatch(),
            Self::Doubtful => doubtful_swatch(),
            Self::Nothing => String::new(),
        }
    }
}

/// Entry of the last section of a page.
#[derive(Clone, Debug)]
pub struct Term {
    name: String,
    value: String,
    is_code: bool,
}

impl Term {
    /// Creates an entry that is printed as code: a file, a command, a hash.
    pub fn code(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            is_code: true,
            ..Self::text(name, value)
        }
    }

    /// Creates an entry in words.
    pub fn text(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value: value.into(),
            is_code: false,
        }
    }

    fn html(&self) -> String {
        let value = escaped(&self.value);
        let value = if self.is_code {
            element("code", "", &value)
        } else {
            value
        };
        let name = element("dt", "", &escaped(&self.name));
        format!("{name}{}\n", element("dd", "", &value))
    }
}

impl Page {
    /// Returns the page.
    pub fn html(&self) -> String {
        self.html_with("", &[])
    }

    /// Returns the page with a style sheet behind that of all pages, and with scripts and their
    /// data at its end, in their order.
    pub fn html_with(&self, style: &str, scripts: &[Script]) -> String {
        let [kind, title, headline] =
            [&self.kind, &self.title, &self.headline].map(|it| escaped(it));
        let blocks: String = self.blocks.iter().map(Block::html).collect();
        let terms: String = self.terms.iter().map(Term::html).collect();
        let terms = element("dl", "", &format!("\n{terms}"));
        let body = format!(
            "<main>\n<header><p class=\"kind\">{kind}</p><h1>{title}</h1>\
             <p class=\"headline\">{headline}</p></header>\n{blocks}\
             <h2>Reproduction</h2>\n{terms}\n</main>\n"
        );
        document(&self.title, style, &body, scripts)
    }
}

/// Returns a document with the style sheet of all pages and another one behind it, a body in HTML,
/// and scripts and their data at its end, in their order.
pub fn document(title: &str, style: &str, body: &str, scripts: &[Script]) -> String {
    let title = escaped(title);
    let scripts: String = scripts.iter().map(Script::html).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}{style}</style>\n</head>\n<body>\n{body}\
         {scripts}</body>\n</html>\n"
    )
}

impl Block {
    /// Creates the heading of a section.
    pub fn heading(text: impl Into<String>) -> Self {
        Self::Heading(text.into())
    }

    /// Creates a heading within a section.
    pub fn subheading(text: impl Into<String>) -> Self {
        Self::Subheading(text.into())
    }

    /// Creates a paragraph.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    fn html(&self) -> String {
        match self {
            Self::Heading(text) => element("h2", "", &escaped(text)) + "\n",
            Self::Subheading(text) => element("h3", "", &escaped(text)) + "\n",
            Self::Text(text) => paragraph(text),
            Self::Code(text) => {
                let lines: Vec<String> = text.lines().map(escaped).collect();
                element("pre", "", &element("code", "", &lines.join("\n")))
            }
            Self::Cards(cards) => {
                let cards: String = cards.iter().map(Card::html).collect();
                element("div", "cards", &cards)
            }
            Self::Table(table) => table.html(),
            Self::Legend(entries) => legend(entries),
            Self::Figure(figure) => figure.html(),
            Self::Figures(figures) => {
                let figures: String = figures.iter().map(Figure::html).collect();
                element("div", "pair", &figures)
            }
            Self::Live { id, label } => {
                let label = escaped(label);
                format!(
                    "<div id=\"{id}\" class=\"{id}\" role=\"group\" aria-label=\"{label}\"></div>\n"
                )
            }
        }
    }
}

impl Card {
    /// Creates a card: a quantity, its value with the unit, and further information.
    pub fn new(what: impl Into<String>, value: impl Into<String>, more: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            value: value.into(),
            more: more.into(),
        }
    }

    fn html(&self) -> String {
        let part = |class: &str, text: &str| element("div", class, &escaped(text));
        let parts = [
            part("what", &self.what),
            part("value", &self.value),
            part("more", &self.more),
        ];
        element("div", "card", &parts.concat()) + "\n"
    }
}

impl Figure {
    /// Adds the marks of a plot to the legend: the shaded region, and contradicting points.
    #[must_use]
    pub fn with_marks(mut self, plot: &Plot) -> Self {
        let floor = plot.floor_label().map(|text| (Swatch::Region, text));
        let doubtful = plot.has_doubtful().then(|| {
            let text = "contradicts the settings next to it";
            (Swatch::Doubtful, text.to_owned())
        });
        self.legend.extend(floor.into_iter().chain(doubtful));
        self
    }

    fn html(&self) -> String {
        let unless_empty = |name: &str, text: &str| match text {
            "" => String::new(),
            text => element(name, "", &escaped(text)),
        };
        let heading = unless_empty("h3", &self.heading);
        let caption = unless_empty("figcaption", &self.caption);
        let legend = legend(&self.legend);
        let svg = self.drawing.svg();
        format!("<figure>{heading}{legend}{svg}{caption}</figure>\n")
    }
}

/// Returns a legend; nothing without entries.
fn legend(entries: &[(Swatch, String)]) -> String {
    let item = |(swatch, text): &(Swatch, String)| {
        let text = element("span", "", &escaped(text));
        element("li", "", &(swatch.html() + &text))
    };
    let items: String = entries.iter().map(item).collect();
    match &*items {
        "" => String::new(),
        items => element("ul", "legend", items) + "\n",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html::plot::{Curve, EndedRun, Look, Mark, Point, Setting};

    #[test]
    fn data_of_scripts_do_not_end_their_element() {
        let data = Script::Data {
            id: "data",
            text: "</script>".to_owned(),
        };
        let html = Page::default().html_with("", &[data]);
        assert_eq!(html.matches("</script>").count(), 1);
    }

    #[test]
    fn each_run_that_ended_early_is_in_one_strip_and_marks_are_in_the_legend() {
        let ended = |title: &str, cut| {
            let title = title.to_owned();
            Setting::Ended(EndedRun { x: 1.0, title, cut })
        };
        let doubtful = Setting::Point(Point {
            x: 1.0,
            y: 1.0,
            title: String::new(),
            look: Look::Doubtful,
        });
        let settings = [doubtful, ended("it fell", false), ended("slow", true)];
        let plot = Plot {
            title: String::new(),
            width: 400.0,
            height: 300.0,
            x_label: String::new(),
            y_label: String::new(),
            curves: vec![Curve::through(0, false, settings)],
            marks: vec![Mark::Below(1.0, "floor".to_owned())],
            shared_y: Vec::new(),
            strip: "failed".to_owned(),
        };
        for title in ["it fell", "slow"] {
            assert_eq!(plot.svg().matches(title).count(), 1, "{title}");
        }
        let legend = Figure::default().with_marks(&plot).legend;
        let swatches: Vec<Swatch> = legend.iter().map(|(swatch, _)| *swatch).collect();
        assert_eq!(swatches, [Swatch::Region, Swatch::Doubtful]);
    }
}
