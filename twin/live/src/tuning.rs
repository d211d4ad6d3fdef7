//! Process variables of a run, which visitors set, save and recall.

use std::path::Path;

use serde_json::{Value, json};

use crate::live_run::{self, LiveRun};
use crate::request::Request;
use crate::sets::Sets;

/// Folder of the sets of values, in that of the session.
const SETS: &str = "sets";

/// Changes of process variables: their greatest rate, and the named sets of values.
pub(crate) struct Tuning {
    /// Greatest change of a variable, in multiples of its default value per second; 0: at once.
    slew: f64,
    sets: Sets,
}

impl Tuning {
    /// Creates the changes of a session whose files are in a folder.
    pub(crate) fn new(folder: &Path, slew: f64) -> Self {
        Self {
            slew,
            sets: Sets::new(folder.join(SETS)),
        }
    }

    /// Returns what visitors see of `run`, and of its changes.
    pub(crate) fn state(&self, run: &dyn LiveRun) -> Value {
        let mut state = live_run::state(run);
        let own = json!({ "slew": self.slew, "sets": self.sets.names() });
        live_run::extend(&mut state, own);
        state
    }

    /// Carries out a request that concerns the variables of `run`.
    ///
    /// # Errors
    /// A refusal, which says why.
    pub(crate) fn handle(
        &mut self,
        request: &Request,
        run: &mut dyn LiveRun,
    ) -> Result<(), String> {
        match request {
            Request::Set { variable, value } => {
                let slew = self.slew_of(run, variable);
                set(run, &[(variable, *value, slew)])
            }
            Request::Slew { rate } => self.set_slew(*rate),
            Request::Save { name } => self.save(name, run),
            Request::Recall { name } => self.recall(name, run),
            _ => Err("a run on hardware goes on at its own pace, and has no past".to_owned()),
        }
    }

    fn set_slew(&mut self, rate: f64) -> Result<(), String> {
        if !(rate >= 0.0 && rate.is_finite()) {
            return Err(format!("{rate} is no rate of a change"));
        }
        self.slew = rate;
        Ok(())
    }

    fn save(&mut self, name: &str, run: &dyn LiveRun) -> Result<(), String> {
        let variables = run.variables().iter().enumerate();
        let values = variables.map(|(index, variable)| {
            let target = run.target(index);
            (variable, target.unwrap_or_else(|| variable.value()))
        });
        let values: Vec<_> = values.collect();
        let comment = format!("Process variables of {} at {}.", run.name(), run.now());
        self.sets.save(name, &comment, &values)
    }

    fn recall(&self, name: &str, run: &mut dyn LiveRun) -> Result<(), String> {
        let values = self.sets.read(name, run.variables())?;
        let values = values.iter();
        let values = values.map(|(name, value)| (&**name, *value, self.slew_of(run, name)));
        let values: Vec<_> = values.collect();
        set(run, &values)
    }

    /// Returns the greatest change of a variable per second; none without a limit.
    fn slew_of(&self, run: &dyn LiveRun, name: &str) -> Option<f64> {
        let mut variables = run.variables().iter();
        let variable = variables.find(|it| it.name() == name)?;
        let scale = match variable.default().abs() {
            0.0 => variable.value().abs(),
            default => default,
        };
        let scale = if scale > 0.0 { scale } else { 1.0 };
        (self.slew > 0.0).then_some(scale * self.slew)
    }
}

fn set(run: &mut dyn LiveRun, values: &[(&str, f64, Option<f64>)]) -> Result<(), String> {
    run.set_all(values).map_err(|error| error.to_string())
}
