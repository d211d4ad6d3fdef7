//! The bus controller by itself, byte by byte.

mod support;

use proptest::prelude::*;
use support::{board, frame, micros};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_sbcp::{Controller, ControllerConfig, ErrorCode, Parser, Response};
use twinrig_wire::{Arrivals, Piece};

fn at(micros: u64) -> SimTime {
    SimTime::from_nanos(micros * 1_000)
}

fn piece(first: u64, spacing: u64, bytes: &[u8]) -> Piece<'_> {
    Piece {
        first: at(first),
        spacing: micros(spacing),
        bytes,
        framing_error: false,
    }
}

fn request(which: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    frame()[which].emit(&mut bytes);
    bytes
}

fn response(id: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let response = Response::new(board(id), ErrorCode::OK, &[id; 16]).unwrap();
    response.emit(&mut bytes);
    bytes
}

fn new() -> Controller {
    Controller::new(ControllerConfig::default()).unwrap()
}

/// What it puts on the bus up to `now`: each byte, and when it is complete \[µs\].
fn on_bus(controller: &mut Controller, now: u64) -> Vec<(u64, u8)> {
    let mut said = Vec::new();
    while controller.poll_bus(at(now), &mut |piece| {
        let bytes = piece.bytes.iter().enumerate();
        said.extend(bytes.map(|(n, byte)| (piece.at(n).as_nanos() / 1_000, *byte)));
    }) {}
    said
}

/// What it tells the host: whom of, and how it went.
fn told(controller: &mut Controller) -> Vec<(u8, ErrorCode)> {
    let mut arrivals = Arrivals::default();
    controller.poll_link(&mut arrivals);
    let (mut parser, mut rest) = (Parser::default(), arrivals.bytes());
    let mut all = Vec::new();
    while let Some(packet) = parser.next(&mut rest) {
        let response = Response::parse(&packet).unwrap();
        all.push((response.from().id(), response.error));
    }
    all
}

#[test]
fn what_is_heard_while_it_talks_itself_is_no_answer() {
    let mut controller = new();
    controller.handle_link(at(100), piece(103, 3, &request(0)));
    let end = on_bus(&mut controller, 200).last().unwrap().0;
    // Complete at the very end of the request, and before.
    controller.handle_bus(at(end), piece(end - 63, 3, &response(1)));
    assert_eq!(controller.poll_timeout(), Some(at(end) + micros(20)));
    controller.handle_timeout(at(end + 20));
    assert_eq!(told(&mut controller), [(1, ErrorCode::TIMEOUT)]);
}

#[test]
fn from_a_slow_link_it_sends_without_a_break_and_nothing_before_it_came() {
    let mut controller = new();
    let bytes = request(0);
    let link = piece(10, 7, &bytes);
    controller.handle_link(at(0), link);
    let said = on_bus(&mut controller, 200);
    assert!(said.windows(2).all(|pair| pair[1].0 == pair[0].0 + 3));
    for (n, (end, byte)) in said.iter().enumerate() {
        assert!(at(*end) >= link.at(n) + micros(3) && *byte == bytes[n]);
    }
    assert_eq!(at(said[9].0), link.last() + micros(3));
}

#[test]
fn a_request_that_breaks_off_on_its_way_out_is_answered_and_the_boards_get_silence() {
    let mut controller = new();
    controller.handle_link(at(21), piece(3, 3, &request(0)[..7]));
    let begun = on_bus(&mut controller, 60);
    assert_eq!(begun.len(), 7);
    let due = controller.poll_timeout().unwrap();
    assert_eq!(due, at(21) + micros(15 + 3));
    controller.handle_timeout(due);
    controller.handle_link(due, piece(42, 3, &request(1)));
    let next = on_bus(&mut controller, 200);
    // The first bit comes later than 15 µs after the last one.
    assert!(next[0].0 - 3 > begun[6].0 + 15, "{begun:?} {next:?}");
    assert_eq!(told(&mut controller), [(1, ErrorCode::TRUNCATED)]);
}

#[test]
fn a_request_that_broke_off_does_not_swallow_the_next_one_that_is_announced() {
    let mut controller = new();
    controller.handle_link(at(0), piece(3, 3, &request(0)[..3]));
    controller.handle_link(at(1_000), piece(1_000, 3, &request(1)));
    let said: Vec<u8> = on_bus(&mut controller, 2_000)
        .iter()
        .map(|(_, byte)| *byte)
        .collect();
    assert_eq!(said, request(1));
}

#[test]
fn a_damaged_request_that_had_to_wait_never_gets_on_the_bus() {
    let mut controller = new();
    let mut bytes = request(0);
    bytes.extend(request(1));
    bytes[15] ^= 4;
    controller.handle_link(at(0), piece(3, 3, &bytes));
    let end = on_bus(&mut controller, 100).last().unwrap().0;
    controller.handle_bus(at(end + 79), piece(end + 13, 3, &response(1)));
    assert_eq!(on_bus(&mut controller, 1_000), []);
    let expected = [(1, ErrorCode::OK), (2, ErrorCode::CHECKSUM)];
    assert_eq!(told(&mut controller), expected);
}

#[test]
fn after_noise_it_waits_for_silence_before_it_goes_on() {
    let mut controller = new();
    let bytes = [request(0), request(1)].concat();
    controller.handle_link(at(0), piece(3, 3, &bytes));
    let end = on_bus(&mut controller, 60).last().unwrap().0;
    // An answer without its header, 63 µs long.
    controller.handle_bus(at(end + 20), piece(end + 13, 3, &[0; 3]));
    controller.handle_timeout(at(end + 20));
    controller.handle_bus(at(end + 74), piece(end + 22, 3, &[0; 18]));
    assert_eq!(on_bus(&mut controller, end + 73), []);
    let silence = controller.poll_timeout().unwrap();
    assert_eq!(silence, piece(end + 22, 3, &[0; 18]).last() + micros(20));
    controller.handle_timeout(silence);
    let next = on_bus(&mut controller, end + 200);
    assert_eq!(at(next[0].0), silence + micros(2) + micros(3));
    assert_eq!(told(&mut controller), [(1, ErrorCode::STRANGE)]);
}

#[test]
fn parameters_with_which_no_good_answer_would_pass_are_refused() {
    let good = ControllerConfig::default();
    let bad = [
        ControllerConfig {
            timeout: micros(12),
            ..good
        },
        ControllerConfig {
            response_limit: micros(92),
            ..good
        },
        ControllerConfig {
            packets_max: 0,
            ..good
        },
        ControllerConfig {
            byte_time: SimDuration::ZERO,
            ..good
        },
        ControllerConfig { id: 0xFF, ..good },
    ];
    assert!(bad.iter().all(|config| Controller::new(*config).is_err()));
    let least = ControllerConfig {
        timeout: micros(13),
        ..good
    };
    assert!(Controller::new(least).is_ok());
}

/// What it tells the host, with the times, if an answer comes in pieces that end behind those bytes.
fn passed_on(bytes: &[u8], ends: &[usize]) -> Vec<(SimTime, u8)> {
    let mut controller = new();
    controller.handle_link(at(0), piece(3, 3, &request(0)));
    let end = on_bus(&mut controller, 60).last().unwrap().0;
    let whole = piece(end + 13, 3, bytes);
    let mut begin = 0;
    for end in ends.iter().copied().chain([bytes.len()]) {
        let end = end.clamp(begin, bytes.len());
        let part = Piece {
            first: whole.at(begin),
            bytes: &bytes[begin..end],
            ..whole
        };
        controller.handle_bus(part.last(), part);
        begin = end;
    }
    controller.handle_timeout(at(10_000));
    let mut arrivals = Arrivals::default();
    controller.poll_link(&mut arrivals);
    arrivals.iter().collect()
}

proptest! {
    /// Its header comes within the time-out: else the controller must be woken in between.
    #[test]
    fn in_what_pieces_an_answer_comes_makes_no_difference(
        noise in prop::collection::vec(any::<u8>(), 0..3), damage in prop::option::of((1_usize..22, any::<u8>())),
        len in 1_usize..=22, behind in prop::collection::vec(any::<u8>(), 0..9),
        ends in prop::collection::btree_set(1_usize..30, 0..30),
    ) {
        let mut answer = response(1);
        if let Some((at, flips)) = damage {
            answer[at] ^= flips;
        }
        let bytes = [&noise[..], &answer[..len], &behind].concat();
        let ends: Vec<usize> = ends.into_iter().collect();
        prop_assert_eq!(passed_on(&bytes, &ends), passed_on(&bytes, &[]));
    }
}

/// The bytes one by one, from `first` on at the pace of the bus, one of them with a wrong stop bit.
fn with_framing_error(first: u64, bytes: &[u8], wrong: usize) -> Vec<Piece<'_>> {
    let whole = piece(first, 3, bytes);
    let one = |n: usize| Piece {
        first: whole.at(n),
        bytes: &bytes[n..=n],
        framing_error: n == wrong,
        ..whole
    };
    (0..bytes.len()).map(one).collect()
}

#[test]
fn bytes_with_a_wrong_stop_bit_are_dropped_and_counted_on_either_side() {
    for wrong in 4..10 {
        let (mut controller, request) = (new(), request(0));
        for piece in with_framing_error(3, &request, wrong) {
            controller.handle_link(piece.first, piece);
        }
        controller.handle_timeout(at(200));
        assert_eq!(
            told(&mut controller),
            [(1, ErrorCode::TRUNCATED)],
            "{wrong}"
        );
        assert_eq!(controller.counters().framing_errors, 1);
    }
    for wrong in 4..22 {
        let (mut controller, request, response) = (new(), request(0), response(1));
        controller.handle_link(at(3), piece(3, 3, &request));
        on_bus(&mut controller, 100);
        for piece in with_framing_error(60, &response, wrong) {
            controller.handle_bus(piece.first, piece);
        }
        controller.handle_timeout(at(400));
        assert_eq!(
            told(&mut controller),
            [(1, ErrorCode::TRUNCATED)],
            "{wrong}"
        );
        assert_eq!(controller.counters().framing_errors, 1);
    }
}
