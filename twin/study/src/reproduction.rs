//! Data that repeat a study, for the last section of its page.

use twinrig_report::page::Term;

use crate::machine::Machine;

/// Returns the entries of a study without a budget, on all processors.
pub(crate) fn reproduction(
    machine: &Machine,
    command: &str,
    files: &[String],
    definitions: Vec<Term>,
    left_out: &[String],
) -> Vec<Term> {
    let Machine {
        cpu,
        system,
        cores,
        build,
        ..
    } = machine;
    let mut terms = vec![Term::code("command", command)];
    terms.extend(files.iter().map(|file| Term::code("scenario", file)));
    terms.push(Term::text(
        "machine",
        format!("{cpu}, {system}, {cores} cores"),
    ));
    terms.push(Term::text("build", build));
    terms.extend(definitions);
    terms.extend(left_out.iter().map(|left| Term::text("left out", left)));
    terms
}
