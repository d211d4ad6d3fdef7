//! Sensors in a rig.

use crate::toys::{Log, any_fixture};
use allocation_counter::measure;
use proptest::prelude::*;
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    DirectIo, Group, Plant, PlantFault, Process, Rig, RigError, Schedule, SensorModel,
    SensorModelError, Timing,
};

const SIGNALS: [&str; 2] = ["tank/level", "tank/pressure"];
const PERIOD: SimDuration = SimDuration::from_millis(2);
const TRANSFER: SimDuration = SimDuration::from_micros(600);

/// A plant whose outputs are the time in seconds.
struct Clock(SimTime);

impl Plant for Clock {
    fn name(&self) -> &'static str {
        "clock"
    }
    fn ports(&self) -> Vec<Port> {
        let port = |name: &&str| Port::output(*name, Unit::Meter, 1);
        SIGNALS.iter().map(port).collect()
    }
    fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        self.0 = to;
        Ok(())
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.fill(self.0.as_secs_f64());
    }
    fn save(&self) -> Snapshot {
        Snapshot::of(&self.0)
    }
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.0 = snapshot.read()?;
        Ok(())
    }
}

struct Reader;

impl Process for Reader {
    fn name(&self) -> &'static str {
        "reader"
    }
    fn ports(&self) -> Vec<Port> {
        let port = |name: &&str| Port::input(*name, Unit::Meter, 1);
        SIGNALS.iter().map(port).collect()
    }
    fn step(&mut self, _: SimDuration, _: &[f64], _: &mut [f64]) {}
    fn restore(&mut self, _: &Snapshot) -> Result<(), SnapshotError> {
        Ok(())
    }
}

/// Returns the rig of the reader and the clock with sensors by signal; each is named `gauge`.
fn rig(sensors: &[(&str, SensorModel)]) -> Rig {
    let transfer = Timing::Constant(TRANSFER);
    let io = DirectIo::for_process("io", &Reader.ports(), transfer, 1).unwrap();
    let schedule = Schedule::with_period(PERIOD);
    let clock = Box::new(Clock(SimTime::ZERO));
    let mut rig = Rig::new(&schedule, Box::new(Reader), vec![Box::new(io)], clock).unwrap();
    for (signal, model) in sensors {
        rig.add_sensor("gauge", signal, model.clone(), 1).unwrap();
    }
    rig
}

fn ms(millis: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(millis)
}

/// Inputs of the process with the times of its steps, up to `to`.
fn reads(rig: &mut Rig, to: SimTime) -> Vec<(SimTime, Vec<f64>)> {
    let mut log = Log::default();
    rig.run_until(to, &mut log).unwrap();
    log.samples_of(Group::ProcessInputs).collect()
}

/// Every effect at once.
fn worst() -> SensorModel {
    SensorModel {
        period: Some(SimDuration::from_millis(3)),
        delay: Timing::Uniform {
            min: SimDuration::from_millis(1),
            max: SimDuration::from_millis(9),
        },
        noise: 0.1,
        bias: 0.5,
        random_walk: 1.0,
        resolution: 0.01,
        range: Some((0.0, 2.0)),
        drop_out: 0.2,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// With every kind of overlap of steps and transfers, the busy tasks of missed steps included.
    #[test]
    fn sensor_without_effects_changes_no_bit(fixture in any_fixture()) {
        let (mut rig, _) = fixture.build();
        for name in fixture.names() {
            let signal = format!("{name}/sample");
            rig.add_sensor("ideal", &signal, SensorModel::default(), 1).unwrap();
        }
        let mut log = Log::default();
        rig.run_until(fixture.duration, &mut log).unwrap();
        prop_assert_eq!(log, fixture.run().log);
    }

    /// Samples in transit, random walks and streams included.
    #[test]
    fn restored_sensors_continue_bit_for_bit(at in 0..60_000_000_u64) {
        let sensors = [(SIGNALS[0], worst()), (SIGNALS[1], worst())];
        let mut original = rig(&sensors);
        reads(&mut original, SimTime::from_nanos(at));
        let mut other = rig(&sensors);
        other.restore(&original.save()).unwrap();
        prop_assert_eq!(reads(&mut other, ms(100)), reads(&mut original, ms(100)));
    }
}

/// The signal is taken in the middle of a transfer; the sensor sees it at its end.
#[test]
fn process_reads_the_newest_sample_that_has_arrived() {
    for delay in [0, 1, 1_400_000, 1_400_001, 7_000_000].map(SimDuration::from_nanos) {
        let model = SensorModel {
            delay: Timing::Constant(delay),
            ..SensorModel::default()
        };
        let read = reads(&mut rig(&[(SIGNALS[0], model)]), ms(40));
        assert_eq!(read.len(), 21);
        for (now, inputs) in read {
            let begins = (0..40).step_by(2).map(ms);
            let arrived = begins.filter(|begin| *begin + TRANSFER + delay <= now);
            let taken = arrived.last().map(|begin| begin + TRANSFER / 2);
            let expected = taken.map_or(0.0, SimTime::as_secs_f64);
            assert_eq!(inputs[0], expected, "{delay} at {now}");
        }
    }
}

#[test]
fn another_sensor_changes_no_number() {
    let alone = reads(&mut rig(&[(SIGNALS[1], worst())]), ms(200));
    let both = reads(
        &mut rig(&[(SIGNALS[0], worst()), (SIGNALS[1], worst())]),
        ms(200),
    );
    let second = |read: &[(SimTime, Vec<f64>)]| -> Vec<u64> {
        read.iter().map(|(_, inputs)| inputs[1].to_bits()).collect()
    };
    assert_eq!(second(&alone), second(&both));
    let (_, last) = both.last().unwrap();
    assert_ne!(last[0], last[1], "equal sensors with equal streams");
}

#[test]
fn plant_is_observed_without_the_sensor() {
    let observed = |sensors: &[(&str, SensorModel)]| {
        let mut log = Log::default();
        rig(sensors).run_until(ms(20), &mut log).unwrap();
        log.samples_of(Group::Plant).collect::<Vec<_>>()
    };
    assert_eq!(observed(&[(SIGNALS[0], worst())]), observed(&[]));
}

#[test]
fn sensors_allocate_nothing_in_a_run() {
    let mut rig = rig(&[(SIGNALS[0], worst()), (SIGNALS[1], worst())]);
    rig.run_until(ms(10), &mut ()).unwrap();
    let allocated = measure(|| rig.run_until(ms(1000), &mut ()).unwrap());
    assert_eq!(allocated.count_total, 0);
}

#[test]
fn unread_and_doubly_sensed_signals_are_refused() {
    let mut rig = rig(&[(SIGNALS[0], SensorModel::default())]);
    let mut refused = |signal: &str| match rig.add_sensor("gauge", signal, worst(), 1) {
        Err(RigError::Sensor { source, .. }) => source,
        other => panic!("{other:?}"),
    };
    let near = vec![SIGNALS[0].to_owned()];
    let process = "reader".to_owned();
    assert_eq!(
        refused("tank/levl"),
        SensorModelError::NotRead { process, near }
    );
    let other = "gauge".to_owned();
    assert_eq!(refused(SIGNALS[0]), SensorModelError::TwoSensors { other });
}
