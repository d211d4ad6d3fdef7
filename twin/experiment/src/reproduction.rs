//! Data that repeat a study, for the last section of its page.

use twinrig_report::page::Term;

use crate::machine::Machine;
use crate::measured::Starts;

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

/// Runs that the budget of a study ended, and the budget.
pub(crate) struct Budgeted {
    /// Names of the runs.
    pub(crate) cut: Vec<String>,
    /// Budget \[s\].
    pub(crate) budget_s: f64,
}

/// Returns the entries of a study that measures run times on one processor, in these starts and
/// with this budget.
pub(crate) fn timed_reproduction(
    machine: &Machine,
    command: &str,
    file: &str,
    definitions: Vec<Term>,
    left_out: &[String],
    (starts, budget): (&Starts, &Budgeted),
) -> Vec<Term> {
    let machine = starts.machine(machine);
    let load = machine.load.map_or(String::new(), |load| {
        let shared = if load > 1.0 {
            ", so other programs shared the processors"
        } else {
            ""
        };
        format!("; load {load:.2} at the start of the study{shared}")
    });
    let cores = format!("{}, of which a study uses one{load}", machine.cores);
    let mut terms = vec![
        Term::code("command", command),
        Term::code("scenario", file),
        Term::text("machine", format!("{}, {}", machine.cpu, machine.system)),
        Term::text("cores", cores),
        Term::text("build", &machine.build),
    ];
    terms.extend(
        starts
            .sentence()
            .map(|sentence| Term::text("starts", sentence)),
    );
    terms.extend(definitions);
    terms.extend(left_out.iter().map(|left| Term::text("left out", left)));
    let Budgeted { cut, budget_s } = budget;
    let cut = if cut.is_empty() {
        format!("nothing was cut; the budget was {budget_s} s")
    } else {
        format!("for a budget of {budget_s} s: {}", cut.join(", "))
    };
    terms.push(Term::text("cut", cut));
    terms
}
