//! Complete cycles, through the bus controller and directly, with and without errors.

use std::time::Duration;

use super::support::{Rig, Transmitter, frame, micros, slave_with};
use proptest::prelude::*;
use twinrig_kernel::{HostTime, stream};
use twinrig_sbcp::codes::{CLASS_CONTROLLER, CLASS_MOTORDRIVER, HEADER};
use twinrig_sbcp::{
    Address, AnswerPolicy, ControllerConfig, ErrorCode, ForwardingMode, Instruction, Master,
    MasterConfig, Request, RequestError, SlaveConfig, Topology,
};

/// Latency of the host in both directions.
const LATENCIES: Duration = Duration::from_micros(500);

fn all_good(outcomes: &[twinrig_sbcp::Outcome]) -> bool {
    let mut ids = 1..;
    outcomes.len() == 4
        && outcomes
            .iter()
            .all(|outcome| outcome.is_ok_and(|payload| payload[..] == [ids.next().unwrap(); 16]))
}

#[test]
fn cycle_through_the_controller_takes_four_exchanges_three_gaps_and_five_bytes() {
    let mut rig = Rig::new(Topology::Controller);
    for _ in 0..3 {
        let (outcomes, took) = rig.cycle(&frame());
        assert!(all_good(&outcomes), "{outcomes:?}");
        // 30 + 10 + 66 µs each; four bytes until the first address is known, one byte of delay at
        // the end.
        let bus = 4 * 106 + 3 * 2 + 4 * 3 + 3;
        assert_eq!(took, LATENCIES + Duration::from_micros(bus));
    }
    assert_eq!(rig.master.counters().answers, 12);
    assert_eq!(rig.controller.unwrap().counters().answers, 12);
}

#[test]
fn store_and_forward_adds_a_request_and_a_response_to_the_bus_time() {
    let config = ControllerConfig {
        passing: ForwardingMode::StoreAndForward,
        ..ControllerConfig::default()
    };
    let mut rig = Rig::with(MasterConfig::new(Topology::Controller), config);
    let (outcomes, took) = rig.cycle(&frame());
    assert!(all_good(&outcomes));
    let bus = 4 * 106 + 3 * 2 + 30 + 66;
    assert_eq!(took, LATENCIES + Duration::from_micros(bus));
}

#[test]
fn each_board_takes_both_latencies_without_a_controller() {
    let mut rig = Rig::new(Topology::Direct);
    let (outcomes, took) = rig.cycle(&frame());
    assert!(all_good(&outcomes));
    assert_eq!(took, 4 * (LATENCIES + Duration::from_micros(106)));
}

#[test]
fn silent_board_costs_only_its_time_out() {
    let mut rig = Rig::new(Topology::Controller);
    rig.slaves.remove(1);
    let (outcomes, took) = rig.cycle(&frame());
    assert_eq!(outcomes[1], Err(RequestError::Refused(ErrorCode::TIMEOUT)));
    assert!([0, 2, 3].iter().all(|index| outcomes[*index].is_ok()));
    // The error packet is on the link while the next request is on the bus.
    let bus = 3 * 106 + 30 + 20 + 3 * 2 + 4 * 3 + 3;
    assert_eq!(took, LATENCIES + Duration::from_micros(bus));
    assert_eq!(rig.master.counters().errors, 1);
    assert!(rig.master.error_threshold_reached());

    let mut rig = Rig::new(Topology::Direct);
    rig.slaves.remove(1);
    let (outcomes, _) = rig.cycle(&frame());
    assert_eq!(outcomes[1], Err(RequestError::NoAnswer));
    assert!([0, 2, 3].iter().all(|index| outcomes[*index].is_ok()));
}

#[test]
fn boards_may_react_up_to_a_byte_before_the_time_out() {
    for (reaction, good) in [(17, true), (18, false)] {
        let mut rig = Rig::new(Topology::Controller);
        let config = SlaveConfig {
            low_latency_reaction: micros(reaction),
            ..SlaveConfig::new(CLASS_MOTORDRIVER)
        };
        rig.slaves[3] = slave_with(4, config);
        let (outcomes, _) = rig.cycle(&frame());
        assert_eq!(outcomes[3].is_ok(), good, "{reaction} µs");
    }
}

#[test]
fn truncated_response_is_replaced_by_an_error_packet() {
    let mut rig = Rig::new(Topology::Controller);
    let mut sent = 0;
    rig.filter = Box::new(move |transmitter, _, byte| {
        sent += u32::from(transmitter == Transmitter::Board(0));
        (transmitter != Transmitter::Board(0) || sent <= 9).then_some(byte)
    });
    let (outcomes, _) = rig.cycle(&frame());
    assert_eq!(
        outcomes[0],
        Err(RequestError::Refused(ErrorCode::TRUNCATED))
    );
    assert!(outcomes[1..].iter().all(Result::is_ok), "{outcomes:?}");
    rig.filter = Box::new(|_, _, byte| Some(byte));
    assert!(all_good(&rig.cycle(&frame()).0));
}

#[test]
fn error_packet_behind_the_last_truncated_answer_is_found_at_the_time_out() {
    let mut rig = Rig::new(Topology::Controller);
    let mut sent = 0;
    rig.filter = Box::new(move |transmitter, _, byte| {
        sent += u32::from(transmitter == Transmitter::Board(3));
        (transmitter != Transmitter::Board(3) || sent <= 9).then_some(byte)
    });
    let (outcomes, took) = rig.cycle(&frame());
    assert_eq!(
        outcomes[3],
        Err(RequestError::Refused(ErrorCode::TRUNCATED))
    );
    assert_eq!(took, BOUND);
}

#[test]
fn controller_reports_damaged_answers_and_the_next_cycle_is_good() {
    // Byte of the response, and the error code of the controller.
    for (byte_no, code) in [
        (0, ErrorCode::UNEXPECTED),
        (1, ErrorCode::UNEXPECTED),
        (2, ErrorCode::UNEXPECTED),
        (7, ErrorCode::CHECKSUM),
        (21, ErrorCode::CHECKSUM),
    ] {
        let mut rig = Rig::new(Topology::Controller);
        let mut sent = 0;
        rig.filter = Box::new(move |transmitter, _, byte| {
            let hit = transmitter == Transmitter::Board(2) && sent == byte_no;
            sent += u32::from(transmitter == Transmitter::Board(2));
            Some(byte ^ u8::from(hit) << 3)
        });
        let (outcomes, _) = rig.cycle(&frame());
        assert_eq!(
            outcomes[2],
            Err(RequestError::Refused(code)),
            "byte {byte_no}"
        );
        assert!(
            [0, 1, 3].iter().all(|n| outcomes[*n].is_ok()),
            "{outcomes:?}"
        );
        rig.filter = Box::new(|_, _, byte| Some(byte));
        assert!(all_good(&rig.cycle(&frame()).0));
    }
}

#[test]
fn requests_beyond_the_buffer_are_answered_with_errors_in_order() {
    let config = ControllerConfig {
        packets_max: 2,
        ..ControllerConfig::default()
    };
    let mut rig = Rig::with(MasterConfig::new(Topology::Controller), config);
    let (outcomes, _) = rig.cycle(&frame());
    // The first request is on the bus until 118 µs; the second is complete at 60 µs, the third at
    // 90 µs, the fourth at 120 µs.
    assert!(outcomes[0].is_ok() && outcomes[1].is_ok() && outcomes[3].is_ok());
    assert_eq!(outcomes[2], Err(RequestError::Refused(ErrorCode::OVERFLOW)));
    assert_eq!(rig.controller.unwrap().counters().overflows, 1);
}

#[test]
fn controller_answers_requests_to_itself() {
    let mut rig = Rig::new(Topology::Controller);
    let controller = Address::new(CLASS_CONTROLLER, 1).unwrap();
    let ping = Request::new(controller, Instruction::PING, &[]).unwrap();
    assert!(rig.transfer(&ping).unwrap().is_empty());
    let id = Request::new(controller, Instruction::GET, &[0]).unwrap();
    assert_eq!(rig.transfer(&id).unwrap()[..], [1]);
    let absent = Request::new(controller, Instruction::GET, &[0x77]).unwrap();
    let unknown = RequestError::Refused(ErrorCode::UNKNOWN_REGISTER);
    assert_eq!(rig.transfer(&absent), Err(unknown));
    assert_eq!(rig.controller.unwrap().counters().requests, 0);
}

#[test]
fn broadcast_reaches_all_boards_and_is_not_answered() {
    for topology in [Topology::Controller, Topology::Direct] {
        let mut rig = Rig::new(topology);
        let all = Address::new(CLASS_MOTORDRIVER, 0xFE).unwrap();
        let request =
            Request::new(all, Instruction::LOW_LATENCY, &super::support::COMMAND).unwrap();
        let (outcomes, _) = rig.cycle(&[request]);
        assert!(outcomes[0].unwrap().is_empty());
        rig.wait(micros(3_000));
        for slave in &rig.slaves {
            let counters = slave.counters();
            assert_eq!((counters.requests, counters.answers), (1, 0));
        }
        assert!(all_good(&rig.cycle(&frame()).0));
    }
}

#[test]
fn late_answers_are_not_matched_to_later_requests() {
    for topology in [Topology::Controller, Topology::Direct] {
        let mut rig = Rig::new(topology);
        let mut right = 0;
        for round in 0..60_u8 {
            for slave in &mut rig.slaves {
                slave.set_reply(&[round; 16]).unwrap();
            }
            // Occasionally the host is late by up to 1.9 ms, beyond the time-outs.
            rig.latency = micros([250, 250, 250, 900, 250, 1100][usize::from(round) % 6]);
            let (outcomes, _) = rig.cycle(&frame());
            for payload in outcomes.iter().flatten() {
                assert_eq!(payload[..], [round; 16], "{topology:?}");
                right += 1;
            }
        }
        assert!(rig.master.counters().errors > 30, "{topology:?}");
        assert!(right > 100, "{topology:?}: {right}");
    }
}

#[test]
fn first_firmware_answers_from_its_main_loop() {
    let mut rig = Rig::new(Topology::Direct);
    let config = SlaveConfig {
        policy: AnswerPolicy::MainLoop,
        ..SlaveConfig::new(CLASS_MOTORDRIVER)
    };
    rig.slaves[0] = slave_with(1, config);
    let mut answer = Vec::new();
    let request = frame()[0];
    let mut bytes = Vec::new();
    request.emit(&mut bytes);
    let slave = &mut rig.slaves[0];
    slave.receive(twinrig_wire::Piece {
        first: twinrig_kernel::SimTime::from_nanos(3_000),
        spacing: micros(3),
        bytes: &bytes,
        framing_error: false,
    });
    assert_eq!(slave.poll_transmit(&mut answer), None);
    let tick = twinrig_kernel::SimTime::from_nanos(1_000_000);
    slave.main_loop(tick);
    assert_eq!(slave.poll_transmit(&mut answer), Some(tick + micros(10)));
    slave.main_loop(tick + micros(1_000));
    assert_eq!(slave.poll_transmit(&mut answer), None);
}

/// Bound on a cycle through the controller for any bytes on the bus: the master's time-out. Without
/// it the host would wait forever for the last bytes of a truncated answer that an error packet
/// replaces.
const BOUND: Duration = Duration::from_millis(2);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_frame_ends_in_time_and_the_bus_recovers(
        seed in any::<u64>(),
        lost in 0.0..0.5_f64,
        flipped in 0.0..0.2_f64,
        direct in any::<bool>(),
    ) {
        let topology = if direct { Topology::Direct } else { Topology::Controller };
        let mut rig = Rig::new(topology);
        let mut numbers = stream(seed, "bus");
        rig.filter = Box::new(move |_, _, byte| {
            let flip = if numbers.unit() < flipped { 1 << numbers.between(0, 7) } else { 0 };
            (numbers.unit() >= lost).then_some(byte ^ flip)
        });
        for _ in 0..4 {
            let (outcomes, took) = rig.cycle(&frame());
            prop_assert_eq!(outcomes.len(), 4);
            // Direct: four time-outs. Both: possibly the quiet time before them.
            let quiet = Duration::from_millis(1);
            let bound = if direct { Duration::from_millis(4) } else { BOUND };
            prop_assert!(took <= bound + quiet, "{:?}", took);
        }
        rig.filter = Box::new(|_, _, byte| Some(byte));
        let _ = rig.cycle(&frame());
        prop_assert!(all_good(&rig.cycle(&frame()).0));
    }

    #[test]
    fn controller_time_per_request_is_bounded_for_any_answers(
        seed in any::<u64>(),
        chatter in 1..400_usize,
    ) {
        let mut rig = Rig::new(Topology::Controller);
        let mut numbers = stream(seed, "babble");
        let headers = numbers.unit();
        let mut left = chatter;
        rig.filter = Box::new(move |transmitter, _, byte| {
            if transmitter == Transmitter::Near || left == 0 {
                return Some(byte);
            }
            left -= 1;
            let random = u8::try_from(numbers.between(0, 255)).unwrap();
            Some(if numbers.unit() < headers { 0xFF } else { random })
        });
        let (_, took) = rig.cycle(&frame());
        let each = 30 + 20 + 130 + 20 + 2;
        let bound = LATENCIES + Duration::from_micros(4 * each + 12 + 6 * 3);
        prop_assert!(took <= bound, "{:?}", took);
    }
}

#[test]
fn endless_answer_is_abandoned_at_the_limit() {
    let mut controller = twinrig_sbcp::Controller::new(ControllerConfig::default()).unwrap();
    let mut bytes = Vec::new();
    frame()[0].emit(&mut bytes);
    let at = |nanos| twinrig_kernel::SimTime::from_nanos(nanos);
    let piece = |first, bytes| twinrig_wire::Piece {
        first: at(first),
        spacing: micros(3),
        bytes,
        framing_error: false,
    };
    controller.handle_link(at(0), piece(3_000, &bytes));
    while controller.poll_bus(at(1_000_000), &mut |_| {}) {}
    // Header at 45 µs, then a byte every 19 µs: pauses shorter than the time-out.
    let head = [0xFF, CLASS_MOTORDRIVER, 1, 18];
    controller.handle_bus(at(54_000), piece(45_000, &head));
    assert_eq!(
        controller.poll_timeout(),
        Some(at(54_000) + micros(18 * 3) + micros(20))
    );
    let mut deadlines = Vec::new();
    for n in 0..40_u64 {
        let now = 54_000 + 19_000 * (n + 1);
        if controller.poll_timeout().is_some_and(|due| due < at(now)) {
            deadlines.push(controller.poll_timeout().unwrap());
            controller.handle_timeout(at(now));
            break;
        }
        controller.handle_bus(at(now), piece(now, &[0]));
    }
    assert_eq!(deadlines, [at(45_000) + micros(130)]);
}

#[test]
fn cycle_restored_at_every_step_completes() {
    let mut rig = Rig::new(Topology::Controller);
    rig.begin(&frame());
    for step in 0.. {
        if !rig.master.is_busy() {
            break;
        }
        rig.step();
        let snapshot = twinrig_kernel::Snapshot::of(&(&rig.master, &rig.controller, &rig.slaves));
        let (master, controller, slaves) = snapshot.read().unwrap();
        (rig.master, rig.controller, rig.slaves) = (master, controller, slaves);
        let again = twinrig_kernel::Snapshot::of(&(&rig.master, &rig.controller, &rig.slaves));
        assert_eq!(snapshot, again, "step {step}");
    }
    assert!(all_good(rig.master.outcomes()));
}

#[test]
fn unsolicited_bytes_delay_the_next_cycle_until_the_line_is_quiet() {
    let mut rig = Rig::new(Topology::Controller);
    assert!(all_good(&rig.cycle(&frame()).0));
    let now = rig.now;
    rig.master
        .handle_bytes(super::support::host(now), &[0xFF, 1, 1]);
    rig.master
        .cycle(super::support::host(now), &frame())
        .unwrap();
    assert!(!rig.master.poll_transmit(&mut Vec::new()));
    let quiet = now + micros(1_000);
    assert_eq!(rig.master.poll_timeout(), Some(super::support::host(quiet)));
    rig.master.handle_timeout(super::support::host(quiet));
    assert!(rig.master.poll_transmit(&mut Vec::new()));
}

#[test]
fn endless_unsolicited_bytes_delay_a_transfer_by_the_drain_time_out() {
    let mut rig = Rig::new(Topology::Direct);
    let (begin, mut now) = (rig.now, rig.now);
    rig.master.handle_bytes(super::support::host(now), &[0]);
    rig.master
        .cycle(super::support::host(now), &frame())
        .unwrap();
    let mut written = None;
    // A byte every 50 µs.
    while written.is_none() {
        now += micros(50);
        rig.master.handle_bytes(super::support::host(now), &[0]);
        if rig
            .master
            .poll_timeout()
            .is_some_and(|due| due <= super::support::host(now))
        {
            rig.master.handle_timeout(super::support::host(now));
        }
        written = rig.master.poll_transmit(&mut Vec::new()).then_some(now);
        assert!(now - begin <= micros(2_000), "endless wait");
    }
    assert_eq!(written, Some(begin + micros(2_000)));
    assert_eq!(rig.master.counters().drain_timeouts, 1);
}

#[test]
fn silent_board_costs_its_time_out_and_no_quiet_time_without_a_controller() {
    for silent in 0..4 {
        let mut rig = Rig::new(Topology::Direct);
        rig.slaves.remove(silent);
        let good = LATENCIES + Duration::from_micros(106);
        for _ in 0..5 {
            let (outcomes, took) = rig.cycle(&frame());
            assert_eq!(outcomes.iter().filter(|outcome| outcome.is_ok()).count(), 3);
            assert_eq!(took, 3 * good + Duration::from_millis(1));
        }
    }
}

/// The absent board is requested again when time-out and grace have passed since its request, not
/// before.
#[test]
fn single_board_gets_no_request_while_a_late_answer_may_arrive() {
    let mut rig = Rig::new(Topology::Direct);
    rig.slaves.clear();
    let only = [frame()[0]];
    let mut written = Vec::new();
    for _ in 0..4 {
        rig.cycle(&only);
        written.push(rig.written);
    }
    for pair in written.windows(2) {
        assert_eq!(pair[1] - pair[0], micros(2_000));
    }
}

#[test]
fn damaged_answer_ends_the_wait_without_a_controller() {
    let good = LATENCIES + Duration::from_micros(106);
    // Byte of the answer of board 2, and the duration of the cycle.
    for (byte_no, took) in [
        (1, 3 * good + Duration::from_millis(1)),
        (4, 4 * good),
        (12, 4 * good),
        (21, 4 * good),
    ] {
        let mut rig = Rig::new(Topology::Direct);
        let mut sent = 0;
        rig.filter = Box::new(move |transmitter, _, byte| {
            let hit = transmitter == Transmitter::Board(2) && sent == byte_no;
            sent += u32::from(transmitter == Transmitter::Board(2));
            Some(byte ^ u8::from(hit) << 3)
        });
        let (outcomes, found) = rig.cycle(&frame());
        assert_eq!(outcomes[2], Err(RequestError::NoAnswer), "byte {byte_no}");
        assert!(
            [0, 1, 3].iter().all(|n| outcomes[*n].is_ok()),
            "{outcomes:?}"
        );
        assert_eq!(found, took, "byte {byte_no}");
        let counters = rig.master.counters();
        assert_eq!(
            (counters.errors, counters.damaged),
            (1, u64::from(byte_no > 3))
        );
        assert_eq!((counters.strays, counters.garbage), (0, 22));
        rig.filter = Box::new(|_, _, byte| Some(byte));
        let (outcomes, found) = rig.cycle(&frame());
        assert!(all_good(&outcomes));
        assert_eq!(found, 4 * good);
    }
}

/// A beginning of an answer that the time-out discards is an error of its own in the traffic.
#[test]
fn beginning_of_an_answer_is_reported_at_the_time_out() {
    let mut master = Master::new(MasterConfig::new(Topology::Direct));
    let now = HostTime::from_nanos(1_000_000);
    master.cycle(now, &frame()[..1]).unwrap();
    assert!(master.poll_transmit(&mut Vec::new()));
    master.handle_bytes(now, &[HEADER, CLASS_MOTORDRIVER, 1, 16, 0]);
    let due = master.poll_timeout().unwrap();
    master.handle_timeout(due);
    let health = master.traffic().health(due, None, |_| String::new());
    let kinds: Vec<_> = health.errors.iter().map(|error| error.kind).collect();
    assert_eq!(kinds, ["bytes outside frames", "no answer"]);
}
