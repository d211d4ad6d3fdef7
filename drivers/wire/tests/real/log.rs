use std::time::Duration;

use twinrig_kernel::SimTime;
use twinrig_runtime::{Group, Observer, RunEvent};

/// Everything an observer sees, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    pub seen: Vec<(SimTime, Entry)>,
    /// How long it takes over each record.
    pub takes: Duration,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    Samples(Group, Vec<f64>),
    Event(RunEvent),
    Bytes(usize, Vec<u8>),
}

impl Log {
    fn note(&mut self, now: SimTime, entry: Entry) {
        if !self.takes.is_zero() {
            std::thread::sleep(self.takes);
        }
        self.seen.push((now, entry));
    }

    pub fn events(&self) -> impl Iterator<Item = RunEvent> {
        self.seen.iter().filter_map(|(_, entry)| match entry {
            Entry::Event(event) => Some(*event),
            _ => None,
        })
    }

    pub fn count(&self, event: RunEvent) -> usize {
        self.events().filter(|seen| *seen == event).count()
    }

    /// Everything that passed on a lane.
    pub fn trace(&self, trace: usize) -> Vec<u8> {
        let bytes = self.seen.iter().filter_map(|(_, entry)| match entry {
            Entry::Bytes(of, bytes) if *of == trace => Some(bytes.as_slice()),
            _ => None,
        });
        bytes.collect::<Vec<_>>().concat()
    }

    pub fn samples(&self, group: Group) -> impl Iterator<Item = &[f64]> {
        self.seen.iter().filter_map(move |(_, entry)| match entry {
            Entry::Samples(of, values) if *of == group => Some(values.as_slice()),
            _ => None,
        })
    }

    pub fn is_in_order(&self) -> bool {
        self.seen.is_sorted_by_key(|(at, _)| *at)
    }
}

impl Observer for Log {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.note(now, Entry::Samples(group, values.to_vec()));
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.note(now, Entry::Event(event));
    }
    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        self.note(now, Entry::Bytes(trace, bytes.to_vec()));
    }
}
