//! Recorder and fingerprint as observers of a rig.

use std::io::Write;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;
use twinrig_runtime::{Group, Observer, RunEvent};

use crate::{Fingerprint, Recorder, Topic};

/// A message of [`Topic::Events`]: something out of the ordinary in the schedule of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventMessage {
    /// `task skipped`, `overrun` or `devices are open`.
    pub event: String,
    /// The task that was skipped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// How many control steps were missed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count: Option<u64>,
}

/// A message of [`Topic::Changes`]: a process variable was set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChangeMessage {
    /// Name of the variable.
    pub variable: String,
    /// What it was set to, in its unit.
    pub value: f64,
}

/// Takes in every sample and every event.
impl Observer for Fingerprint {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.sample(now.as_nanos(), group as u32, values);
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        let now = now.as_nanos();
        match event {
            RunEvent::ProcessBegin { elapsed } => self.event(now, 1, &[elapsed.as_nanos()]),
            RunEvent::ProcessEnd => self.event(now, 2, &[]),
            RunEvent::TaskBegin { task } => self.event(now, 3, &[task as u64]),
            RunEvent::TaskEnd { task } => self.event(now, 4, &[task as u64]),
            RunEvent::TaskSkipped { task } => self.event(now, 5, &[task as u64]),
            RunEvent::Overrun { missed } => self.event(now, 6, &[missed]),
            RunEvent::Change { variable, value } => {
                self.event(now, 7, &[variable as u64, value.to_bits()]);
            }
            RunEvent::Opened => self.event(now, 8, &[]),
        }
    }

    fn bytes(&mut self, now: SimTime, lane: usize, bytes: &[u8]) {
        let lane = u32::try_from(lane).unwrap_or(u32::MAX);
        self.wire(now.as_nanos(), lane, bytes);
    }
}

/// Records every sample, every change, and of the other events those that are out of the ordinary:
/// skipped tasks and overruns. The beginnings and ends of processes and tasks are many and follow from
/// the scenario; they are in the fingerprint.
impl<W: Write> Observer for Recorder<W> {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.sample(now, group, values);
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        match event {
            RunEvent::TaskSkipped { task } => {
                let part = Some(name(&self.tasks, task));
                let event = "task skipped".to_owned();
                self.json(
                    now,
                    Topic::Events,
                    &EventMessage {
                        event,
                        part,
                        count: None,
                    },
                );
            }
            RunEvent::Overrun { missed } => {
                let event = "overrun".to_owned();
                self.json(
                    now,
                    Topic::Events,
                    &EventMessage {
                        event,
                        part: None,
                        count: Some(missed),
                    },
                );
            }
            RunEvent::Change { variable, value } => {
                let variable = name(&self.variables, variable);
                self.json(now, Topic::Changes, &ChangeMessage { variable, value });
            }
            RunEvent::Opened => {
                let event = "devices are open".to_owned();
                let message = EventMessage {
                    event,
                    part: None,
                    count: None,
                };
                self.json(now, Topic::Events, &message);
            }
            RunEvent::ProcessBegin { .. }
            | RunEvent::ProcessEnd
            | RunEvent::TaskBegin { .. }
            | RunEvent::TaskEnd { .. } => {}
        }
    }

    fn bytes(&mut self, now: SimTime, lane: usize, bytes: &[u8]) {
        self.bytes(now, lane, bytes);
    }
}

fn name(names: &[String], number: usize) -> String {
    names
        .get(number)
        .cloned()
        .unwrap_or_else(|| number.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_events_have_the_same_fingerprint() {
        use twinrig_kernel::SimDuration;
        let elapsed = |nanos| RunEvent::ProcessBegin {
            elapsed: SimDuration::from_nanos(nanos),
        };
        let events = [
            elapsed(0),
            elapsed(1),
            RunEvent::ProcessEnd,
            RunEvent::TaskBegin { task: 0 },
            RunEvent::TaskBegin { task: 1 },
            RunEvent::TaskEnd { task: 0 },
            RunEvent::TaskSkipped { task: 0 },
            RunEvent::Overrun { missed: 0 },
            RunEvent::Change {
                variable: 0,
                value: 0.0,
            },
            RunEvent::Change {
                variable: 0,
                value: -0.0,
            },
            RunEvent::Change {
                variable: 1,
                value: 0.0,
            },
        ];
        let digests: Vec<_> = events
            .into_iter()
            .map(|event| {
                let mut fingerprint = Fingerprint::new();
                Observer::event(&mut fingerprint, SimTime::ZERO, event);
                fingerprint.digest()
            })
            .collect();
        for (n, digest) in digests.iter().enumerate() {
            assert!(!digests[..n].contains(digest), "{:?}", events[n]);
        }
    }
}
