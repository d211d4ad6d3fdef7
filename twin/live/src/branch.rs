//! Changes of a run on the way, and the scenario that has them.

use std::path::Path;

use twinrig_document::print_quantity;
use twinrig_kernel::{SimTime, Unit};
use twinrig_record::Digest;
use twinrig_rig::Assembly;
use twinrig_rig::scenario_text::{AppendedChange, ScenarioText};
use twinrig_runtime::Change;

use crate::error::LiveError;

/// Change of a process variable in a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Act {
    /// Instant at which the run was when it was made.
    pub made: SimTime,
    /// Control step at which it is applied.
    pub at: SimTime,
    /// Index of the process variable.
    pub variable: usize,
    /// Its new value.
    pub value: f64,
}

/// Value that a variable is to have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    pub(crate) value: f64,
    /// Greatest change per second; none: at once.
    pub(crate) slew: Option<f64>,
}

/// A run: the scenario with acts.
#[derive(Clone, Debug, Default)]
pub struct Branch {
    /// Branch in whose past it began; none: it is the run of the scenario.
    pub parent: Option<usize>,
    /// Instant at which it began.
    pub begin: SimTime,
    /// Changes, in the order in which they were made.
    pub acts: Vec<Act>,
    /// Latest instant that it reached.
    pub reached: SimTime,
    /// Fingerprint of the run up to there.
    pub fingerprint: Option<Digest>,
}

impl Branch {
    /// Returns the instant up to which two branches are the same run.
    pub(crate) fn common(&self, other: &Self) -> SimTime {
        let pairs = self.acts.iter().zip(&other.acts);
        let same = pairs.take_while(|(one, two)| one == two).count();
        let made = |branch: &Self| branch.acts.get(same).map_or(SimTime::MAX, |act| act.made);
        made(self).min(made(other))
    }

    /// Returns the scenario of the branch, for a file in the folder `to`: read again, it has the
    /// changes of the branch. `variables` are names and units.
    pub(crate) fn text(
        &self,
        assembly: &Assembly<'_>,
        variables: &[(String, Unit)],
        to: &Path,
    ) -> Result<String, LiveError> {
        let scenario = assembly.scenario();
        let changes = self.acts.iter().map(|act| {
            let (variable, unit) = &variables[act.variable];
            AppendedChange {
                at: act.at,
                variable,
                to: print_quantity(act.value, *unit),
            }
        });
        let changes: Vec<_> = changes.collect();
        let source = ScenarioText {
            path: Path::new(&scenario.file),
            text: &scenario.text,
            to,
        };
        let count = match changes.len() {
            1 => "1 live change".to_owned(),
            count => format!("{count} live changes"),
        };
        let header = match self.parent {
            None => format!("{}, with {count}.", scenario.file),
            Some(_) => format!(
                "{}, another future from {} on, with {count}.",
                scenario.file, self.begin
            ),
        };
        let text = source.with_changes(&scenario.settings, &changes, &[header])?;
        self.check(assembly, variables, &text, to)?;
        Ok(text)
    }

    /// Checks that a text has the changes of the scenario and those of the branch.
    fn check(
        &self,
        assembly: &Assembly<'_>,
        variables: &[(String, Unit)],
        text: &str,
        folder: &Path,
    ) -> Result<(), LiveError> {
        let file = &assembly.scenario().file;
        let builder = Assembly::builder(assembly.registry());
        let read = builder.text(file, text, folder);
        let read = read.map_err(|error| LiveError::Branch(error.to_string()))?;
        let acts = self.acts.iter().map(|act| {
            let (name, _) = &variables[act.variable];
            (act.at, name.as_str(), Change::To(act.value))
        });
        let mut expected: Vec<_> = assembly.changes().chain(acts).collect();
        expected.sort_by_key(|(at, ..)| *at);
        if read.changes().eq(expected) {
            return Ok(());
        }
        let why = "a change by an amount, later in the scenario, would be another one";
        Err(LiveError::Branch(why.to_owned()))
    }
}
