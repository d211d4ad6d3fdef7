//! Page of a study of precision or stability.

use twinrig_report::page::{Page, Term};

use super::{precision, rows, stability};
use crate::machine::Machine;
use crate::plants::study::{Study, StudyKind};
use crate::reproduction::{Budgeted, timed_reproduction};

impl Study {
    /// Returns the page, with the machine the study ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let (title, blocks) = match self.kind {
            StudyKind::Precision => ("Error against run time", precision::blocks(self)),
            StudyKind::Stability => ("The largest stable step", stability::blocks(self)),
        };
        Page {
            kind: format!("Study of {}", self.kind.name()),
            title: format!("{title}: {}", self.scenario),
            headline: self.headline(),
            blocks,
            terms: self.terms(machine, command),
        }
    }

    fn terms(&self, machine: &Machine, command: &str) -> Vec<Term> {
        let criteria = self.criteria.iter();
        let criteria = criteria.map(|(name, text)| Term::text(name, text));
        let panics = self.panics.iter().map(|panic| Term::text("panic", panic));
        let cut = self
            .cut()
            .map(|row| format!("{} {} {}", row.plant, row.method, rows::setting(row)));
        let budget = Budgeted {
            cut: cut.collect(),
            budget_s: self.budget_s,
        };
        timed_reproduction(
            machine,
            command,
            &self.file,
            criteria.chain(panics).collect(),
            &self.left_out,
            (&self.starts, &budget),
        )
    }
}
