//! What a driver that is made of a protocol does whatever comes, and when; and a device that is made of an emulation.

use proptest::collection::vec;
use proptest::prelude::*;
use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{
    Driver, PlantAccess, PlantFault, PlantSignals, TaskError, Transfer, WiringError,
};
use twinrig_wire::{
    Emulation, FrameMatch, FrameOutcome, FramedDriver, FramedNode, Node, Piece, Protocol,
    RequestKind, TxQueue,
};

const PATIENCE: u64 = 50;
const REST: u64 = 30;

/// `?` asks, `+` says that there is more to come, `!` is all of it.
struct Toy;

#[derive(Default, Serialize, Deserialize)]
struct State {
    heard: [f64; 1],
    timed_out: Vec<RequestKind>,
}

impl Protocol for Toy {
    type State = State;

    const ATTEMPTS: u32 = 3;

    fn match_frame(front: &[u8]) -> FrameMatch {
        match front {
            [] => FrameMatch::Missing(1),
            [b'+' | b'!', ..] => FrameMatch::Frame(1),
            _ => FrameMatch::Garbage,
        }
    }

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &'static str {
        "toy"
    }

    fn ports(&self) -> Vec<Port> {
        vec![Port::output("toy/heard", Unit::One, 1)]
    }

    fn request(
        &self,
        _: &mut State,
        kind: RequestKind,
        from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration> {
        // A transfer of a zero is over at once.
        let any = kind != RequestKind::Transfer || from_process != [0.0];
        any.then(|| {
            request.push(b'?');
            SimDuration::from_nanos(PATIENCE)
        })
    }

    fn receive(&self, state: &mut State, kind: Option<RequestKind>, frame: &[u8]) -> FrameOutcome {
        state.heard[0] += f64::from(frame[0]);
        match (kind, frame) {
            (None, _) => FrameOutcome::Nothing,
            (Some(_), b"+") => FrameOutcome::More(SimDuration::from_nanos(REST)),
            (Some(_), _) => FrameOutcome::Over,
        }
    }

    fn time_out(&self, state: &mut State, kind: RequestKind) {
        state.timed_out.push(kind);
    }

    fn refusal(&self, state: &State) -> String {
        format!("{:?}", state.timed_out)
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.heard
    }
}

#[derive(Clone, Copy, Debug)]
enum Event {
    Open,
    Begin { with_data: bool },
    Close,
    Bytes([u8; 3]),
    Wait(u64),
}

fn events() -> impl Strategy<Value = Vec<Event>> {
    let byte = || prop_oneof![Just(b'+'), Just(b'!'), any::<u8>()];
    let event = prop_oneof![
        Just(Event::Open),
        any::<bool>().prop_map(|with_data| Event::Begin { with_data }),
        Just(Event::Close),
        [byte(), byte(), byte()].prop_map(Event::Bytes),
        (0..80_u64).prop_map(Event::Wait),
    ];
    vec(event, 0..40)
}

/// What is seen of a driver: what it writes, how far it is, when it wants to be woken.
type Seen = (Vec<u8>, Result<Transfer, String>, Option<HostTime>, f64);

fn seen(driver: &mut FramedDriver<Toy>) -> Seen {
    let mut written = Vec::new();
    while driver.poll_transmit(&mut written) {}
    let transfer = driver.poll_transfer().map_err(|error| error.why);
    let heard = driver.to_process()[0];
    (written, transfer, driver.poll_timeout(), heard)
}

/// Lets it happen at `now`, and what time-outs there are until the next.
fn happen(driver: &mut FramedDriver<Toy>, now: &mut u64, event: Event) {
    let at = HostTime::from_nanos(*now);
    match event {
        Event::Open => driver.open(at),
        Event::Begin { with_data } => driver.begin(at, if with_data { &[1.0] } else { &[0.0] }),
        Event::Close => driver.close(at),
        Event::Bytes(bytes) => driver.handle_bytes(at, &bytes),
        Event::Wait(by) => {
            *now += by;
            while let Some(until) = driver.poll_timeout().filter(|at| at.as_nanos() <= *now) {
                driver.handle_timeout(until);
            }
        }
    }
}

proptest! {
    #[test]
    fn whatever_came_before_an_errand_that_nobody_answers_is_over_in_time(
        before in events(), kind in 0..3_usize,
    ) {
        let (mut driver, mut now) = (FramedDriver::new(Toy), 0);
        for event in before {
            happen(&mut driver, &mut now, event);
        }
        // What was asked before and not written yet is not asked any more.
        let (event, asks) = [
            (Event::Open, 3),
            (Event::Begin { with_data: true }, 1),
            (Event::Close, 3),
        ][kind];
        happen(&mut driver, &mut now, event);
        let mut written = Vec::new();
        for asked in 1..=asks {
            while driver.poll_transmit(&mut written) {}
            prop_assert_eq!(&written, &vec![b'?'; asked]);
            let until = now + PATIENCE * asked as u64;
            prop_assert_eq!(driver.poll_timeout(), Some(HostTime::from_nanos(until)));
            // Too early is nothing.
            driver.handle_timeout(HostTime::from_nanos(until - 1));
            prop_assert_eq!(driver.poll_timeout(), Some(HostTime::from_nanos(until)));
            driver.handle_timeout(HostTime::from_nanos(until));
        }
        prop_assert_eq!(driver.poll_timeout(), None);
        prop_assert!(!driver.poll_transmit(&mut written));
        let why = driver.poll_transfer().err().map(|error| error.why);
        prop_assert_eq!(why.is_some(), asks > 1, "a transfer that nobody answers is over");
        let of_rest = why.is_some_and(|why| why.contains("come to rest"));
        prop_assert_eq!(of_rest, kind == 2);
    }

    #[test]
    fn an_answer_in_two_steps_ends_an_errand_however_late_within_its_time(
        first in 0..PATIENCE, second in 0..REST, kind in 0..3_usize,
    ) {
        let mut driver = FramedDriver::new(Toy);
        let event = [Event::Open, Event::Begin { with_data: true }, Event::Close][kind];
        happen(&mut driver, &mut 0, event);
        driver.handle_bytes(HostTime::from_nanos(first), b"x+");
        prop_assert_eq!(driver.poll_timeout(), Some(HostTime::from_nanos(first + REST)));
        prop_assert_eq!(driver.poll_transfer(), Ok(Transfer::Busy));
        driver.handle_bytes(HostTime::from_nanos(first + second), b"!");
        prop_assert_eq!(driver.poll_transfer(), Ok(Transfer::Done));
        prop_assert_eq!(driver.poll_timeout(), None);
        let mut diagnostics = [0.0];
        driver.read_diagnostics(&mut diagnostics);
        prop_assert_eq!(diagnostics, [1.0], "the x is garbage");
    }

    #[test]
    fn a_restored_one_goes_on_as_it_was(events in events(), saved_after in 0..40_usize) {
        let (mut driver, mut now) = (FramedDriver::new(Toy), 0);
        let (head, tail) = events.split_at(saved_after.min(events.len()));
        for &event in head {
            happen(&mut driver, &mut now, event);
        }
        let mut again = FramedDriver::new(Toy);
        again.restore(&driver.save()).unwrap();
        let mut then = now;
        for &event in tail {
            happen(&mut driver, &mut now, event);
            happen(&mut again, &mut then, event);
            prop_assert_eq!(seen(&mut again), seen(&mut driver));
        }
    }
}

#[test]
fn a_transfer_of_which_nothing_is_to_be_waited_for_is_over_at_once() {
    let mut driver = FramedDriver::new(Toy);
    happen(&mut driver, &mut 0, Event::Begin { with_data: false });
    assert_eq!(
        seen(&mut driver),
        (Vec::new(), Ok(Transfer::Done), None, 0.0)
    );
}

/// Says what it hears, three bytes at a time, again, and counts each millisecond aloud.
struct Parrot;

impl Emulation for Parrot {
    type State = u8;

    fn match_frame(front: &[u8]) -> FrameMatch {
        match front.len() {
            length @ 0..=2 => FrameMatch::Missing(3 - length),
            _ => FrameMatch::Frame(3),
        }
    }

    fn initial(&self) -> u8 {
        0
    }

    fn name(&self) -> &'static str {
        "parrot"
    }

    fn connect(&mut self, _: &str, _: &PlantSignals) -> Result<(), WiringError> {
        Ok(())
    }

    fn next_instant(&self, state: &u8) -> Option<SimTime> {
        Some(SimTime::ZERO + SimDuration::from_millis(u64::from(*state)))
    }

    fn act(
        &self,
        state: &mut u8,
        now: SimTime,
        _: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        tx.say(now, |bytes| bytes.push(*state));
        *state += 1;
        Ok(())
    }

    fn receive(
        &self,
        _: &mut u8,
        now: SimTime,
        frame: &[u8],
        _: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        tx.say(now, |bytes| bytes.extend(frame));
        Ok(())
    }
}

struct Nothing;

impl PlantAccess for Nothing {
    fn sample(&mut self, _: std::ops::Range<usize>) -> Result<&[f64], PlantFault> {
        Ok(&[])
    }

    fn actuate(&mut self, _: std::ops::Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut [])
    }
}

fn tx(node: &mut FramedNode<Parrot>) -> Vec<(SimTime, Vec<u8>)> {
    let mut tx = Vec::new();
    let mut bytes = Vec::new();
    while let Some(start) = node.poll_transmit(&mut bytes) {
        tx.push((start, std::mem::take(&mut bytes)));
    }
    tx
}

#[test]
fn a_device_wants_the_bytes_that_are_missing_and_nothing_of_it_is_lost_between_two_lives() {
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    let hears = |node: &mut FramedNode<Parrot>, now, bytes: &[u8]| {
        node.receive(Piece {
            first: now,
            spacing: SimDuration::ZERO,
            bytes,
            framing_error: false,
        });
        node.advance(now, &mut Nothing).unwrap();
    };
    let mut node = FramedNode::new(Parrot);
    assert_eq!(node.attention(), Some(3));
    hears(&mut node, at(400), &[7]);
    assert_eq!(node.attention(), Some(2));
    // Half a frame heard, and two numbers to be said.
    node.advance(at(1_000), &mut Nothing).unwrap();
    let mut again = FramedNode::new(Parrot);
    again.restore(&node.save()).unwrap();
    for node in [&mut node, &mut again] {
        assert_eq!(node.attention(), Some(2));
        assert_eq!(node.next_wake(), Some(at(2_000)));
        hears(node, at(1_500), &[8, 9, 10]);
        let expected = [
            (at(400), vec![0]),
            (at(1_000), vec![1]),
            (at(1_500), vec![7, 8, 9]),
        ];
        assert_eq!(tx(node), expected);
        assert_eq!(node.attention(), Some(2));
    }
}
