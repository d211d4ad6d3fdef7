//! Serving under a manually advanced clock.

use std::collections::VecDeque;
use std::sync::atomic::AtomicU64;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use proptest::prelude::*;

use super::*;
use crate::real_time::tests::EmptyPlant;
use crate::{Device, DeviceError, Part, PlantAccess, TaskError, TransmitBuffer};

const BYTE_TIME: SimDuration = SimDuration::from_micros(3);
const CAPACITY: usize = 4096;
/// Delay from a write to its first byte on the line.
const LATENCY: SimDuration = SimDuration::from_micros(100);

fn millis(n: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(n)
}

fn micros(n: u64) -> SimDuration {
    SimDuration::from_micros(n)
}

/// Clock that advances at each reading by the next of a cyclic list of durations, as on a machine
/// that preempts the reader.
#[derive(Default)]
struct InterruptedClock {
    now_ns: AtomicU64,
    readings: AtomicU64,
    pauses: Vec<SimDuration>,
}

impl InterruptedClock {
    fn current_ns(&self) -> u64 {
        self.now_ns.load(Ordering::Relaxed)
    }
}

impl Clock for InterruptedClock {
    fn now(&self) -> HostTime {
        let reading = self.readings.fetch_add(1, Ordering::Relaxed);
        if !self.pauses.is_empty() {
            let pause = self.pauses[usize::try_from(reading).unwrap() % self.pauses.len()];
            self.now_ns.fetch_add(pause.as_nanos(), Ordering::Relaxed);
        }
        HostTime::from_nanos(self.current_ns())
    }
    fn sleep_until(&self, at: HostTime) {
        self.now_ns.fetch_max(at.as_nanos(), Ordering::Relaxed);
    }
}

/// Record of the bytes on the line.
#[derive(Default)]
struct LineRecord {
    count: usize,
    first: Option<SimTime>,
    last: Option<SimTime>,
    /// Number of pauses between two bytes.
    pauses: usize,
}

/// Transmitter with its buffer and a recorded line.
struct RecordedWire {
    now: SimTime,
    idle_from: SimTime,
    line: Arc<Mutex<LineRecord>>,
}

impl RecordedWire {
    fn transmit(&mut self, start: SimTime, count: usize) {
        let mut line = self.line.lock().unwrap();
        line.pauses += usize::from(line.count > 0 && start > self.idle_from);
        line.count += count;
        line.first.get_or_insert(start + BYTE_TIME);
        self.idle_from = start + BYTE_TIME * count as u64;
        line.last = Some(self.idle_from);
    }

    fn check_room(&self, now: SimTime, bytes: &[u8]) {
        let room = self.transmit_buffer().unwrap().room(now);
        assert!(
            bytes.len() <= room,
            "{} bytes exceed the room of {room}",
            bytes.len()
        );
    }
}

impl Part for RecordedWire {}

impl Wire for RecordedWire {
    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        self.check_room(now, bytes);
        self.transmit((now + LATENCY).max(self.idle_from), bytes.len());
    }

    fn send_contiguous(&mut self, now: SimTime, bytes: &[u8]) {
        self.check_room(now, bytes);
        assert!(now <= self.idle_from);
        self.transmit(self.idle_from, bytes.len());
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        Some(TransmitBuffer {
            idle_from: self.idle_from,
            byte_time: BYTE_TIME,
            capacity: CAPACITY,
        })
    }

    fn next_wake(&self) -> Option<SimTime> {
        // An answer of a board, shortly after the last byte.
        let answers = self.idle_from + micros(10);
        (self.idle_from > SimTime::ZERO && answers > self.now).then_some(answers)
    }

    fn advance(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.now = now;
        Ok(())
    }

    fn receive(&mut self, _: &mut Vec<u8>) {}
}

/// Host that writes without a pause until an instant, and then single bytes.
struct Host {
    clock: Arc<InterruptedClock>,
    flood_until: SimTime,
    single_bytes: VecDeque<SimTime>,
}

impl Device for Host {
    fn place(&self) -> &'static str {
        "host"
    }
    fn write(&mut self, _: &[u8]) -> Result<(), DeviceError> {
        Ok(())
    }
    fn read_up_to(
        &mut self,
        limit: usize,
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        assert!((1..=CAPACITY).contains(&limit));
        let now = SimTime::from_nanos(self.clock.current_ns());
        if now < self.flood_until {
            bytes.resize(bytes.len() + limit, 0x55);
            return Ok(());
        }
        let until = now + duration_of(timeout);
        if let Some(at) = self.single_bytes.front().filter(|at| **at <= until) {
            self.clock.sleep_until(HostTime::from_nanos(at.as_nanos()));
        } else {
            self.clock
                .sleep_until(HostTime::from_nanos(until.as_nanos()));
        }
        let now = SimTime::from_nanos(self.clock.current_ns());
        while self.single_bytes.front().is_some_and(|at| *at <= now) && bytes.len() < limit {
            self.single_bytes.pop_front();
            bytes.push(0xAA);
        }
        Ok(())
    }
}

fn duration_of(timeout: Duration) -> SimDuration {
    SimDuration::from_nanos(u64::try_from(timeout.as_nanos()).unwrap())
}

/// Serves a host until `end`. Returns the record of the line, and a function that runs the twin
/// until an instant.
fn serve_host(
    pauses: Vec<SimDuration>,
    flood_until: SimTime,
    single_bytes: &[SimTime],
    end: SimTime,
) -> (Arc<Mutex<LineRecord>>, impl FnMut(SimTime) + use<>) {
    let clock = Arc::new(InterruptedClock {
        pauses,
        ..InterruptedClock::default()
    });
    let line = Arc::new(Mutex::new(LineRecord::default()));
    let wire = ServedWire {
        name: "wire".into(),
        wire: Box::new(RecordedWire {
            now: SimTime::ZERO,
            idle_from: SimTime::ZERO,
            line: line.clone(),
        }),
        device: Box::new(Host {
            clock: clock.clone(),
            flood_until,
            single_bytes: single_bytes.iter().copied().collect(),
        }),
    };
    let options = ServeOptions {
        duration: Some(end - SimTime::ZERO),
        ..ServeOptions::default()
    };
    let mut serve = Serve::new(options, Box::new(EmptyPlant), vec![wire]).unwrap();
    let run_until = move |until: SimTime| {
        while serve.now() < until {
            let ended = serve.cycle(&*clock, HostTime::default(), &mut ()).unwrap();
            if ended.is_some() {
                break;
            }
        }
    };
    (line, run_until)
}

/// Wire that requests a wake-up at the present instant whenever it has been woken.
#[derive(Default)]
struct RestlessWire(Option<SimTime>);

impl Part for RestlessWire {}

impl Wire for RestlessWire {
    fn send(&mut self, _: SimTime, _: &[u8]) {}
    fn next_wake(&self) -> Option<SimTime> {
        self.0.or(Some(millis(3)))
    }
    fn advance(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.0 = (now >= millis(3)).then_some(now);
        Ok(())
    }
    fn receive(&mut self, _: &mut Vec<u8>) {}
}

#[test]
fn livelock_is_reported_with_the_wire_that_causes_it() {
    let clock = Arc::new(InterruptedClock::default());
    let wire = ServedWire {
        name: "restless".into(),
        wire: Box::new(RestlessWire::default()),
        device: Box::new(Host {
            clock: clock.clone(),
            flood_until: SimTime::ZERO,
            single_bytes: VecDeque::new(),
        }),
    };
    let mut serve = Serve::new(ServeOptions::default(), Box::new(EmptyPlant), vec![wire]).unwrap();
    let mut cycles = (0..1000).map(|_| serve.cycle(&*clock, HostTime::default(), &mut ()));
    let error = cycles.find_map(Result::err);
    let Some(RigError::Livelock(livelock)) = error else {
        panic!("{error:?}");
    };
    assert_eq!(livelock.time, millis(3));
    assert_eq!(livelock.edges[0].woke, "restless");
}

fn locked(line: &Mutex<LineRecord>) -> MutexGuard<'_, LineRecord> {
    line.lock().unwrap()
}

#[test]
fn flood_drains_at_the_baud_rate_and_does_not_delay_later_bytes() {
    let flood = millis(30_000);
    let ping = millis(30_050);
    let (line, mut run_until) = serve_host(Vec::new(), flood, &[ping], millis(30_100));
    run_until(flood);
    let count_max = 30_000_000 / 3 + CAPACITY;
    {
        let line = locked(&line);
        assert!(
            (count_max - 2 * CAPACITY..=count_max).contains(&line.count),
            "{} bytes",
            line.count
        );
        assert_eq!(line.pauses, 0, "the transmitter was idle during the flood");
    }
    run_until(millis(30_040));
    let before = locked(&line).count;
    run_until(millis(30_100));
    let line = locked(&line);
    assert_eq!(line.count, before + 1);
    let late = line.last.unwrap() - ping;
    assert!(late <= LATENCY + BYTE_TIME + BURST_GAP_MAX, "{late}");
}

proptest! {
    /// Ten bytes written within up to 260 µs, with interruptions of the twin of up to 5 ms at each
    /// reading of the clock.
    #[test]
    fn single_bytes_follow_without_a_pause_despite_interruptions(
        gaps in prop::collection::vec(0_u64..30, 10),
        pauses in prop::collection::vec(prop_oneof![4 => Just(0_u64), 4 => 0_u64..60, 1 => 0_u64..5_000], 1..40),
        begin in 0_u64..3_000,
    ) {
        let mut at = millis(1) + micros(begin);
        let writes: Vec<SimTime> = gaps
            .iter()
            .map(|gap| {
                at += micros(*gap);
                at
            })
            .collect();
        let pauses: Vec<SimDuration> = pauses.into_iter().map(micros).collect();
        let (line, mut run_until) = serve_host(pauses, SimTime::ZERO, &writes, millis(60));
        run_until(millis(60));
        let line = locked(&line);
        prop_assert_eq!(line.count, 10);
        prop_assert_eq!(line.pauses, 0);
        prop_assert_eq!(line.last.unwrap() - line.first.unwrap(), BYTE_TIME * 9);
    }

    /// Single bytes at arbitrary rates do not stop the twin.
    #[test]
    fn slow_single_bytes_delay_the_twin_by_at_most_a_burst(
        gap in 1_u64..400,
    ) {
        let writes: Vec<SimTime> = (0..2_000).map(|n| millis(1) + micros(gap * n)).collect();
        let end = writes[writes.len() - 1] + micros(1_000);
        let (line, mut run_until) = serve_host(Vec::new(), SimTime::ZERO, &writes, end);
        run_until(end);
        let line = locked(&line);
        prop_assert_eq!(line.count, writes.len());
        // Limited by line and latency, and delayed by at most the waits.
        let sent = (writes[writes.len() - 1] + LATENCY).max(writes[0] + LATENCY + BYTE_TIME * 2_000);
        prop_assert!(line.last.unwrap() <= sent + BURST_MAX + BURST_GAP_MAX);
    }
}
