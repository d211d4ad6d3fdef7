//! Page of a study of precision or stability.

use crate::machine::Machine;
use crate::study::{Study, StudyKind};

use super::page::{Page, panicked};
use super::{precision, rows, stability};

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
