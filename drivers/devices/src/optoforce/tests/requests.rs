//! Driver and sensor, request by request: bytes, times and time-outs.

use crate::FramedDevice;
use crate::optoforce::protocol::{Counts, Cutoff, Message, Speed, Status};
use crate::optoforce::{OptoForce, OptoForceDriver, SampleChoice};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Driver, Part};
use twinrig_testing::driver_harness::{DriverHarness, StaticPlant, plant, run_device};
use twinrig_wire::FramedMessage;

const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(200);
const SHORT_DELAY: SimDuration = SimDuration::from_millis(3);

fn sample(counter: u16) -> Vec<u8> {
    Message::Data {
        counter,
        status: Status::default(),
        counts: Counts::Three([6000, 0, -3000]),
    }
    .to_frame()
}

fn done() -> Vec<u8> {
    Message::Acknowledgement { status: 0 }.to_frame()
}

fn configuration(speed: Speed) -> Vec<u8> {
    Message::Configuration {
        speed,
        cutoff: Cutoff::default(),
        zero: false,
    }
    .to_frame()
}

fn host(take: SampleChoice) -> DriverHarness<OptoForceDriver> {
    let config = OptoForce {
        take,
        ..OptoForce::new("foot", "force")
    };
    DriverHarness::new(config.driver().unwrap())
}

fn opened(take: SampleChoice) -> DriverHarness<OptoForceDriver> {
    let mut host = host(take);
    host.open();
    host.receive(SHORT_DELAY, &done());
    host.receive(SHORT_DELAY, &sample(7));
    assert!(host.is_done());
    host
}

#[test]
fn opening_requires_an_acknowledgement_and_then_a_sample() {
    let mut host = host(SampleChoice::Newest);
    assert_eq!(host.open(), configuration(Speed::Hz100));
    assert_eq!(host.timeout(), Some(ANSWER_TIMEOUT));
    host.receive(SHORT_DELAY, &sample(1));
    assert!(
        !host.is_done(),
        "the sample may be of an earlier configuration"
    );
    assert_eq!(host.timeout(), Some(ANSWER_TIMEOUT - SHORT_DELAY));
    host.receive(SHORT_DELAY, &done());
    assert!(!host.is_done());
    assert_eq!(host.timeout(), Some(ANSWER_TIMEOUT), "time for a sample");
    host.receive(SHORT_DELAY, &sample(2));
    assert!(host.is_done());
    assert_eq!(host.timeout(), None);
    assert_eq!(host.driver.to_process(), [1600.0, 0.0, -800.0]);
}

#[test]
fn repeated_opening_requires_a_new_acknowledgement() {
    let mut host = host(SampleChoice::Newest);
    host.open();
    host.receive(SHORT_DELAY, &done());
    assert_eq!(host.expire(), configuration(Speed::Hz100));
    host.receive(SHORT_DELAY, &sample(1));
    assert!(!host.is_done());
    assert_eq!(host.expire(), configuration(Speed::Hz100));
    assert!(host.expire().is_empty());
    let reason = host.driver.is_busy().unwrap_err().why;
    assert!(reason.contains("did not acknowledge"), "{reason}");
}

#[test]
fn rejected_configuration_is_reported_with_its_status() {
    let mut host = host(SampleChoice::Newest);
    host.open();
    for _ in 0..3 {
        host.receive(
            SHORT_DELAY,
            &Message::Acknowledgement { status: 4 }.to_frame(),
        );
        host.expire();
    }
    let reason = host.driver.is_busy().unwrap_err().why;
    assert!(reason.contains("with status 4"), "{reason}");
}

#[test]
fn newest_sample_is_immediate_and_fresh_one_is_awaited_for_two_periods() {
    let mut newest = opened(SampleChoice::Newest);
    assert!(newest.begin(&[]).is_empty());
    assert!(newest.is_done());
    let mut fresh = opened(SampleChoice::Fresh);
    assert!(fresh.begin(&[]).is_empty());
    assert_eq!(fresh.timeout(), Some(SimDuration::from_millis(20)));
    fresh.receive(SHORT_DELAY, &sample(7));
    assert!(!fresh.is_done(), "a repeated sample is not fresh");
    fresh.receive(SHORT_DELAY, &sample(8));
    assert!(fresh.is_done());
    let stale = fresh.diagnostic("stale");
    fresh.begin(&[]);
    fresh.expire();
    assert!(fresh.is_done());
    assert_eq!(fresh.diagnostic("stale"), stale + 1.0);
}

#[test]
fn closing_stops_the_sensor_and_awaits_its_acknowledgement() {
    let mut host = opened(SampleChoice::Newest);
    assert_eq!(host.close(), configuration(Speed::Stop));
    host.receive(SHORT_DELAY, &sample(8));
    assert!(!host.is_done());
    assert_eq!(host.expire(), configuration(Speed::Stop));
    host.receive(SHORT_DELAY, &done());
    assert!(host.is_done());
}

#[test]
fn sensor_acknowledges_after_its_reaction_time_and_samples_by_its_own_clock() {
    let config = OptoForce::new("foot", "force");
    let mut sensor = config.node().unwrap();
    let force = Port::output("force", Unit::Newton, 3);
    sensor.connect("foot", &plant(&[force])).unwrap();
    let mut plant = StaticPlant {
        outputs: vec![800.0, 0.0, -400.0],
        ..StaticPlant::default()
    };
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    let sent = configuration(Speed::Hz333);
    let tx = run_device(&mut sensor, &mut plant, (at(1_250), &sent), at(6_900));
    let times: Vec<SimTime> = tx.iter().map(|(at, _)| *at).collect();
    // Once at power-on, at 100 Hz; then every third of its milliseconds.
    assert_eq!(times, [at(0), at(1_300), at(3_000), at(6_000)]);
    assert_eq!(tx[1].1, done());
    let counted = Message::Data {
        counter: 3,
        status: Status::default(),
        counts: Counts::Three([3000, 0, -1500]),
    }
    .to_frame();
    assert_eq!(tx[3].1, counted);
}
