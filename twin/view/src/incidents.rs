//! Instants and intervals of a run: what was done to it, and what happened.

use serde::Serialize;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_record::{ChangeMessage, EventMessage, RecordError, VerdictMessage};
use twinrig_scenario::{PushLoad, PushSite};

use crate::gait::LegGait;
use crate::run::Run;

/// Kind of an incident.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Kind {
    /// A footstep begins.
    TouchDown,
    /// A push on trunk or foot.
    Push,
    /// A fault of a wire.
    Fault,
    /// A change of a process variable.
    Change,
    /// An exceptional event of the schedule.
    Event,
    /// The decisive instant of an expectation that fails.
    Violation,
    /// The robot falls, or the run ends early.
    End,
}

/// Something at an instant, or over an interval.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Incident {
    kind: Kind,
    /// Instant, or beginning \[s\].
    pub(crate) at: f64,
    /// End of an interval \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    until: Option<f64>,
    /// Description.
    text: String,
    /// Leg, if it is one of a leg.
    #[serde(skip_serializing_if = "Option::is_none")]
    leg: Option<String>,
}

/// Events of one text within this time are one incident: a board that is dead misses each step.
const BURST: f64 = 0.05;

impl Incident {
    fn new(kind: Kind, at: f64, text: impl Into<String>) -> Self {
        Self {
            kind,
            at,
            until: None,
            text: text.into(),
            leg: None,
        }
    }

    fn lasting(self, until: f64) -> Self {
        Self {
            until: Some(until),
            ..self
        }
    }

    /// Returns a push, fault or change in words, with its instant; none of what is not planned.
    pub(crate) fn planned(&self) -> Option<String> {
        let is_planned = matches!(self.kind, Kind::Push | Kind::Fault | Kind::Change);
        is_planned.then(|| format!("{} at {:.3} s", self.text, self.at))
    }

    /// Returns whether it is more than a step of the gait.
    pub(crate) fn is_notable(&self) -> bool {
        self.kind != Kind::TouchDown
    }
}

/// Returns the incidents of a run, in order of time.
pub(crate) fn incidents(
    run: &Run<'_>,
    gait: &[LegGait],
    verdict: Option<&VerdictMessage>,
) -> Result<Vec<Incident>, RecordError> {
    let end = run.end();
    let mut all = planned(run, end);
    for of in gait {
        all.extend(of.footsteps.iter().map(|step| Incident {
            leg: Some(of.leg.clone()),
            ..Incident::new(
                Kind::TouchDown,
                step.from,
                format!("{} touches down", of.leg),
            )
        }));
    }
    for (at, change) in run.shown().messages::<ChangeMessage>()? {
        let text = format!("{} = {}", change.variable, change.value);
        all.push(Incident::new(Kind::Change, at.as_secs_f64(), text));
    }
    all.extend(bursts(run.shown().messages::<EventMessage>()?));
    if let Some(verdict) = verdict {
        let failed = verdict.expectations.iter();
        let failed = failed.filter(|outcome| outcome.verdict == "fail");
        all.extend(failed.filter_map(|outcome| {
            let at = outcome.first_violation_s.or(outcome.instant_s)?;
            Some(Incident {
                leg: outcome.leg.clone(),
                ..Incident::new(Kind::Violation, at, format!("violated: {}", outcome.name))
            })
        }));
        if let Some(error) = &verdict.error {
            let first = first_line(error);
            all.push(Incident::new(Kind::End, end.as_secs_f64(), first));
        }
    }
    let fell = run.repetition().and_then(|it| it.report.fell_at_s);
    all.extend(fell.map(|at| Incident::new(Kind::End, at, "the robot falls")));
    all.sort_by(|a, b| a.at.total_cmp(&b.at));
    Ok(all)
}

/// Returns the first line of an error, without the word for it.
pub(crate) fn first_line(error: &str) -> &str {
    let first = error.lines().next().unwrap_or_default();
    first.strip_prefix("error: ").unwrap_or(first)
}

/// Returns the pushes and faults of the scenario that the run reached.
fn planned(run: &Run<'_>, end: SimTime) -> Vec<Incident> {
    let Some(assembly) = run.assembly() else {
        return Vec::new();
    };
    let scenario = assembly.scenario();
    let after = |at: SimTime, lasts: Option<SimDuration>| {
        let until = lasts.and_then(|lasts| at.checked_add(lasts));
        until.map_or(end, |until| until.min(end)).as_secs_f64()
    };
    let pushes = scenario.pushes.iter().filter(|push| push.at < end);
    let pushes = pushes.map(|push| {
        let size = push.peak.iter().map(|axis| axis * axis).sum::<f64>().sqrt();
        let unit = match push.load {
            PushLoad::Force(_) => "N",
            PushLoad::Torque => "N·m",
        };
        let (on, leg) = match &push.on {
            PushSite::Trunk => ("trunk".to_owned(), None),
            PushSite::Foot(leg) => (format!("foot {}", leg.value), Some(leg.value.clone())),
        };
        let text = format!("push {}: {size:.3} {unit} on {on}", push.name);
        let push = Incident::new(Kind::Push, push.at.as_secs_f64(), text)
            .lasting(after(push.at, Some(push.lasts)));
        Incident { leg, ..push }
    });
    let faults = scenario.faults.iter().filter(|fault| fault.at < end);
    let faults = faults.map(|fault| {
        let text = format!("fault {} on {}", fault.kind.name(), fault.on.value);
        Incident::new(Kind::Fault, fault.at.as_secs_f64(), text)
            .lasting(after(fault.at, fault.lasts))
    });
    pushes.chain(faults).collect()
}

/// Returns the events of the schedule, those of one text that follow each other closely as one.
fn bursts(events: Vec<(SimTime, EventMessage)>) -> Vec<Incident> {
    let mut bursts: Vec<(Incident, usize, f64)> = Vec::new();
    for (at, event) in events {
        let at = at.as_secs_f64();
        let text = match &event.part {
            Some(part) => format!("{}: {part}", event.event),
            None => event.event,
        };
        let mut open = bursts.iter_mut().rev();
        match open.find(|(burst, _, last)| burst.text == text && at - last <= BURST) {
            Some((_, count, last)) => {
                *count += 1;
                *last = at;
            }
            None => bursts.push((Incident::new(Kind::Event, at, text), 1, at)),
        }
    }
    let finished = bursts.into_iter().map(|(burst, count, last)| match count {
        1 => burst,
        _ => Incident {
            text: format!("{}, {count} times", burst.text),
            ..burst.lasting(last)
        },
    });
    finished.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn close_events_of_one_text_are_one_incident() {
        let skipped = |at_ms: u64, part: &str| {
            let event = EventMessage {
                event: "task skipped".to_owned(),
                part: Some(part.to_owned()),
                count: None,
            };
            (SimTime::from_nanos(1_000_000 * at_ms), event)
        };
        let events = [
            skipped(10, "a"),
            skipped(12, "b"),
            skipped(20, "a"),
            skipped(60, "a"),
            skipped(200, "a"),
        ];
        let found = bursts(events.into());
        let found: Vec<(f64, Option<f64>, &str)> = found
            .iter()
            .map(|burst| (burst.at, burst.until, burst.text.as_str()))
            .collect();
        let expected = [
            (
                0.01,
                Some(SimTime::from_nanos(60_000_000).as_secs_f64()),
                "task skipped: a, 3 times",
            ),
            (0.012, None, "task skipped: b"),
            (0.2, None, "task skipped: a"),
        ];
        assert_eq!(found, expected);
    }
}
