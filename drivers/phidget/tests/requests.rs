//! Driver and board errand by errand: what is said, when, and for how long it is waited.

#[path = "../../hands.rs"]
mod hands;

use hands::{Host, Still, plant, says};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_phidget::protocol::{Gain, Message, Setup};
use twinrig_phidget::{Board, Phidget, PhidgetDriver};
use twinrig_runtime::Driver;
use twinrig_wire::Node;

const PATIENCE: SimDuration = SimDuration::from_millis(200);
const INTERVAL: SimDuration = SimDuration::from_millis(80);
const MOMENT: SimDuration = SimDuration::from_millis(3);

fn config() -> Phidget {
    let board = Board::Bridge {
        interval: INTERVAL,
        gain: Gain::X1,
    };
    Phidget::new("scale", board)
}

fn frame(message: &Message) -> Vec<u8> {
    let mut bytes = Vec::new();
    message.encode(&mut bytes);
    bytes
}

fn setup() -> Vec<u8> {
    frame(&Message::Setup(Setup::Bridge {
        interval_ms: 80,
        gain: Gain::X1,
    }))
}

fn accepted(done: bool) -> Vec<u8> {
    frame(&Message::Accepted { done })
}

fn report(sequence: u8) -> Vec<u8> {
    frame(&Message::Bridge {
        sequence,
        overload: [false; 4],
        counts: [1 << 22, 0, 0, 0],
    })
}

fn host() -> Host<PhidgetDriver> {
    Host::new(config().driver().unwrap())
}

#[test]
fn opening_takes_an_accepted_set_up_and_then_a_report() {
    let mut host = host();
    assert_eq!(host.open(), setup());
    assert_eq!(host.waits(), Some(PATIENCE));
    host.reads(MOMENT, &report(1));
    assert!(!host.is_done(), "it may be as it was set up before");
    host.reads(MOMENT, &accepted(true));
    assert!(!host.is_done());
    assert_eq!(host.waits(), Some(PATIENCE + INTERVAL));
    host.reads(MOMENT, &report(2));
    assert!(host.is_done());
    assert_eq!(host.driver.to_process(), [0.5, 0.0, 0.0, 0.0]);
    assert!(host.begin(&[]).is_empty() && host.is_done());
    assert!(host.close().is_empty() && host.is_done());
}

#[test]
fn who_must_ask_again_must_be_answered_again() {
    let mut host = host();
    host.open();
    host.reads(MOMENT, &accepted(true));
    assert_eq!(host.waits_in_vain(), setup());
    host.reads(MOMENT, &report(1));
    assert!(!host.is_done());
    assert_eq!(host.waits_in_vain(), setup());
    assert!(host.waits_in_vain().is_empty());
    let why = host.driver.poll_transfer().unwrap_err().why;
    assert!(why.contains("did not accept"), "{why}");
}

#[test]
fn a_board_that_refuses_is_an_error_that_says_so() {
    let mut host = host();
    host.open();
    for _ in 0..3 {
        host.reads(MOMENT, &accepted(false));
        host.waits_in_vain();
    }
    let why = host.driver.poll_transfer().unwrap_err().why;
    assert!(why.contains("it is another board"), "{why}");
}

#[test]
fn the_board_says_everything_when_usb_asks_it_and_begins_anew_with_each_set_up() {
    let mut board = config().board().unwrap();
    board.connect("scale", &plant(&[])).unwrap();
    let mut plant = Still::default();
    let at = |millis| SimTime::ZERO + SimDuration::from_millis(millis);
    let mut heard = |millis, to| {
        let tx = says(&mut board, &mut plant, (at(millis), &setup()), at(to));
        tx.into_iter()
            .map(|(start, bytes)| (start, bytes == accepted(true)))
            .collect::<Vec<_>>()
    };
    // USB asks every 8 ms. It first says that it has accepted, and then what it reads every 80 ms.
    let first = [(at(8), true), (at(8), false), (at(88), false)];
    assert_eq!(heard(3, 100), first);
    // Without a new set-up the next report would come at 168 ms.
    assert_eq!(heard(110, 130), [(at(112), true), (at(112), false)]);
}
