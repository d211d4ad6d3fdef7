//! Layout of a page, and its parts that all studies share.

use crate::machine::Machine;
use crate::study::Study;

use super::reproduction::Reproduction;
use twinrig_report::html::STYLE;
use twinrig_report::html::element::{escaped, paragraph};

/// Returns the panics as terms of a page.
pub(super) fn panicked(panics: &[String]) -> impl Iterator<Item = (String, String)> {
    panics
        .iter()
        .map(|panic| ("panic".to_owned(), panic.clone()))
}

/// Contents of a page of any study.
pub(super) struct Page<'a> {
    pub(super) kind: &'a str,
    pub(super) title: &'a str,
    pub(super) scenario: &'a str,
    pub(super) file: &'a str,
    pub(super) headline: String,
    /// HTML.
    pub(super) body: String,
    /// Definitions and omissions.
    pub(super) terms: Vec<(String, String)>,
    /// Truncated runs.
    pub(super) cut: Vec<String>,
    pub(super) budget_s: f64,
}

impl Page<'_> {
    pub(super) fn html(&self, machine: &Machine, command: &str) -> String {
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

/// Returns a page with a heading and a body of HTML.
pub(super) fn document(kind: &str, title: &str, headline: &str, body: &str) -> String {
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
pub(super) fn commanded(study: &Study) -> &'static str {
    if study.commanded {
        "The controller's commands were recorded once, in a run of the complete rig, and are \
         replayed to every plant: results differ by the plant, not by the response of a \
         controller."
    } else {
        "The commands are constant: results differ by the plant only."
    }
}

/// Returns a card: a key figure with its meaning.
pub(super) fn card(what: &str, value: &str, more: &str) -> String {
    format!(
        "<div class=\"card\"><div class=\"what\">{}</div><div class=\"value\">{}</div>\
         <div class=\"more\">{}</div></div>\n",
        escaped(what),
        escaped(value),
        escaped(more)
    )
}

pub(super) fn introduction(text: &str) -> String {
    paragraph(text)
}
