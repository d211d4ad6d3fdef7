//! Driver and sensor errand by errand: what is said, when, and for how long it is waited.

#[path = "../../hands.rs"]
mod hands;

use hands::{Host, Still, plant, says};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_optoforce::protocol::{Counts, Cutoff, Message, Speed, Status};
use twinrig_optoforce::{OptoForce, OptoForceDriver, Take};
use twinrig_runtime::Driver;
use twinrig_wire::Node;

const PATIENCE: SimDuration = SimDuration::from_millis(200);
const MOMENT: SimDuration = SimDuration::from_millis(3);

fn frame(message: &Message) -> Vec<u8> {
    let mut bytes = Vec::new();
    message.encode(&mut bytes);
    bytes
}

fn sample(counter: u16) -> Vec<u8> {
    frame(&Message::Data {
        counter,
        status: Status::default(),
        counts: Counts::Three([6000, 0, -3000]),
    })
}

fn done() -> Vec<u8> {
    frame(&Message::Acknowledgement { status: 0 })
}

fn configuration(speed: Speed) -> Vec<u8> {
    frame(&Message::Configuration {
        speed,
        cutoff: Cutoff::default(),
        zero: false,
    })
}

fn host(take: Take) -> Host<OptoForceDriver> {
    let config = OptoForce {
        take,
        ..OptoForce::new("foot", "force")
    };
    Host::new(config.driver().unwrap())
}

fn opened(take: Take) -> Host<OptoForceDriver> {
    let mut host = host(take);
    host.open();
    host.reads(MOMENT, &done());
    host.reads(MOMENT, &sample(7));
    assert!(host.is_done());
    host
}

#[test]
fn opening_takes_an_acknowledgement_and_then_a_sample() {
    let mut host = host(Take::Newest);
    assert_eq!(host.open(), configuration(Speed::Hz100));
    assert_eq!(host.waits(), Some(PATIENCE));
    host.reads(MOMENT, &sample(1));
    assert!(!host.is_done(), "it may be as it was set up before");
    assert_eq!(host.waits(), Some(PATIENCE - MOMENT));
    host.reads(MOMENT, &done());
    assert!(!host.is_done());
    assert_eq!(host.waits(), Some(PATIENCE), "time for a sample");
    host.reads(MOMENT, &sample(2));
    assert!(host.is_done());
    assert_eq!(host.waits(), None);
    assert_eq!(host.driver.to_process(), [1600.0, 0.0, -800.0]);
}

#[test]
fn who_must_ask_again_must_be_answered_again() {
    let mut host = host(Take::Newest);
    host.open();
    host.reads(MOMENT, &done());
    assert_eq!(host.waits_in_vain(), configuration(Speed::Hz100));
    host.reads(MOMENT, &sample(1));
    assert!(!host.is_done());
    assert_eq!(host.waits_in_vain(), configuration(Speed::Hz100));
    assert!(host.waits_in_vain().is_empty());
    let why = host.driver.poll_transfer().unwrap_err().why;
    assert!(why.contains("did not acknowledge"), "{why}");
}

#[test]
fn a_sensor_that_refuses_is_an_error_that_says_so() {
    let mut host = host(Take::Newest);
    host.open();
    for _ in 0..3 {
        host.reads(MOMENT, &frame(&Message::Acknowledgement { status: 4 }));
        host.waits_in_vain();
    }
    let why = host.driver.poll_transfer().unwrap_err().why;
    assert!(why.contains("with status 4"), "{why}");
}

#[test]
fn a_transfer_brings_the_newest_at_once_or_waits_for_two_periods_for_a_fresh_one() {
    let mut newest = opened(Take::Newest);
    assert!(newest.begin(&[]).is_empty());
    assert!(newest.is_done());
    let mut fresh = opened(Take::Fresh);
    assert!(fresh.begin(&[]).is_empty());
    assert_eq!(fresh.waits(), Some(SimDuration::from_millis(20)));
    fresh.reads(MOMENT, &sample(7));
    assert!(!fresh.is_done(), "that is the old one");
    fresh.reads(MOMENT, &sample(8));
    assert!(fresh.is_done());
    let stale = fresh.diagnostic("stale");
    fresh.begin(&[]);
    fresh.waits_in_vain();
    assert!(fresh.is_done());
    assert_eq!(fresh.diagnostic("stale"), stale + 1.0);
}

#[test]
fn closing_stops_the_sensor_and_waits_until_it_has_heard() {
    let mut host = opened(Take::Newest);
    assert_eq!(host.close(), configuration(Speed::Stop));
    host.reads(MOMENT, &sample(8));
    assert!(!host.is_done());
    assert_eq!(host.waits_in_vain(), configuration(Speed::Stop));
    host.reads(MOMENT, &done());
    assert!(host.is_done());
}

#[test]
fn the_sensor_acknowledges_after_its_reaction_and_sends_at_its_own_milliseconds() {
    let config = OptoForce::new("foot", "force");
    let mut sensor = config.sensor().unwrap();
    let force = Port::output("force", Unit::Newton, 3);
    sensor.connect("foot", &plant(&[force])).unwrap();
    let mut plant = Still {
        outputs: vec![800.0, 0.0, -400.0],
        ..Still::default()
    };
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    let asked = configuration(Speed::Hz333);
    let tx = says(&mut sensor, &mut plant, (at(1_250), &asked), at(6_900));
    let times: Vec<SimTime> = tx.iter().map(|(at, _)| *at).collect();
    // Once as it is switched on, at 100 Hz; then every third of its milliseconds.
    assert_eq!(times, [at(0), at(1_300), at(3_000), at(6_000)]);
    assert_eq!(tx[1].1, done());
    let counted = frame(&Message::Data {
        counter: 3,
        status: Status::default(),
        counts: Counts::Three([3000, 0, -1500]),
    });
    assert_eq!(tx[3].1, counted);
}
