//! Driver and board, request by request: bytes, times and time-outs.

use crate::FramedDevice;
use crate::phidget::protocol::{Gain, Message, Setup};
use crate::phidget::{Board, Phidget, PhidgetDriver};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Driver, Part};
use twinrig_testing::driver_harness::{DriverHarness, StaticPlant, plant, run_device};
use twinrig_wire::FramedMessage;

const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(200);
const INTERVAL: SimDuration = SimDuration::from_millis(80);
const SHORT_DELAY: SimDuration = SimDuration::from_millis(3);

fn config() -> Phidget {
    let board = Board::Bridge {
        interval: INTERVAL,
        gain: Gain::X1,
    };
    Phidget::new("scale", board)
}

fn setup() -> Vec<u8> {
    Message::Setup(Setup::Bridge {
        interval_ms: 80,
        gain: Gain::X1,
    })
    .to_frame()
}

fn accepted(done: bool) -> Vec<u8> {
    Message::Accepted { done }.to_frame()
}

fn report(sequence: u8) -> Vec<u8> {
    Message::Bridge {
        sequence,
        overload: [false; 4],
        counts: [1 << 22, 0, 0, 0],
    }
    .to_frame()
}

fn host() -> DriverHarness<PhidgetDriver> {
    DriverHarness::new(config().driver().unwrap())
}

#[test]
fn opening_requires_an_accepted_set_up_and_then_a_report() {
    let mut host = host();
    assert_eq!(host.open(), setup());
    assert_eq!(host.timeout(), Some(ANSWER_TIMEOUT));
    host.receive(SHORT_DELAY, &report(1));
    assert!(!host.is_done(), "the report may be of an earlier set-up");
    host.receive(SHORT_DELAY, &accepted(true));
    assert!(!host.is_done());
    assert_eq!(host.timeout(), Some(ANSWER_TIMEOUT + INTERVAL));
    host.receive(SHORT_DELAY, &report(2));
    assert!(host.is_done());
    assert_eq!(host.driver.to_process(), [0.5, 0.0, 0.0, 0.0]);
    assert!(host.begin(&[]).is_empty() && host.is_done());
    assert!(host.close().is_empty() && host.is_done());
}

#[test]
fn repeated_opening_requires_a_new_acceptance() {
    let mut host = host();
    host.open();
    host.receive(SHORT_DELAY, &accepted(true));
    assert_eq!(host.expire(), setup());
    host.receive(SHORT_DELAY, &report(1));
    assert!(!host.is_done());
    assert_eq!(host.expire(), setup());
    assert!(host.expire().is_empty());
    let reason = host.driver.is_busy().unwrap_err().why;
    assert!(reason.contains("did not accept"), "{reason}");
}

#[test]
fn rejected_set_up_is_reported() {
    let mut host = host();
    host.open();
    for _ in 0..3 {
        host.receive(SHORT_DELAY, &accepted(false));
        host.expire();
    }
    let reason = host.driver.is_busy().unwrap_err().why;
    assert!(reason.contains("a board of another type"), "{reason}");
}

#[test]
fn board_transmits_at_polls_and_restarts_its_interval_at_each_set_up() {
    let mut board = config().node().unwrap();
    board.connect("scale", &plant(&[])).unwrap();
    let mut plant = StaticPlant::default();
    let at = |millis| SimTime::ZERO + SimDuration::from_millis(millis);
    let mut exchange = |millis, to| {
        let tx = run_device(&mut board, &mut plant, (at(millis), &setup()), at(to));
        tx.into_iter()
            .map(|(start, bytes)| (start, bytes == accepted(true)))
            .collect::<Vec<_>>()
    };
    // Polled every 8 ms: first the acceptance, then a report every 80 ms.
    let first = [(at(8), true), (at(8), false), (at(88), false)];
    assert_eq!(exchange(3, 100), first);
    // Without a new set-up the next report would be at 168 ms.
    assert_eq!(exchange(110, 130), [(at(112), true), (at(112), false)]);
}
