//! Driver and board, request by request: bytes, times and time-outs.

use crate::FramedDevice;
use crate::rb110::protocol::{Answer, Request};
use crate::rb110::{AnalogInput, PulseMap, Rb110, Rb110Driver};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Driver, Part};
use twinrig_testing::driver_harness::{DriverHarness, StaticPlant, plant, run_device};
use twinrig_wire::FramedMessage;

const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(100);
const PERIOD: SimDuration = SimDuration::from_millis(20);
const SHORT_DELAY: SimDuration = SimDuration::from_millis(3);

/// Two servos of Kondo's, which a special pulse powers off, and an analog input.
fn board() -> Rb110 {
    let mut board = Rb110::with_servos("rb110", PulseMap::KONDO, &[(15, "LF"), (13, "RF")]);
    board.analog = vec![AnalogInput {
        channel: 2,
        analog_source: None,
    }];
    board
}

fn request(bytes: &[u8]) -> Request {
    Request::decode(bytes).unwrap()
}

fn answer(sequence: u8, count: u16) -> Vec<u8> {
    let mut answer = Answer {
        sequence,
        ..Answer::default()
    };
    answer.counts[2] = Some(count);
    answer.to_frame()
}

fn opened() -> DriverHarness<Rb110Driver> {
    let mut host = DriverHarness::new(board().driver().unwrap());
    let sent = request(&host.open());
    assert_eq!(host.timeout(), Some(ANSWER_TIMEOUT));
    assert!(!host.is_done());
    host.receive(SHORT_DELAY, &answer(sent.sequence, 0));
    assert!(host.is_done());
    host
}

#[test]
fn opening_commands_no_pulse_and_is_attempted_three_times() {
    let mut host = DriverHarness::new(board().driver().unwrap());
    let mut sent = vec![request(&host.open())];
    for _ in 0..2 {
        sent.push(request(&host.expire()));
    }
    for (n, request) in sent.iter().enumerate() {
        assert_eq!(request.pulses, [None; 16]);
        assert_eq!(usize::from(request.sequence), n + 1);
        assert_eq!(
            request.inputs,
            [false, false, true, false, false, false, false, false]
        );
    }
    assert!(host.expire().is_empty());
    let reason = host.driver.is_busy().unwrap_err().why;
    assert!(reason.contains("answered none of 3 requests"), "{reason}");
    assert_eq!(host.diagnostic("lost"), 3.0);
}

#[test]
fn transfer_takes_one_period_and_uses_the_first_matching_answer() {
    let mut host = opened();
    let sent = request(&host.begin(&[0.0, f64::NAN]));
    assert_eq!(host.timeout(), Some(PERIOD));
    assert_eq!(
        sent.pulses.iter().flatten().count(),
        1,
        "NaN commands no pulse"
    );
    host.receive(SHORT_DELAY, &answer(sent.sequence.wrapping_sub(1), 100));
    assert_eq!(host.driver.to_process(), [0.0], "an old answer is ignored");
    host.receive(SHORT_DELAY, &answer(sent.sequence, 512));
    host.receive(SHORT_DELAY, &answer(sent.sequence, 1));
    assert_eq!(
        host.driver.to_process(),
        [1.25],
        "half of a reference of 2.5 V"
    );
    assert!(!host.is_done());
    assert_eq!(host.timeout(), Some(PERIOD - SHORT_DELAY * 3));
    host.expire();
    assert!(host.is_done());
    host.begin(&[0.0; 2]);
    host.expire();
    let diagnostics = ["transfers", "lost", "saturated"].map(|name| host.diagnostic(name));
    assert_eq!(diagnostics, [2.0, 1.0, 1.0]);
}

#[test]
fn closing_powers_the_servos_off() {
    let mut host = opened();
    let sent = request(&host.close());
    let mut off = [None; 16];
    (off[13], off[15]) = (Some(2_500), Some(2_500));
    assert_eq!(sent.pulses, off);
    assert!(!host.is_done());
    let again = request(&host.expire());
    assert_eq!(again.pulses, off);
    host.receive(SHORT_DELAY, &answer(again.sequence, 0));
    assert!(host.is_done());
}

#[test]
fn board_answers_after_its_reaction_time_and_reports_replacement() {
    let mut board = board().node().unwrap();
    let commands = ["LF", "RF"].map(|leg| format!("leg/{leg}/abduction/command"));
    let ports = commands.map(|command| Port::input(command, Unit::Radian, 1));
    board.connect("rb110", &plant(&ports)).unwrap();
    let mut plant = StaticPlant {
        inputs: vec![9.0; 2],
        ..StaticPlant::default()
    };
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    let request = |sequence, ticks| {
        let mut request = Request {
            sequence,
            ..Request::default()
        };
        request.pulses[15] = ticks;
        request.to_frame()
    };
    let mut exchange = |micros, bytes: &[u8], to| {
        let tx = run_device(&mut board, &mut plant, (at(micros), bytes), at(to));
        let [(start, bytes)] = &tx[..] else {
            panic!("{tx:?}");
        };
        assert_eq!(*start, at(micros + 20));
        (Answer::decode(bytes).unwrap().replaced, plant.inputs[0])
    };
    // 1.5 ms is the middle of Kondo's range. The command is complete at the end of its first pulse.
    assert_eq!(
        exchange(5_000, &request(1, Some(70_000)), 9_000),
        (false, 9.0)
    );
    assert_eq!(
        exchange(10_000, &request(2, Some(75_000)), 21_499),
        (true, 9.0)
    );
    assert_eq!(exchange(21_499, &request(3, None), 21_500), (false, 0.0));
    // A pulse that has begun is not replaced: the new one follows it.
    let (replaced, angle) = exchange(30_000, &request(4, Some(80_000)), 41_600);
    assert!(!replaced && (angle - std::f64::consts::PI / 16.0).abs() < 1e-9);
}
