//! Driver made of a protocol, under arbitrary events; device made of an emulation.

use proptest::collection::vec;
use proptest::prelude::*;
use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{
    Driver, Part, PlantAccess, PlantFault, PlantSignals, TaskError, WiringError,
};
use twinrig_wire::{
    Diagnostics, Emulation, FrameError, FrameMatch, FrameOutcome, FramedDriver, FramedMessage,
    FramedNode, Node, Piece, Protocol, RequestKind, TxQueue,
};

const TIMEOUT: u64 = 50;
const REST_TIMEOUT: u64 = 30;

/// `?` is the request, `+` announces a further part, `!` completes the answer.
struct Toy;

#[derive(Default, Serialize, Deserialize)]
struct State {
    sum: [f64; 1],
    timed_out: Vec<RequestKind>,
}

/// Part of an answer; the frame `-` is invalid.
#[derive(Clone, Copy, PartialEq, Eq)]
struct AnswerPart(u8);

impl FramedMessage for AnswerPart {
    fn match_frame(front: &[u8]) -> FrameMatch {
        match front {
            [] => FrameMatch::Missing(1),
            [b'+' | b'!' | b'-', ..] => FrameMatch::Frame(1),
            _ => FrameMatch::Garbage,
        }
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        match frame {
            [part @ (b'+' | b'!')] => Ok(Self(*part)),
            _ => Err(FrameError::Range),
        }
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        bytes.push(self.0);
    }
}

impl Protocol for Toy {
    type State = State;
    type Message = AnswerPart;

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &'static str {
        "toy"
    }

    fn ports(&self) -> Vec<Port> {
        vec![Port::output("toy/sum", Unit::One, 1)]
    }

    fn request(
        &self,
        _: &mut State,
        kind: RequestKind,
        from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration> {
        // A transfer of a zero is complete at once.
        let required = kind != RequestKind::Transfer || from_process != [0.0];
        required.then(|| {
            request.push(b'?');
            SimDuration::from_nanos(TIMEOUT)
        })
    }

    fn handle_message(
        &self,
        state: &mut State,
        kind: Option<RequestKind>,
        part: AnswerPart,
    ) -> FrameOutcome {
        state.sum[0] += f64::from(part.0);
        match (kind, part.0) {
            (None, _) => FrameOutcome::Incomplete,
            (Some(_), b'+') => FrameOutcome::More(SimDuration::from_nanos(REST_TIMEOUT)),
            (Some(_), _) => FrameOutcome::Complete,
        }
    }

    fn time_out(&self, state: &mut State, kind: RequestKind) {
        state.timed_out.push(kind);
    }

    fn open_failure(&self, state: &State) -> String {
        format!("{:?}", state.timed_out)
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.sum
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.value("sum", Unit::Meter, state.sum[0]);
        diagnostics.count("timeouts", state.timed_out.len() as u64);
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
    let byte = || prop_oneof![Just(b'+'), Just(b'!'), Just(b'-'), any::<u8>()];
    let event = prop_oneof![
        Just(Event::Open),
        any::<bool>().prop_map(|with_data| Event::Begin { with_data }),
        Just(Event::Close),
        [byte(), byte(), byte()].prop_map(Event::Bytes),
        (0..80_u64).prop_map(Event::Wait),
    ];
    vec(event, 0..40)
}

/// Observable state of a driver: bytes to write, whether it is busy, time-out, output.
type Observed = (Vec<u8>, Result<bool, String>, Option<HostTime>, f64);

fn observed(driver: &mut FramedDriver<Toy>) -> Observed {
    let mut written = Vec::new();
    while driver.poll_transmit(&mut written) {}
    let busy = driver.is_busy().map_err(|error| error.why);
    let sum = driver.to_process()[0];
    (written, busy, driver.poll_timeout(), sum)
}

/// Applies an event at `now`; `Wait` also handles the time-outs up to its end.
fn apply(driver: &mut FramedDriver<Toy>, now: &mut u64, event: Event) {
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
    fn unanswered_request_times_out_after_any_history(
        before in events(), kind in 0..3_usize,
    ) {
        let (mut driver, mut now) = (FramedDriver::new(Toy), 0);
        for event in before {
            apply(&mut driver, &mut now, event);
        }
        // Requests that were not written yet are discarded.
        let (event, attempts) = [
            (Event::Open, 3),
            (Event::Begin { with_data: true }, 1),
            (Event::Close, 3),
        ][kind];
        apply(&mut driver, &mut now, event);
        let mut written = Vec::new();
        for attempt in 1..=attempts {
            while driver.poll_transmit(&mut written) {}
            prop_assert_eq!(&written, &vec![b'?'; attempt]);
            let until = now + TIMEOUT * attempt as u64;
            prop_assert_eq!(driver.poll_timeout(), Some(HostTime::from_nanos(until)));
            // An early call has no effect.
            driver.handle_timeout(HostTime::from_nanos(until - 1));
            prop_assert_eq!(driver.poll_timeout(), Some(HostTime::from_nanos(until)));
            driver.handle_timeout(HostTime::from_nanos(until));
        }
        prop_assert_eq!(driver.poll_timeout(), None);
        prop_assert!(!driver.poll_transmit(&mut written));
        let why = driver.is_busy().err().map(|error| error.why);
        prop_assert_eq!(why.is_some(), attempts > 1, "an unanswered transfer is not an error");
        let names_shutdown = why.is_some_and(|why| why.contains("shutdown requests"));
        prop_assert_eq!(names_shutdown, kind == 2);
    }

    /// A device that does not answer, and one that answers in another form.
    #[test]
    fn failed_opening_counts_the_bytes_that_are_no_frame(bytes in vec(any::<u8>(), 0..30)) {
        let (mut driver, mut now) = (FramedDriver::new(Toy), 0);
        apply(&mut driver, &mut now, Event::Open);
        let foreign: Vec<u8> = bytes.into_iter().filter(|byte| !b"+!-".contains(byte)).collect();
        driver.handle_bytes(HostTime::from_nanos(0), &foreign);
        apply(&mut driver, &mut now, Event::Wait(10 * TIMEOUT));
        let why = driver.is_busy().unwrap_err().why;
        let counted = why.contains(&format!("; {} bytes arrived that are no frame", foreign.len()));
        prop_assert_eq!(counted, !foreign.is_empty(), "{}", why);
    }

    #[test]
    fn answer_in_two_parts_completes_a_request_within_its_time_outs(
        first in 0..TIMEOUT, second in 0..REST_TIMEOUT, kind in 0..3_usize,
    ) {
        let mut driver = FramedDriver::new(Toy);
        let event = [Event::Open, Event::Begin { with_data: true }, Event::Close][kind];
        apply(&mut driver, &mut 0, event);
        driver.handle_bytes(HostTime::from_nanos(first), b"x+");
        prop_assert_eq!(driver.poll_timeout(), Some(HostTime::from_nanos(first + REST_TIMEOUT)));
        prop_assert_eq!(driver.is_busy(), Ok(true));
        driver.handle_bytes(HostTime::from_nanos(first + second), b"!");
        prop_assert_eq!(driver.is_busy(), Ok(false));
        prop_assert_eq!(driver.poll_timeout(), None);
        let mut diagnostics = [9.0; 3];
        driver.read_diagnostics(&mut diagnostics);
        let sum = f64::from(b'+' + b'!');
        prop_assert_eq!(diagnostics, [sum, 0.0, 1.0], "the x is garbage");
    }

    #[test]
    fn restored_driver_continues_bit_for_bit(events in events(), saved_after in 0..40_usize) {
        let (mut driver, mut now) = (FramedDriver::new(Toy), 0);
        let (head, tail) = events.split_at(saved_after.min(events.len()));
        for &event in head {
            apply(&mut driver, &mut now, event);
        }
        let mut restored = FramedDriver::new(Toy);
        restored.restore(&driver.save()).unwrap();
        let mut then = now;
        for &event in tail {
            apply(&mut driver, &mut now, event);
            apply(&mut restored, &mut then, event);
            prop_assert_eq!(observed(&mut restored), observed(&mut driver));
        }
    }
}

#[test]
fn transfer_without_expected_answer_is_complete_at_once() {
    let mut driver = FramedDriver::new(Toy);
    apply(&mut driver, &mut 0, Event::Begin { with_data: false });
    assert_eq!(observed(&mut driver), (Vec::new(), Ok(false), None, 0.0));
}

#[test]
fn diagnostics_have_the_same_order_as_their_values() {
    let driver = FramedDriver::new(Toy);
    let ports = [
        Port::output("toy/sum", Unit::Meter, 1),
        Port::output("toy/timeouts", Unit::One, 1),
        Port::output("toy/garbage", Unit::One, 1),
    ];
    assert_eq!(driver.diagnostics(), ports);
}

#[test]
fn invalid_frame_has_no_effect_on_a_request() {
    let mut driver = FramedDriver::new(Toy);
    apply(&mut driver, &mut 0, Event::Open);
    let (request, ..) = observed(&mut driver);
    assert_eq!(request, b"?");
    let pending = observed(&mut driver);
    driver.handle_bytes(HostTime::from_nanos(1), b"-");
    assert_eq!(observed(&mut driver), pending);
}

/// Three bytes; invalid if the first is 255.
struct Triple(Vec<u8>);

impl FramedMessage for Triple {
    fn match_frame(front: &[u8]) -> FrameMatch {
        match front.len() {
            length @ 0..=2 => FrameMatch::Missing(3 - length),
            _ => FrameMatch::Frame(3),
        }
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        match frame {
            [255, ..] => Err(FrameError::Range),
            bytes => Ok(Self(bytes.to_vec())),
        }
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        bytes.extend(&self.0);
    }
}

/// Transmits every three received bytes again, `?` for an invalid frame, and a counter each
/// millisecond.
struct Parrot;

impl Emulation for Parrot {
    type State = u8;
    type Message = Triple;

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
        tx.send(now, &Triple(vec![*state]));
        *state += 1;
        Ok(())
    }

    fn handle_message(
        &self,
        _: &mut u8,
        now: SimTime,
        message: Triple,
        _: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        tx.send(now, &message);
        Ok(())
    }

    fn handle_invalid(&self, now: SimTime, error: FrameError, tx: &mut TxQueue) {
        assert_eq!(error, FrameError::Range);
        tx.send(now, &Triple(b"?".to_vec()));
    }
}

struct NoPlant;

impl PlantAccess for NoPlant {
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
fn node_reports_missing_bytes_and_is_restored_within_a_frame() {
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    let deliver = |node: &mut FramedNode<Parrot>, now, bytes: &[u8]| {
        node.receive(Piece {
            first: now,
            spacing: SimDuration::ZERO,
            bytes,
            framing_error: false,
        });
        node.advance(now, &mut NoPlant).unwrap();
    };
    let mut node = FramedNode::new(Parrot);
    assert_eq!(node.min_bytes_needed(), Some(3));
    deliver(&mut node, at(400), &[7]);
    assert_eq!(node.min_bytes_needed(), Some(2));
    // One byte of a frame is received, and two transmissions are pending.
    node.advance(at(1_000), &mut NoPlant).unwrap();
    let mut restored = FramedNode::new(Parrot);
    restored.restore(&node.save()).unwrap();
    for node in [&mut node, &mut restored] {
        assert_eq!(node.min_bytes_needed(), Some(2));
        assert_eq!(node.next_wake(), Some(at(2_000)));
        deliver(node, at(1_500), &[8, 9, 10]);
        let expected = [
            (at(400), vec![0]),
            (at(1_000), vec![1]),
            (at(1_500), vec![7, 8, 9]),
        ];
        assert_eq!(tx(node), expected);
        assert_eq!(node.min_bytes_needed(), Some(2));
    }
}

#[test]
fn node_handles_an_invalid_frame() {
    let mut node = FramedNode::new(Parrot);
    node.receive(Piece {
        first: SimTime::ZERO,
        spacing: SimDuration::ZERO,
        bytes: &[255, 0, 0, 1, 2, 3],
        framing_error: false,
    });
    node.advance(SimTime::ZERO, &mut NoPlant).unwrap();
    let sent: Vec<Vec<u8>> = tx(&mut node).into_iter().map(|(_, bytes)| bytes).collect();
    assert_eq!(sent, [vec![0], b"?".to_vec(), vec![1, 2, 3]]);
}
