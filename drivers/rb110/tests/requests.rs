//! Driver and board errand by errand: what is said, when, and for how long it is waited.

#[path = "../../hands.rs"]
mod hands;

use hands::{Host, Still, plant, says};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_rb110::protocol::{Answer, Frame, Request};
use twinrig_rb110::{AnalogInput, PulseMap, Rb110, Rb110Driver};
use twinrig_runtime::Driver;
use twinrig_wire::Node;

const PATIENCE: SimDuration = SimDuration::from_millis(100);
const PERIOD: SimDuration = SimDuration::from_millis(20);
const MOMENT: SimDuration = SimDuration::from_millis(3);

/// Two servos of Kondo's, whose power is cut by a pulse of its own, and an analog input.
fn board() -> Rb110 {
    let mut board = Rb110::with_servos("rb110", PulseMap::KONDO, &[(15, "LF"), (13, "RF")]);
    board.analog = vec![AnalogInput {
        channel: 2,
        analog_source: None,
    }];
    board
}

fn request(bytes: &[u8]) -> Request {
    Request::try_from(Frame::new(bytes).unwrap()).unwrap()
}

fn answer(sequence: u8, count: u16) -> Vec<u8> {
    let mut answer = Answer {
        sequence,
        ..Answer::default()
    };
    answer.counts[2] = Some(count);
    let mut bytes = Vec::new();
    answer.encode(&mut bytes);
    bytes
}

fn opened() -> Host<Rb110Driver> {
    let mut host = Host::new(board().driver().unwrap());
    let asked = request(&host.open());
    assert_eq!(host.waits(), Some(PATIENCE));
    assert!(!host.is_done());
    host.reads(MOMENT, &answer(asked.sequence, 0));
    assert!(host.is_done());
    host
}

#[test]
fn opening_moves_nothing_and_asks_three_times() {
    let mut host = Host::new(board().driver().unwrap());
    let mut asked = vec![request(&host.open())];
    for _ in 0..2 {
        asked.push(request(&host.waits_in_vain()));
    }
    for (n, request) in asked.iter().enumerate() {
        assert_eq!(request.pulses, [None; 16]);
        assert_eq!(usize::from(request.sequence), n + 1);
        assert_eq!(
            request.inputs,
            [false, false, true, false, false, false, false, false]
        );
    }
    assert!(host.waits_in_vain().is_empty());
    let why = host.driver.poll_transfer().unwrap_err().why;
    assert!(why.contains("answered none of 3 requests"), "{why}");
    assert_eq!(host.diagnostic("lost"), 3.0);
}

#[test]
fn a_transfer_takes_its_period_and_heeds_the_first_answer_to_its_own_request() {
    let mut host = opened();
    let asked = request(&host.begin(&[0.0, f64::NAN]));
    assert_eq!(host.waits(), Some(PERIOD));
    assert_eq!(asked.pulses.iter().flatten().count(), 1, "NaN moves none");
    host.reads(MOMENT, &answer(asked.sequence.wrapping_sub(1), 100));
    assert_eq!(host.driver.to_process(), [0.0], "that is an old one");
    host.reads(MOMENT, &answer(asked.sequence, 512));
    host.reads(MOMENT, &answer(asked.sequence, 1));
    assert_eq!(
        host.driver.to_process(),
        [1.25],
        "half of a reference of 2.5 V"
    );
    assert!(!host.is_done());
    assert_eq!(host.waits(), Some(PERIOD - MOMENT * 3));
    host.waits_in_vain();
    assert!(host.is_done());
    host.begin(&[0.0; 2]);
    host.waits_in_vain();
    let diagnostics = ["transfers", "lost", "saturated"].map(|name| host.diagnostic(name));
    assert_eq!(diagnostics, [2.0, 1.0, 1.0]);
}

#[test]
fn closing_cuts_the_servos_power() {
    let mut host = opened();
    let asked = request(&host.close());
    let mut off = [None; 16];
    (off[13], off[15]) = (Some(2_500), Some(2_500));
    assert_eq!(asked.pulses, off);
    assert!(!host.is_done());
    let again = request(&host.waits_in_vain());
    assert_eq!(again.pulses, off);
    host.reads(MOMENT, &answer(again.sequence, 0));
    assert!(host.is_done());
}

#[test]
fn the_board_answers_after_its_reaction_and_says_what_it_replaced() {
    let mut board = board().board().unwrap();
    let commands = ["LF", "RF"].map(|leg| format!("leg/{leg}/abduction/command"));
    let ports = commands.map(|command| Port::input(command, Unit::Radian, 1));
    board.connect("rb110", &plant(&ports)).unwrap();
    let mut plant = Still {
        inputs: vec![9.0; 2],
        ..Still::default()
    };
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    let request = |sequence, ticks| {
        let mut request = Request {
            sequence,
            ..Request::default()
        };
        request.pulses[15] = ticks;
        let mut bytes = Vec::new();
        request.encode(&mut bytes);
        bytes
    };
    let mut heard = |micros, bytes: &[u8], to| {
        let tx = says(&mut board, &mut plant, (at(micros), bytes), at(to));
        let [(start, bytes)] = &tx[..] else {
            panic!("{tx:?}");
        };
        assert_eq!(*start, at(micros + 20));
        let replaced = Answer::try_from(Frame::new(bytes).unwrap())
            .unwrap()
            .replaced;
        (replaced, plant.inputs[0])
    };
    // 1.5 ms is the middle of Kondo's range. The servo knows at the end of its first pulse.
    assert_eq!(heard(5_000, &request(1, Some(70_000)), 9_000), (false, 9.0));
    assert_eq!(
        heard(10_000, &request(2, Some(75_000)), 21_499),
        (true, 9.0)
    );
    assert_eq!(heard(21_499, &request(3, None), 21_500), (false, 0.0));
    // A pulse that has begun is not replaced but followed.
    let (replaced, angle) = heard(30_000, &request(4, Some(80_000)), 41_600);
    assert!(!replaced && (angle - std::f64::consts::PI / 16.0).abs() < 1e-9);
}
