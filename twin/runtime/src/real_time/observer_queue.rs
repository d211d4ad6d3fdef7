use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use twinrig_kernel::{HostTime, SimDuration, SimTime};

use super::ring::{Head, RingReader, RingWriter, ring, unpack};
use crate::{Group, Observer, RunEvent};

/// Polling interval of the observer queue, and of opening and closing.
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// Observer that passes everything to another thread through a bounded queue and never blocks:
/// records that do not fit are lost and counted.
pub(super) struct ObserverQueueWriter {
    ring: RingWriter,
    lost: Arc<AtomicU64>,
}

/// Reading end of the queue, which passes the records to an observer.
pub(super) struct ObserverQueueReader {
    ring: RingReader,
    values: Vec<f64>,
    bytes: Vec<u8>,
    lost: Arc<AtomicU64>,
}

/// Creates an observer queue of `words` words of 8 bytes.
pub(super) fn observer_queue(words: usize) -> (ObserverQueueWriter, ObserverQueueReader) {
    let (writer, reader) = ring(words);
    let lost = Arc::new(AtomicU64::new(0));
    let writer = ObserverQueueWriter {
        ring: writer,
        lost: lost.clone(),
    };
    let reader = ObserverQueueReader {
        ring: reader,
        values: Vec::new(),
        bytes: Vec::new(),
        lost,
    };
    (writer, reader)
}

mod kind {
    pub(super) const SAMPLES: u8 = 0;
    pub(super) const EVENT: u8 = 1;
    pub(super) const BYTES: u8 = 2;
}

fn host_time(now: SimTime) -> HostTime {
    HostTime::from_nanos(now.as_nanos())
}

fn saturating_u16(number: usize) -> u16 {
    u16::try_from(number).unwrap_or(u16::MAX)
}

impl ObserverQueueWriter {
    fn publish_lost(&self) {
        self.lost.store(self.ring.lost(), Ordering::Relaxed);
    }
}

impl Observer for ObserverQueueWriter {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        let source = match group {
            Group::Plant => 0,
            Group::ProcessInputs => 1,
            Group::ProcessOutputs => 2,
            Group::Diagnostics => 3,
        };
        let words = values.iter().map(|value| value.to_bits());
        self.ring
            .push_words(kind::SAMPLES, source, host_time(now), words);
        self.publish_lost();
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        let words = pack(event);
        self.ring
            .push_words(kind::EVENT, 0, host_time(now), words.into_iter());
        self.publish_lost();
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        self.ring
            .push_bytes(kind::BYTES, saturating_u16(trace), host_time(now), bytes);
        self.publish_lost();
    }
}

impl ObserverQueueReader {
    /// Passes all queued records to `observer`; returns whether there were any.
    pub(super) fn drain<O: Observer>(&mut self, observer: &mut O) -> bool {
        let mut any = false;
        while let Some((head, words)) = self.ring.pop() {
            any = true;
            let now = SimTime::from_nanos(head.at.as_nanos());
            match head.kind {
                kind::SAMPLES => {
                    self.values.clear();
                    self.values
                        .extend(words.iter().map(|&word| f64::from_bits(word)));
                    observer.samples(now, group(head), &self.values);
                }
                kind::EVENT => {
                    if let Some(event) = unpack_event(words) {
                        observer.event(now, event);
                    }
                }
                _ => {
                    unpack(head, words, &mut self.bytes);
                    observer.bytes(now, usize::from(head.source), &self.bytes);
                }
            }
        }
        any
    }

    /// Returns whether the writing end is dropped.
    pub(super) fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }

    /// Returns the number of records lost so far.
    pub(super) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

fn group(head: Head) -> Group {
    match head.source {
        0 => Group::Plant,
        1 => Group::ProcessInputs,
        2 => Group::ProcessOutputs,
        _ => Group::Diagnostics,
    }
}

fn pack(event: RunEvent) -> [u64; 3] {
    match event {
        RunEvent::Opened => [0, 0, 0],
        RunEvent::ProcessBegin { elapsed } => [1, elapsed.as_nanos(), 0],
        RunEvent::ProcessEnd => [2, 0, 0],
        RunEvent::TaskBegin { task } => [3, task as u64, 0],
        RunEvent::TaskEnd { task } => [4, task as u64, 0],
        RunEvent::TaskSkipped { task, implied } => [5, task as u64, u64::from(implied)],
        RunEvent::Overrun { missed } => [6, missed, 0],
        RunEvent::Change { variable, value } => [7, variable as u64, value.to_bits()],
    }
}

fn unpack_event(words: &[u64]) -> Option<RunEvent> {
    let &[tag, first, second] = words else {
        return None;
    };
    let index = usize::try_from(first).ok();
    Some(match tag {
        0 => RunEvent::Opened,
        1 => RunEvent::ProcessBegin {
            elapsed: SimDuration::from_nanos(first),
        },
        2 => RunEvent::ProcessEnd,
        3 => RunEvent::TaskBegin { task: index? },
        4 => RunEvent::TaskEnd { task: index? },
        5 => RunEvent::TaskSkipped {
            task: index?,
            implied: second != 0,
        },
        6 => RunEvent::Overrun { missed: first },
        _ => RunEvent::Change {
            variable: index?,
            value: f64::from_bits(second),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Default, PartialEq)]
    struct Log(Vec<String>);

    impl Observer for Log {
        fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
            let bits: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
            self.0.push(format!("{now} {group:?} {bits:x?}"));
        }
        fn event(&mut self, now: SimTime, event: RunEvent) {
            self.0.push(format!("{now} {event:?}"));
        }
        fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
            self.0.push(format!("{now} {trace} {bytes:?}"));
        }
    }

    fn emit<O: Observer>(observer: &mut O) {
        let elapsed = SimDuration::from_micros(3);
        let events = [
            RunEvent::Opened,
            RunEvent::ProcessBegin { elapsed },
            RunEvent::ProcessEnd,
            RunEvent::TaskBegin { task: 1 },
            RunEvent::TaskEnd { task: 2 },
            RunEvent::TaskSkipped {
                task: 3,
                implied: true,
            },
            RunEvent::Overrun { missed: 4 },
            RunEvent::Change {
                variable: 5,
                value: -0.0,
            },
        ];
        for (n, event) in (0..).zip(events) {
            observer.event(SimTime::from_nanos(n), event);
        }
        for group in [
            Group::Plant,
            Group::ProcessInputs,
            Group::ProcessOutputs,
            Group::Diagnostics,
        ] {
            observer.samples(SimTime::from_nanos(10), group, &[0.1, f64::NAN, -0.0]);
        }
        observer.samples(SimTime::from_nanos(11), Group::Plant, &[]);
        observer.bytes(SimTime::from_nanos(12), 7, &[1, 2, 3, 4, 5, 6, 7, 8, 9]);
        observer.bytes(SimTime::from_nanos(13), 300, &[]);
    }

    #[test]
    fn queue_passes_records_unchanged() {
        let (mut writer, mut reader) = observer_queue(1024);
        let (mut direct, mut queued) = (Log::default(), Log::default());
        emit(&mut direct);
        emit(&mut writer);
        drop(writer);
        assert!(reader.drain(&mut queued) && reader.is_abandoned());
        assert_eq!((direct, reader.lost()), (queued, 0));
    }

    #[test]
    fn full_queue_drops_and_counts_new_records() {
        let (mut writer, mut reader) = observer_queue(32);
        let at = SimTime::from_nanos;
        for n in 0..10 {
            writer.samples(at(n), Group::Plant, &[1.0, 2.0, 3.0, 4.0]);
        }
        let mut log = Log::default();
        reader.drain(&mut log);
        assert_eq!((log.0.len(), reader.lost()), (4, 6));
        writer.event(at(10), RunEvent::ProcessEnd);
        reader.drain(&mut log);
        assert_eq!(log.0.len(), 5);
        assert!(log.0[4].ends_with("ProcessEnd"));
    }
}
