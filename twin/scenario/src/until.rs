//! `until`: an earlier end of the run. What lies beyond it is left out.

use std::collections::BTreeMap;

use twinrig_kernel::{SimDuration, SimTime};

use crate::body::BodyClaim;
use crate::expect::{Claim, Expectation, SignalClaim, SignalMode};
use crate::left_out::LeftOut;
use crate::read::print_duration;
use crate::scenario::Scenario;
use crate::sequence::{Relation, SequenceClaim};

impl Scenario {
    /// Ends the run at `until` if that is before its end, and leaves out what begins there or
    /// later, and the expectations that need more of the run.
    pub(crate) fn end_early(&mut self, until: SimDuration) {
        if until >= self.duration {
            return;
        }
        let end = SimTime::ZERO + until;
        let mut parts = vec![format!(
            "run from {} to {}",
            print_duration(until),
            print_duration(self.duration)
        )];
        let seconds = |at: SimTime| print_duration(at.since_start());

        let mut changes: BTreeMap<String, (SimTime, usize)> = BTreeMap::new();
        for change in self.changes.extract_if(.., |change| change.at >= end) {
            changes.entry(change.variable).or_insert((change.at, 0)).1 += 1;
        }
        parts.extend(changes.into_iter().map(|(variable, (at, count))| {
            let change = if count == 1 { "change" } else { "changes" };
            let from = if count == 1 { "at" } else { "from" };
            format!("{change} of {variable} {from} {}", seconds(at))
        }));
        let faults = self.faults.extract_if(.., |fault| fault.at >= end);
        parts.extend(faults.map(|it| format!("fault on {} at {}", it.on.value, seconds(it.at))));
        let pushes = self.pushes.extract_if(.., |push| push.at >= end);
        parts.extend(pushes.map(|it| format!("push `{}` at {}", it.name, seconds(it.at))));
        if let Some(ground) = &mut self.plant.ground {
            let surfaces = ground.surfaces.extract_if(.., |it| it.begin >= end);
            parts.extend(
                surfaces.map(|it| format!("friction {} from {}", it.friction, seconds(it.begin))),
            );
        }
        let expectations = self
            .expectations
            .extract_if(.., |it| it.needs_run_after(end));
        parts.extend(expectations.map(|it| it.part()));

        let why = format!("`until` ends the run at {}", print_duration(until));
        self.beyond_end = parts
            .into_iter()
            .map(|part| LeftOut {
                part,
                why: why.clone(),
            })
            .collect();
        self.duration = until;
    }
}

impl Expectation {
    /// Returns the name of the expectation as a part of a scene.
    pub(crate) fn part(&self) -> String {
        format!("expectation that {}", self.name)
    }

    /// Returns whether a time that the expectation names is later than `end`, or its window begins
    /// no earlier. An expectation without such a time applies to a run of any length.
    fn needs_run_after(&self, end: SimTime) -> bool {
        self.after >= end
            || self.before.is_some_and(|before| before > end)
            || self.settled_by().is_some_and(|by| by >= end)
            || self
                .within()
                .is_some_and(|within| later(self.after, within) > end)
            || self.recovered_by().is_some_and(|by| by > end)
    }

    /// Returns the time from which on a value is settled.
    pub(crate) fn settled_by(&self) -> Option<SimTime> {
        match self.claim {
            Claim::Body(BodyClaim::Settles { by, .. })
            | Claim::Signal(SignalClaim {
                mode: SignalMode::Settles { by, .. },
                ..
            }) => Some(by),
            _ => None,
        }
    }

    /// Returns the time within which a condition holds, `hold` of a rising included.
    pub(crate) fn within(&self) -> Option<SimDuration> {
        match &self.claim {
            Claim::Signal(SignalClaim {
                mode: SignalMode::Eventually(_, within),
                ..
            }) => *within,
            Claim::Body(BodyClaim::GetsUp(claim)) => Some(claim.within + claim.hold),
            Claim::Sequence(SequenceClaim { relation, .. }) => match *relation {
                Relation::Then(within) => Some(within),
                Relation::Before(within) => within,
            },
            _ => None,
        }
    }

    /// Returns the latest end of a recovery.
    fn recovered_by(&self) -> Option<SimTime> {
        match &self.claim {
            Claim::Body(BodyClaim::Recovers(recovery, _))
            | Claim::Signal(SignalClaim {
                mode: SignalMode::Recovers(recovery, _),
                ..
            }) => Some(later(recovery.end, recovery.within)),
            _ => None,
        }
    }
}

/// Returns the time `after` a time, or the last one there is.
fn later(at: SimTime, after: SimDuration) -> SimTime {
    at.checked_add(after).unwrap_or(SimTime::MAX)
}
