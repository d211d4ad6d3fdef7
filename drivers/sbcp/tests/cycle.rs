//! Whole cycles, through the bus controller and directly, when all is well and when it is not.

mod support;

use std::time::Duration;

use proptest::prelude::*;
use support::{Rig, Talker, frame, micros, slave_with};
use twinrig_kernel::stream;
use twinrig_sbcp::codes::{CLASS_CONTROLLER, CLASS_MOTORDRIVER};
use twinrig_sbcp::{
    Address, AnswerPolicy, ControllerConfig, ErrorCode, Failure, Instruction, MasterConfig,
    Passing, Request, SlaveConfig, Topology,
};

/// Both ways over the host's latency.
const LATENCIES: Duration = Duration::from_micros(500);

fn all_good(outcomes: &[twinrig_sbcp::Outcome]) -> bool {
    let mut ids = 1..;
    outcomes.len() == 4
        && outcomes
            .iter()
            .all(|outcome| outcome.is_ok_and(|payload| payload[..] == [ids.next().unwrap(); 16]))
}

#[test]
fn through_the_controller_a_cycle_takes_four_exchanges_three_gaps_and_five_bytes() {
    let mut rig = Rig::new(Topology::Controller);
    for _ in 0..3 {
        let (outcomes, took) = rig.cycle(&frame());
        assert!(all_good(&outcomes), "{outcomes:?}");
        // 30 + 10 + 66 µs each; four bytes until it is known whom the first one is for, one byte behind at the end.
        let bus = 4 * 106 + 3 * 2 + 4 * 3 + 3;
        assert_eq!(took, LATENCIES + Duration::from_micros(bus));
    }
    assert_eq!(rig.master.counters().answers, 12);
    assert_eq!(rig.controller.unwrap().counters().answers, 12);
}

#[test]
fn storing_and_forwarding_costs_a_request_and_a_response_less_what_cutting_through_costs() {
    let config = ControllerConfig {
        passing: Passing::StoreAndForward,
        ..ControllerConfig::default()
    };
    let mut rig = Rig::with(MasterConfig::new(Topology::Controller), config);
    let (outcomes, took) = rig.cycle(&frame());
    assert!(all_good(&outcomes));
    let bus = 4 * 106 + 3 * 2 + 30 + 66;
    assert_eq!(took, LATENCIES + Duration::from_micros(bus));
}

#[test]
fn directly_each_board_costs_both_latencies() {
    let mut rig = Rig::new(Topology::Direct);
    let (outcomes, took) = rig.cycle(&frame());
    assert!(all_good(&outcomes));
    assert_eq!(took, 4 * (LATENCIES + Duration::from_micros(106)));
}

#[test]
fn a_silent_board_costs_its_time_out_and_nobody_else() {
    let mut rig = Rig::new(Topology::Controller);
    rig.slaves.remove(1);
    let (outcomes, took) = rig.cycle(&frame());
    assert_eq!(outcomes[1], Err(Failure::Refused(ErrorCode::TIMEOUT)));
    assert!([0, 2, 3].iter().all(|index| outcomes[*index].is_ok()));
    // The error packet is on the link while the next request is on the bus.
    let bus = 3 * 106 + 30 + 20 + 3 * 2 + 4 * 3 + 3;
    assert_eq!(took, LATENCIES + Duration::from_micros(bus));
    assert_eq!(rig.master.counters().errors, 1);
    assert!(rig.master.is_out_of_errors());

    let mut rig = Rig::new(Topology::Direct);
    rig.slaves.remove(1);
    let (outcomes, _) = rig.cycle(&frame());
    assert_eq!(outcomes[1], Err(Failure::NoAnswer));
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
fn a_response_that_breaks_off_is_replaced_by_an_error_packet() {
    let mut rig = Rig::new(Topology::Controller);
    let mut said = 0;
    rig.fate = Box::new(move |talker, _, byte| {
        said += u32::from(talker == Talker::Board(0));
        (talker != Talker::Board(0) || said <= 9).then_some(byte)
    });
    let (outcomes, _) = rig.cycle(&frame());
    assert_eq!(outcomes[0], Err(Failure::Refused(ErrorCode::TRUNCATED)));
    assert!(outcomes[1..].iter().all(Result::is_ok), "{outcomes:?}");
    rig.fate = Box::new(|_, _, byte| Some(byte));
    assert!(all_good(&rig.cycle(&frame()).0));
}

#[test]
fn the_error_packet_behind_the_last_answer_that_breaks_off_is_found_at_the_time_out() {
    let mut rig = Rig::new(Topology::Controller);
    let mut said = 0;
    rig.fate = Box::new(move |talker, _, byte| {
        said += u32::from(talker == Talker::Board(3));
        (talker != Talker::Board(3) || said <= 9).then_some(byte)
    });
    let (outcomes, took) = rig.cycle(&frame());
    assert_eq!(outcomes[3], Err(Failure::Refused(ErrorCode::TRUNCATED)));
    assert_eq!(took, BOUND);
}

#[test]
fn damage_is_told_by_the_controller_and_good_again_in_the_next_cycle() {
    // Byte of the response, and what the controller says of it.
    for (byte_no, code) in [
        (0, ErrorCode::STRANGE),
        (1, ErrorCode::STRANGE),
        (2, ErrorCode::STRANGE),
        (7, ErrorCode::CHECKSUM),
        (21, ErrorCode::CHECKSUM),
    ] {
        let mut rig = Rig::new(Topology::Controller);
        let mut said = 0;
        rig.fate = Box::new(move |talker, _, byte| {
            let hit = talker == Talker::Board(2) && said == byte_no;
            said += u32::from(talker == Talker::Board(2));
            Some(byte ^ u8::from(hit) << 3)
        });
        let (outcomes, _) = rig.cycle(&frame());
        assert_eq!(outcomes[2], Err(Failure::Refused(code)), "byte {byte_no}");
        assert!(
            [0, 1, 3].iter().all(|n| outcomes[*n].is_ok()),
            "{outcomes:?}"
        );
        rig.fate = Box::new(|_, _, byte| Some(byte));
        assert!(all_good(&rig.cycle(&frame()).0));
    }
}

#[test]
fn requests_that_find_the_buffer_full_come_back_as_errors_in_order() {
    let config = ControllerConfig {
        packets_max: 2,
        ..ControllerConfig::default()
    };
    let mut rig = Rig::with(MasterConfig::new(Topology::Controller), config);
    let (outcomes, _) = rig.cycle(&frame());
    // While the first is on the bus until 118 µs, the second is complete at 60, the third at 90; the fourth at 120.
    assert!(outcomes[0].is_ok() && outcomes[1].is_ok() && outcomes[3].is_ok());
    assert_eq!(outcomes[2], Err(Failure::Refused(ErrorCode::OVERFLOW)));
    assert_eq!(rig.controller.unwrap().counters().overflows, 1);
}

#[test]
fn the_controller_answers_for_itself() {
    let mut rig = Rig::new(Topology::Controller);
    let own = Address::new(CLASS_CONTROLLER, 1).unwrap();
    let ping = Request::new(own, Instruction::PING, &[]).unwrap();
    assert!(rig.transfer(&ping).unwrap().is_empty());
    let id = Request::new(own, Instruction::GET, &[0]).unwrap();
    assert_eq!(rig.transfer(&id).unwrap()[..], [1]);
    let nothing = Request::new(own, Instruction::GET, &[0x77]).unwrap();
    let unknown = Failure::Refused(ErrorCode::UNKNOWN_REGISTER);
    assert_eq!(rig.transfer(&nothing), Err(unknown));
    assert_eq!(rig.controller.unwrap().counters().requests, 0);
}

#[test]
fn a_broadcast_reaches_all_and_is_answered_by_none() {
    for topology in [Topology::Controller, Topology::Direct] {
        let mut rig = Rig::new(topology);
        let all = Address::new(CLASS_MOTORDRIVER, 0xFE).unwrap();
        let request = Request::new(all, Instruction::LOW_LATENCY, &support::COMMAND).unwrap();
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
fn what_comes_late_is_not_taken_for_what_was_asked_since() {
    for topology in [Topology::Controller, Topology::Direct] {
        let mut rig = Rig::new(topology);
        let mut right = 0;
        for round in 0..60_u8 {
            for slave in &mut rig.slaves {
                slave.set_reply(&[round; 16]).unwrap();
            }
            // Now and then the host is late by up to 1.9 ms, beyond the time-outs.
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

/// Bound on a cycle through the controller, whatever becomes of the bytes on the bus: the master's time-out.
/// Without it the host would wait for ever for the last bytes of a bad answer that an error packet replaces.
const BOUND: Duration = Duration::from_millis(2);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_frame_ends_in_time_and_the_next_good_one_is_good(
        seed in any::<u64>(),
        lost in 0.0..0.5_f64,
        flipped in 0.0..0.2_f64,
        direct in any::<bool>(),
    ) {
        let topology = if direct { Topology::Direct } else { Topology::Controller };
        let mut rig = Rig::new(topology);
        let mut numbers = stream(seed, "bus");
        rig.fate = Box::new(move |_, _, byte| {
            let flip = if numbers.unit() < flipped { 1 << numbers.between(0, 7) } else { 0 };
            (numbers.unit() >= lost).then_some(byte ^ flip)
        });
        for _ in 0..4 {
            let (outcomes, took) = rig.cycle(&frame());
            prop_assert_eq!(outcomes.len(), 4);
            // Direct: four time-outs. Either: before them, quiet may be waited for.
            let quiet = Duration::from_millis(1);
            let bound = if direct { Duration::from_millis(4) } else { BOUND };
            prop_assert!(took <= bound + quiet, "{:?}", took);
        }
        rig.fate = Box::new(|_, _, byte| Some(byte));
        let _ = rig.cycle(&frame());
        prop_assert!(all_good(&rig.cycle(&frame()).0));
    }

    #[test]
    fn whatever_the_boards_say_each_request_takes_the_controller_a_bounded_time(
        seed in any::<u64>(),
        chatter in 1..400_usize,
    ) {
        let mut rig = Rig::new(Topology::Controller);
        let mut numbers = stream(seed, "babble");
        let headers = numbers.unit();
        let mut left = chatter;
        rig.fate = Box::new(move |talker, _, byte| {
            if talker == Talker::Near || left == 0 {
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
fn a_board_that_never_stops_talking_is_left_after_the_limit() {
    let mut stuck = twinrig_sbcp::Controller::new(ControllerConfig::default()).unwrap();
    let mut bytes = Vec::new();
    frame()[0].emit(&mut bytes);
    let at = |nanos| twinrig_kernel::SimTime::from_nanos(nanos);
    let piece = |first, bytes| twinrig_wire::Piece {
        first: at(first),
        spacing: micros(3),
        bytes,
        framing_error: false,
    };
    stuck.handle_link(at(0), piece(3_000, &bytes));
    while stuck.poll_bus(at(1_000_000), &mut |_| {}) {}
    // A header from 45 µs on, then a byte every 19 µs: never silent for as long as the time-out.
    let head = [0xFF, CLASS_MOTORDRIVER, 1, 18];
    stuck.handle_bus(at(54_000), piece(45_000, &head));
    assert_eq!(
        stuck.poll_timeout(),
        Some(at(54_000) + micros(18 * 3) + micros(20))
    );
    let mut babbler = Vec::new();
    for n in 0..40_u64 {
        let now = 54_000 + 19_000 * (n + 1);
        if stuck.poll_timeout().is_some_and(|due| due < at(now)) {
            babbler.push(stuck.poll_timeout().unwrap());
            stuck.handle_timeout(at(now));
            break;
        }
        stuck.handle_bus(at(now), piece(now, &[0]));
    }
    assert_eq!(babbler, [at(45_000) + micros(130)]);
}

#[test]
fn saved_and_restored_amid_a_cycle_it_goes_on_alike() {
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
fn after_bytes_that_nobody_asked_for_the_next_cycle_waits_for_quiet() {
    let mut rig = Rig::new(Topology::Controller);
    assert!(all_good(&rig.cycle(&frame()).0));
    let now = rig.now;
    rig.master.handle_bytes(support::host(now), &[0xFF, 1, 1]);
    rig.master.cycle(support::host(now), &frame()).unwrap();
    assert!(!rig.master.poll_transmit(&mut Vec::new()));
    let quiet = now + micros(1_000);
    assert_eq!(rig.master.poll_timeout(), Some(support::host(quiet)));
    rig.master.handle_timeout(support::host(quiet));
    assert!(rig.master.poll_transmit(&mut Vec::new()));
}

#[test]
fn a_talker_without_end_holds_a_transfer_up_for_the_drain_time_out_and_is_counted() {
    let mut rig = Rig::new(Topology::Direct);
    let (begin, mut now) = (rig.now, rig.now);
    rig.master.handle_bytes(support::host(now), &[0]);
    rig.master.cycle(support::host(now), &frame()).unwrap();
    let mut written = None;
    // A byte every 50 µs.
    while written.is_none() {
        now += micros(50);
        rig.master.handle_bytes(support::host(now), &[0]);
        if rig
            .master
            .poll_timeout()
            .is_some_and(|due| due <= support::host(now))
        {
            rig.master.handle_timeout(support::host(now));
        }
        written = rig.master.poll_transmit(&mut Vec::new()).then_some(now);
        assert!(now - begin <= micros(2_000), "it waits for ever");
    }
    assert_eq!(written, Some(begin + micros(2_000)));
    assert_eq!(rig.master.counters().drain_timeouts, 1);
}

#[test]
fn directly_a_silent_board_costs_its_time_out_and_no_silence() {
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

/// The silent one is asked again when its time-out and grace are over since it was asked, not before.
#[test]
fn a_board_alone_on_the_bus_is_not_asked_again_while_its_old_answer_may_come() {
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
fn directly_a_damaged_answer_ends_the_wait_for_it() {
    let good = LATENCIES + Duration::from_micros(106);
    // A byte of the answer of board 2, and how long the cycle takes.
    for (byte_no, took) in [
        (1, 3 * good + Duration::from_millis(1)),
        (4, 4 * good),
        (12, 4 * good),
        (21, 4 * good),
    ] {
        let mut rig = Rig::new(Topology::Direct);
        let mut said = 0;
        rig.fate = Box::new(move |talker, _, byte| {
            let hit = talker == Talker::Board(2) && said == byte_no;
            said += u32::from(talker == Talker::Board(2));
            Some(byte ^ u8::from(hit) << 3)
        });
        let (outcomes, found) = rig.cycle(&frame());
        assert_eq!(outcomes[2], Err(Failure::NoAnswer), "byte {byte_no}");
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
        rig.fate = Box::new(|_, _, byte| Some(byte));
        let (outcomes, found) = rig.cycle(&frame());
        assert!(all_good(&outcomes));
        assert_eq!(found, 4 * good);
    }
}
