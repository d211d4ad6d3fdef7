//! Devices are opened before the first control step; the plant is held until then; devices with
//! their own timing are woken between transfers.

use crate::toys::{Entry, Log, ToyPlant, ToyProcess};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    Group, IoTask, Observer, Part, PlantAccess, Progress, Rig, RunEvent, Schedule, TaskError,
};

fn millis(n: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(n)
}

/// Device with an opening time, immediate transfers, and a tick every millisecond.
struct SlowDevice {
    opening_time: SimDuration,
    next_tick: SimTime,
    ticks: u8,
}

impl Part for SlowDevice {
    fn diagnostics(&self) -> Vec<Port> {
        vec![Port::output("slow/ticks", Unit::One, 1)]
    }

    fn read_diagnostics(&self, _: SimTime, values: &mut [f64]) {
        values[0] = f64::from(self.ticks);
    }

    fn traces(&self) -> Vec<String> {
        vec!["slow/ticks".into()]
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        passed(0, &[self.ticks]);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.next_tick, self.ticks))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.next_tick, self.ticks) = snapshot.read()?;
        Ok(())
    }
}

impl IoTask for SlowDevice {
    fn name(&self) -> &'static str {
        "slow"
    }

    fn ports(&self) -> Vec<Port> {
        vec![
            Port::input("toy0/command", Unit::Volt, 1),
            Port::output("toy0/sample", Unit::One, 2),
        ]
    }

    fn open(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        Ok(if self.opening_time.is_zero() {
            Progress::Done
        } else {
            Progress::WakeAt(now + self.opening_time)
        })
    }

    fn begin(
        &mut self,
        _: SimTime,
        _: &[f64],
        _: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        Ok(Progress::Done)
    }

    fn wake(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        while self.next_tick <= now {
            self.next_tick += SimDuration::from_millis(1);
            self.ticks += 1;
        }
        Ok(Progress::Done)
    }

    fn idle_wake(&self) -> Option<SimTime> {
        Some(self.next_tick)
    }

    fn to_process(&self) -> &[f64] {
        &[0.0; 2]
    }
}

fn rig(opening_time: SimDuration, plant: ToyPlant) -> Rig {
    let task = SlowDevice {
        opening_time,
        next_tick: SimTime::ZERO,
        ticks: 0,
    };
    Rig::new(
        &Schedule::with_period(SimDuration::from_millis(2)),
        Box::new(ToyProcess::new(&["toy0".into()])),
        vec![Box::new(task)],
        Box::new(plant),
    )
    .unwrap()
}

fn log_of(opening_us: u64, until: SimTime) -> (Log, bool) {
    let opening_time = SimDuration::from_micros(opening_us);
    let mut rig = rig(opening_time, ToyPlant::new(&["toy0".into()]));
    let mut log = Log::default();
    rig.run_until(until, &mut log).unwrap();
    (log, rig.is_open())
}

fn times_of(log: &Log, filter: impl Fn(&RunEvent) -> bool) -> Vec<SimTime> {
    let events = log.events().filter(|(_, event)| filter(event));
    events.map(|(at, _)| at).collect()
}

#[test]
fn first_control_step_requires_all_devices_to_be_open() {
    for (opening_us, first_ms) in [(1, 2), (2_000, 2), (2_001, 4), (5_300, 6)] {
        let (log, open) = log_of(opening_us, millis(9));
        let begun = times_of(&log, |event| matches!(event, RunEvent::ProcessBegin { .. }));
        assert_eq!(begun[..2], [millis(first_ms), millis(first_ms + 2)]);
        assert_eq!(
            times_of(&log, |event| *event == RunEvent::Opened),
            [begun[0]]
        );
        // Opening is not reported as a transfer.
        let ended = times_of(&log, |event| matches!(event, RunEvent::TaskEnd { .. }));
        assert_eq!(ended, begun);
        assert!(open);
    }
    let (log, open) = log_of(50_000, millis(9));
    assert!(!open && log.events().next().is_none());
}

#[test]
fn immediate_opening_emits_no_event() {
    let (log, _) = log_of(0, millis(9));
    let begun = times_of(&log, |event| matches!(event, RunEvent::ProcessBegin { .. }));
    assert_eq!(begun[0], SimTime::ZERO);
    assert!(times_of(&log, |event| *event == RunEvent::Opened).is_empty());
}

/// The plant's outputs are those without opening time, delayed; a fault has the time of the run,
/// not of the plant.
#[test]
fn plant_is_held_until_opened_and_its_time_begins_there() {
    let of_plant = |opening_us, from_ms| -> Vec<Vec<f64>> {
        let (log, _) = log_of(opening_us, millis(from_ms + 10));
        let records = log.0.iter().filter(|(at, _)| *at >= millis(from_ms));
        let records = records.filter_map(|(_, entry)| match entry {
            // The mean since the last observation is omitted: its first window differs.
            Entry::Samples(Group::Plant, bits) => Some(vec![f64::from_bits(bits[0])]),
            _ => None,
        });
        records.collect()
    };
    let (held, free) = (of_plant(5_300, 6), of_plant(0, 0));
    assert_eq!(held.len(), 6);
    assert_eq!(held, free);

    let mut plant = ToyPlant::new(&["toy0".into()]);
    plant.fails_at = Some(millis(3));
    let mut rig = rig(SimDuration::from_micros(5_300), plant);
    let error = rig.run_until(millis(20), &mut ()).unwrap_err();
    assert!(error.to_string().contains("at 9.000 ms"), "{error}");
}

#[test]
fn idle_device_is_woken_at_its_requested_times() {
    let (log, _) = log_of(5_300, millis(9));
    let ticks: Vec<f64> = log
        .samples_of(Group::Diagnostics)
        .map(|(_, values)| values[0])
        .collect();
    // Observed every 2 ms, after all other events of the instant. Busy with opening until 5.3 ms.
    assert_eq!(ticks, [0.0, 0.0, 0.0, 7.0, 9.0]);
}

#[derive(Default)]
struct Bytes(Vec<(SimTime, usize, Vec<u8>)>);

impl Observer for Bytes {
    fn samples(&mut self, _: SimTime, _: Group, _: &[f64]) {}
    fn event(&mut self, _: SimTime, _: RunEvent) {}
    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        self.0.push((now, trace, bytes.to_vec()));
    }
}

#[test]
fn traffic_is_reported_with_its_time() {
    let mut rig = rig(
        SimDuration::from_micros(300),
        ToyPlant::new(&["toy0".into()]),
    );
    assert_eq!(rig.traces(), ["slow/ticks"]);
    let mut bytes = Bytes::default();
    rig.run_until(millis(1), &mut bytes).unwrap();
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    assert_eq!(
        bytes.0,
        [
            (at(0), 0, vec![0]),
            (at(300), 0, vec![1]),
            (at(1_000), 0, vec![2])
        ]
    );
}
