//! Studies as self-contained HTML pages: no scripts, fonts or network access.

mod constraint_violation;
mod contact;
mod coupling;
mod differences;
mod dominance;
mod ensemble;
mod error_control;
mod estimate;
mod feedback;
mod footsteps;
mod models;
mod modulation;
mod optimization;
mod precision;
mod reproduction;
mod rows;
mod runs;
mod stability;
mod stiffness;
mod sweep;
mod thesis;
mod tolerance;
mod transport;

use crate::machine::Machine;
use crate::reference_note::ReferenceNote;
use crate::study::{Study, StudyKind};

pub use optimization::optimization_page;
use reproduction::Reproduction;
pub use sweep::sweep_page;
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::{STYLE, plot, table};
use twinrig_report::number::{self, si};

/// Returns the page of a study, with the machine it ran on and the command that repeats it.
pub fn html(study: &Study, machine: &Machine, command: &str) -> String {
    let (title, body) = match study.kind {
        StudyKind::Precision => ("Error against run time", precision::body(study)),
        StudyKind::Stability => ("The largest stable step", stability::body(study)),
    };
    let left_out = study.left_out.iter();
    let left_out = left_out.map(|left| ("left out".to_owned(), left.clone()));
    let cut = study
        .cut()
        .map(|row| format!("{} {} {}", row.plant, row.method, rows::setting(row)));
    Page {
        kind: study.kind.name(),
        title,
        scenario: &study.scenario,
        file: &study.file,
        headline: study.headline(),
        body,
        terms: study
            .criteria
            .iter()
            .cloned()
            .chain(left_out)
            .chain(panicked(&study.panics))
            .collect(),
        cut: cut.collect(),
        budget_s: study.budget_s,
    }
    .html(machine, command)
}

/// Returns the panics as terms of a page.
fn panicked(panics: &[String]) -> impl Iterator<Item = (String, String)> {
    panics
        .iter()
        .map(|panic| ("panic".to_owned(), panic.clone()))
}

/// Contents of a page of any study.
struct Page<'a> {
    kind: &'a str,
    title: &'a str,
    scenario: &'a str,
    file: &'a str,
    headline: String,
    /// HTML.
    body: String,
    /// Definitions and omissions.
    terms: Vec<(String, String)>,
    /// Truncated runs.
    cut: Vec<String>,
    budget_s: f64,
}

impl Page<'_> {
    fn html(&self, machine: &Machine, command: &str) -> String {
        document(
            &format!("Study of {}", self.kind),
            &format!("{}: {}", self.title, self.scenario),
            &self.headline,
            &(self.body.clone() + &self.reproduction(machine, command)),
        )
    }

    /// Returns the section on reproduction: machine, definitions and command.
    fn reproduction(&self, machine: &Machine, command: &str) -> String {
        let load = machine.load.map_or(String::new(), |load| {
            format!(
                "; load {load:.2} at the start of the study{}",
                if load > 1.0 {
                    ", so other programs shared the processors"
                } else {
                    ""
                }
            )
        });
        let mut terms = Reproduction::default();
        terms.code("command", command);
        terms.code("scenario", self.file);
        terms.text("machine", &format!("{}, {}", machine.cpu, machine.system));
        let cores = format!("{}, of which a study uses one{load}", machine.cores);
        terms.text("cores", &cores);
        terms.text("build", &machine.build);
        for (name, text) in &self.terms {
            terms.text(name, text);
        }
        let cut = if self.cut.is_empty() {
            format!("nothing was cut; the budget was {} s", self.budget_s)
        } else {
            let cut = self.cut.join(", ");
            format!("for a budget of {} s: {cut}", self.budget_s)
        };
        terms.text("cut", &cut);
        terms.section()
    }
}

/// Returns the section on reproduction of a study without a budget, on all processors.
fn reproduction(
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

/// Returns a page with a heading and a body of HTML.
fn document(kind: &str, title: &str, headline: &str, body: &str) -> String {
    let (title, kind, headline) = (escaped(title), escaped(kind), escaped(headline));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n\
         <header><p class=\"kind\">{kind}</p><h1>{title}</h1>\
         <p class=\"headline\">{headline}</p></header>\n{body}</main>\n</body>\n</html>\n"
    )
}

/// Returns a sentence on the commands.
fn commanded(study: &Study) -> &'static str {
    if study.commanded {
        "The controller's commands were recorded once, in a run of the complete rig, and are \
         replayed to every plant: results differ by the plant, not by the response of a \
         controller."
    } else {
        "The commands are constant: results differ by the plant only."
    }
}

/// Returns the table of references.
fn references(notes: &[ReferenceNote]) -> String {
    let mut table = table::HtmlTable::new(
        "plant | reference | checked by | disagreement, RMS | greatest |",
        3,
    );
    for note in notes {
        let setting = number::method_setting(note.step_s, note.tolerance);
        let of = note.of_plant.as_ref();
        let of = of.map_or(String::new(), |plant| format!("{} ", escaped(plant)));
        let own = note.method.as_ref().map_or("none".to_owned(), |method| {
            format!("{of}{} {setting}", escaped(method))
        });
        let check = note.check.as_ref();
        let by = check.map(|check| {
            let setting = number::method_setting(check.step_s, check.tolerance);
            format!("{} {setting}", escaped(&check.method))
        });
        table.row(
            "",
            vec![
                element("b", "", &escaped(&note.plant.label())),
                own,
                by.unwrap_or_default(),
                check.map_or(String::new(), |check| si(check.disagreement_rms_m, "m")),
                check.map_or(String::new(), |check| si(check.disagreement_max_m, "m")),
                note.why
                    .as_ref()
                    .map_or(String::new(), |why| element("span", "why", &escaped(why))),
            ],
        );
    }
    table.html()
}

/// Returns a legend of swatches (HTML) and texts.
fn legend(entries: &[(String, String)]) -> String {
    let item = |(swatch, text): &(String, String)| {
        let text = element("span", "", &escaped(text));
        element("li", "", &format!("{swatch}{text}"))
    };
    let items: String = entries.iter().map(item).collect();
    element("ul", "legend", &items) + "\n"
}

/// Returns a plot with legend and caption.
fn figure(heading: &str, entries: &[(String, String)], plot: &plot::Plot, caption: &str) -> String {
    let marked = [plot.floor_legend(), plot.doubtful_legend()]
        .into_iter()
        .flatten();
    let entries: Vec<_> = entries.iter().cloned().chain(marked).collect();
    drawing(heading, &entries, &plot.svg(), caption)
}

/// Returns an SVG element with legend and caption.
fn drawing(heading: &str, entries: &[(String, String)], svg: &str, caption: &str) -> String {
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

/// Returns a card: a key figure with its meaning.
fn card(what: &str, value: &str, more: &str) -> String {
    format!(
        "<div class=\"card\"><div class=\"what\">{}</div><div class=\"value\">{}</div><div class=\"more\">{}</div></div>\n",
        escaped(what),
        escaped(value),
        escaped(more)
    )
}

fn introduction(text: &str) -> String {
    paragraph(text)
}
