//! A run as visitors see it, in virtual time or on hardware.

use serde_json::{Value, json};
use twinrig_kernel::{SimTime, near_misses};
use twinrig_report::comparison::{Comparison, Shown};
use twinrig_runtime::{Bound, ProcessVariable};
use twinrig_scenario::{Outcome, Verdict};

use crate::error::LiveError;
use crate::watch::{EventKind, Events};

/// Number of events that are shown.
const EVENTS: usize = 50;

/// Values that variables are to have, by name, with the greatest change per second; none: at once.
pub(crate) type Targets<'t> = &'t [(&'t str, f64, Option<f64>)];

/// A run whose process variables visitors change.
pub(crate) trait LiveRun {
    /// Returns the name of the scenario.
    fn name(&self) -> &str;
    /// Returns the instant that it has reached.
    fn now(&self) -> SimTime;
    /// Returns the variables of the controller with their present values.
    fn variables(&self) -> &[ProcessVariable];
    /// Returns the value that a variable is to have, by its index.
    fn target(&self, variable: usize) -> Option<f64>;
    /// Returns the newest events.
    fn events(&self) -> &Events;
    /// Returns the name of a task.
    fn task(&self, index: usize) -> &str;
    /// Returns the outcomes that the expectations would have if the scenario ended now.
    fn outcomes(&self) -> Vec<Outcome>;
    /// Sets several variables from the next control step on, all or none.
    fn set_all(&mut self, values: Targets<'_>) -> Result<(), LiveError>;
}

/// Returns the index of the variable `name` among `names`.
pub(crate) fn index_of<'n>(
    name: &str,
    names: impl Iterator<Item = &'n str> + Clone,
) -> Result<usize, LiveError> {
    let found = names.clone().position(|other| other == name);
    found.ok_or_else(|| LiveError::NoSuchVariable {
        name: name.to_owned(),
        near: near_misses(name, names)
            .into_iter()
            .map(str::to_owned)
            .collect(),
    })
}

/// Checks the greatest change of a variable per second.
pub(crate) fn check_slew(slew: Option<f64>) -> Result<(), LiveError> {
    match slew {
        Some(rate) if !(rate > 0.0 && rate.is_finite()) => {
            let why = format!("a rate of {rate} is not above 0");
            Err(LiveError::Refused(why))
        }
        _ => Ok(()),
    }
}

/// Returns what visitors see of any run, apart from signals and poses.
pub(crate) fn state(run: &dyn LiveRun) -> Value {
    let events: Vec<Value> = run
        .events()
        .newest
        .iter()
        .map(|it| json!({ "at_s": it.at.as_secs_f64(), "text": event(run, &it.kind) }))
        .collect();
    let events = &events[events.len().saturating_sub(EVENTS)..];
    json!({
        "now_s": run.now().as_secs_f64(),
        "variables": variables(run),
        "events": events,
        "expectations": run.outcomes().iter().map(expectation).collect::<Vec<_>>(),
    })
}

/// Adds the members of an object to another.
pub(crate) fn extend(state: &mut Value, other: Value) {
    if let (Value::Object(state), Value::Object(other)) = (state, other) {
        state.extend(other);
    }
}

fn variables(run: &dyn LiveRun) -> Vec<Value> {
    let variables = run.variables().iter().enumerate();
    let end = |bound: Bound<f64>| match bound {
        Bound::Included(at) | Bound::Excluded(at) => Some(at),
        Bound::Unbounded => None,
    };
    variables
        .map(|(index, variable)| {
            let (min, max) = variable.range();
            json!({
                "name": variable.name(),
                "unit": variable.unit().symbol(),
                "value": variable.value(),
                "target": run.target(index),
                "default": variable.default(),
                "min": end(min),
                "max": end(max),
                "range": variable.range_text(),
            })
        })
        .collect()
}

fn event(run: &dyn LiveRun, kind: &EventKind) -> String {
    match kind {
        EventKind::TouchDown(leg) => format!("{leg} touches down"),
        EventKind::LiftOff(leg) => format!("{leg} lifts off"),
        EventKind::Change { variable, value } => {
            let variable = &run.variables()[*variable];
            format!("{} = {value} {}", variable.name(), variable.unit().symbol())
        }
        EventKind::Skipped(task) => format!("{} is busy beyond its period", run.task(*task)),
        EventKind::Overrun => "the controller is busy beyond its period".to_owned(),
        EventKind::Opened => "all devices are open".to_owned(),
        EventKind::Fall => "the robot falls".to_owned(),
    }
}

/// Returns an expectation as visitors see it.
fn expectation(outcome: &Outcome) -> Value {
    let comparison = Comparison {
        measured: outcome.measured,
        bound: outcome.bound,
        other_bound: outcome.other_bound,
        margin: outcome.margin,
    };
    let shown = Shown::of(&comparison, outcome.unit.symbol());
    let bound = outcome.bound.map(|bound| {
        // The margin grows with the distance above a lower bound.
        let above = outcome.measured.map(|measured| measured - bound);
        let is_lower = above
            .zip(outcome.margin)
            .is_some_and(|(above, margin)| above * margin > 0.0);
        let relation = if is_lower { "≥" } else { "≤" };
        format!("{relation} {}", shown.with_unit(bound))
    });
    json!({
        "name": outcome.name,
        "verdict": match outcome.verdict {
            Verdict::Pass => "pass",
            Verdict::Fail => "fail",
            Verdict::Unobserved => "unobserved",
        },
        "measured": outcome.measured.map(|it| shown.with_unit(it)),
        "bound": bound,
    })
}
