//! `Observer` implementations of recorder and fingerprint.

use std::io::Write;

use twinrig_kernel::SimTime;
use twinrig_runtime::{Group, Observer, RunEvent};

use crate::{Fingerprint, Recorder};

/// Adds every sample, event and piece of wire traffic.
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
            // Why a task is busy follows from the events before.
            RunEvent::TaskSkipped { task, .. } => self.event(now, 5, &[task as u64]),
            RunEvent::Overrun { missed } => self.event(now, 6, &[missed]),
            RunEvent::Change { variable, value } => {
                self.event(now, 7, &[variable as u64, value.to_bits()]);
            }
            RunEvent::Opened => self.event(now, 8, &[]),
        }
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        let trace = u32::try_from(trace).unwrap_or(u32::MAX);
        self.wire(now.as_nanos(), trace, bytes);
    }
}

/// Records every sample, every change, and exceptional events (skipped tasks, overruns). Begin and
/// end of processes and tasks, and skips that follow from the periods, are frequent and follow from
/// the scenario; they enter only the fingerprint.
impl<W: Write> Observer for Recorder<W> {
    #[inline]
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.sample(now, group, values);
    }

    #[inline]
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.run_event(now, event);
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        self.bytes(now, trace, bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingerprints_of_different_events_differ() {
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
            RunEvent::TaskSkipped {
                task: 0,
                implied: false,
            },
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
