use std::time::Duration;

use twinrig_kernel::SimTime;
use twinrig_runtime::{Group, Observer, RunEvent};

/// Records of an observer, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// Times and contents.
    pub entries: Vec<(SimTime, Entry)>,
    /// Wall-clock time of each record.
    pub takes: Duration,
}

/// Record of an observer.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// Samples of a group.
    Samples(Group, Vec<f64>),
    /// Event.
    Event(RunEvent),
    /// Bytes of a trace.
    Bytes(usize, Vec<u8>),
}

impl Log {
    fn record(&mut self, now: SimTime, entry: Entry) {
        if !self.takes.is_zero() {
            std::thread::sleep(self.takes);
        }
        self.entries.push((now, entry));
    }

    /// Returns the events.
    pub fn events(&self) -> impl Iterator<Item = RunEvent> {
        self.entries.iter().filter_map(|(_, entry)| match entry {
            Entry::Event(event) => Some(*event),
            _ => None,
        })
    }

    /// Returns the number of records of this event.
    pub fn count(&self, event: RunEvent) -> usize {
        self.events().filter(|found| *found == event).count()
    }

    /// Returns all bytes of a trace.
    pub fn trace(&self, trace: usize) -> Vec<u8> {
        let bytes = self.entries.iter().filter_map(|(_, entry)| match entry {
            Entry::Bytes(index, bytes) if *index == trace => Some(bytes.as_slice()),
            _ => None,
        });
        bytes.collect::<Vec<_>>().concat()
    }

    /// Returns the samples of a group.
    pub fn samples(&self, group: Group) -> impl Iterator<Item = &[f64]> {
        self.entries
            .iter()
            .filter_map(move |(_, entry)| match entry {
                Entry::Samples(entry_group, values) if *entry_group == group => {
                    Some(values.as_slice())
                }
                _ => None,
            })
    }

    /// Returns whether the times are ascending.
    pub fn is_in_order(&self) -> bool {
        self.entries.is_sorted_by_key(|(at, _)| *at)
    }
}

impl Observer for Log {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.record(now, Entry::Samples(group, values.to_vec()));
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.record(now, Entry::Event(event));
    }
    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        self.record(now, Entry::Bytes(trace, bytes.to_vec()));
    }
}
