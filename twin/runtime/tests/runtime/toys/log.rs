use twinrig_kernel::SimTime;
use twinrig_runtime::{Group, Observer, RunEvent};

/// All records of an observer, numbers as bits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log(pub Vec<(SimTime, Entry)>);

#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    Samples(Group, Vec<u64>),
    Event(RunEvent),
}

impl Observer for Log {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        let bits = values.iter().map(|value| value.to_bits()).collect();
        self.0.push((now, Entry::Samples(group, bits)));
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.0.push((now, Entry::Event(event)));
    }
}

impl Log {
    /// Returns the events, in order.
    pub fn events(&self) -> impl Iterator<Item = (SimTime, RunEvent)> {
        self.0.iter().filter_map(|(time, entry)| match entry {
            Entry::Event(event) => Some((*time, *event)),
            Entry::Samples(..) => None,
        })
    }

    /// Returns the values of one group, in order.
    pub fn samples_of(&self, group: Group) -> impl Iterator<Item = (SimTime, Vec<f64>)> {
        self.0.iter().filter_map(move |(time, entry)| match entry {
            Entry::Samples(of, bits) if *of == group => Some((
                *time,
                bits.iter().map(|&bits| f64::from_bits(bits)).collect(),
            )),
            _ => None,
        })
    }
}
