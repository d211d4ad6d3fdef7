//! Failures of a rig, with what the scenario has to do with them.

use twinrig_kernel::{SimDuration, SimTime, signal};
use twinrig_runtime::{PlantFault, RigError, TaskError, WiringError};
use twinrig_scenario::{PushLoad, PushSpec};

use crate::assembly::Assembly;
use crate::error::Error;

/// Time after the last valid state of a plant, and after a push, in which the push is named: some
/// steps of the slowest plant.
const NEAR: SimDuration = SimDuration::from_millis(50);

impl Assembly<'_> {
    /// Returns the error of the rig, with the push that may have caused it.
    pub fn rig_error(&self, source: RigError) -> Error {
        let help = match &source {
            RigError::Plant(fault)
            | RigError::Task {
                source: TaskError::Plant(fault),
                ..
            } => self.push_help(fault),
            _ => self.wiring_help(&source),
        };
        let help = help.map_or_else(String::new, |help| format!("\n  = help: {help}"));
        Error::Rig {
            file: self.scenario().file.clone(),
            help,
            source: Box::new(source),
        }
    }

    /// Returns the remedy for a command that has no input at a standalone plant.
    fn wiring_help(&self, error: &RigError) -> Option<String> {
        let unmatched = matches!(error, RigError::Wiring(WiringError::Unmatched { port, .. }) if signal::parse_leg(&port.name).is_some());
        let kind = self.scenario().controller.as_ref().map(|spec| &spec.kind);
        match (kind, self.body().standalone_model()) {
            (Some(kind), Some(_)) if unmatched => Some(format!(
                "`{kind}` has the same signals for every leg: map them all in [plant.inputs] and [plant.outputs], or write a controller of your own"
            )),
            _ => None,
        }
    }

    /// Names the pushes that act when a plant fails, the strongest one first.
    fn push_help(&self, fault: &PlantFault) -> Option<String> {
        let near = |push: &&PushSpec| acts_near(push, fault.time);
        let mut pushes: Vec<&PushSpec> = self.scenario().pushes.iter().filter(near).collect();
        pushes.sort_by(|one, other| strength(other).total_cmp(&strength(one)));
        let first = pushes.first()?;
        let most = short(strength(first));
        let strength = match first.load {
            PushLoad::Torque => format!("{most} N·m"),
            PushLoad::Force(_) if self.facts.weight > 0.0 => {
                let times = short(strength(first) / self.facts.weight);
                format!("{most} N, {times} times the weight of the robot")
            }
            PushLoad::Force(_) => format!("{most} N"),
        };
        let also = match pushes.len() {
            1 => String::new(),
            count => format!(", and {} more", count - 1),
        };
        let place = &first.place;
        Some(format!(
            "the push `{}` ({}:{}) acts from {} to {} with {strength}{also}; give a weaker one",
            first.name,
            place.source().name,
            place.line(),
            seconds(first.at),
            seconds(first.at + first.lasts),
        ))
    }
}

/// Returns whether a push acts at `time`, or shortly before or after.
fn acts_near(push: &PushSpec, time: SimTime) -> bool {
    push.at <= time + NEAR && time <= push.at + push.lasts + NEAR
}

/// Formats a time without the zeros after its last digit.
fn seconds(time: SimTime) -> String {
    format!("{} s", time.as_secs_f64())
}

/// Formats a number with two significant digits.
fn short(number: f64) -> f64 {
    format!("{number:.1e}").parse().unwrap_or(number)
}

/// Greatest force \[N\] or torque \[N·m\] of a push.
fn strength(push: &PushSpec) -> f64 {
    push.peak.iter().map(|x| x * x).sum::<f64>().sqrt()
}
