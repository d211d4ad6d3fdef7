//! Bus controller without link and bus, byte by byte.

use super::support::{board, frame, micros};
use proptest::prelude::*;
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

/// Returns the bytes put on the bus up to `now`, with their completion times \[µs\].
fn on_bus(controller: &mut Controller, now: u64) -> Vec<(u64, u8)> {
    let mut sent = Vec::new();
    while controller.poll_bus(at(now), &mut |piece| {
        let bytes = piece.bytes.iter().enumerate();
        sent.extend(bytes.map(|(n, byte)| (piece.at(n).as_nanos() / 1_000, *byte)));
    }) {}
    sent
}

/// Returns the packets sent to the host: id of the board and error code.
fn responses(controller: &mut Controller) -> Vec<(u8, ErrorCode)> {
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
fn bytes_received_while_transmitting_are_not_an_answer() {
    let mut controller = new();
    controller.handle_link(at(100), piece(103, 3, &request(0)));
    let end = on_bus(&mut controller, 200).last().unwrap().0;
    // Complete before the request's last bit and exactly at it.
    controller.handle_bus(at(end), piece(end - 63, 3, &response(1)));
    assert_eq!(controller.poll_timeout(), Some(at(end) + micros(20)));
    controller.handle_timeout(at(end + 20));
    assert_eq!(responses(&mut controller), [(1, ErrorCode::TIMEOUT)]);
}

#[test]
fn slow_link_is_relayed_without_pauses_or_early_bytes() {
    let mut controller = new();
    let bytes = request(0);
    let link = piece(10, 7, &bytes);
    controller.handle_link(at(0), link);
    let sent = on_bus(&mut controller, 200);
    assert!(sent.windows(2).all(|pair| pair[1].0 == pair[0].0 + 3));
    for (n, (end, byte)) in sent.iter().enumerate() {
        assert!(at(*end) >= link.at(n) + micros(3) && *byte == bytes[n]);
    }
    assert_eq!(at(sent[9].0), link.last() + micros(3));
}

#[test]
fn request_truncated_while_relayed_is_answered_and_followed_by_silence() {
    let mut controller = new();
    controller.handle_link(at(21), piece(3, 3, &request(0)[..7]));
    let begun = on_bus(&mut controller, 60);
    assert_eq!(begun.len(), 7);
    let due = controller.poll_timeout().unwrap();
    assert_eq!(due, at(21) + micros(15 + 3));
    controller.handle_timeout(due);
    controller.handle_link(due, piece(42, 3, &request(1)));
    let next = on_bus(&mut controller, 200);
    // The first bit is more than 15 µs after the last one.
    assert!(next[0].0 - 3 > begun[6].0 + 15, "{begun:?} {next:?}");
    assert_eq!(responses(&mut controller), [(1, ErrorCode::TRUNCATED)]);
}

#[test]
fn truncated_request_does_not_consume_the_next_announced_one() {
    let mut controller = new();
    controller.handle_link(at(0), piece(3, 3, &request(0)[..3]));
    controller.handle_link(at(1_000), piece(1_000, 3, &request(1)));
    let sent: Vec<u8> = on_bus(&mut controller, 2_000)
        .iter()
        .map(|(_, byte)| *byte)
        .collect();
    assert_eq!(sent, request(1));
}

#[test]
fn damaged_queued_request_is_not_put_on_the_bus() {
    let mut controller = new();
    let mut bytes = request(0);
    bytes.extend(request(1));
    bytes[15] ^= 4;
    controller.handle_link(at(0), piece(3, 3, &bytes));
    let end = on_bus(&mut controller, 100).last().unwrap().0;
    controller.handle_bus(at(end + 79), piece(end + 13, 3, &response(1)));
    assert_eq!(on_bus(&mut controller, 1_000), []);
    let expected = [(1, ErrorCode::OK), (2, ErrorCode::CHECKSUM)];
    assert_eq!(responses(&mut controller), expected);
}

#[test]
fn next_request_waits_for_silence_after_noise() {
    let mut controller = new();
    let bytes = [request(0), request(1)].concat();
    controller.handle_link(at(0), piece(3, 3, &bytes));
    let end = on_bus(&mut controller, 60).last().unwrap().0;
    // Answer without its header, 63 µs long.
    controller.handle_bus(at(end + 20), piece(end + 13, 3, &[0; 3]));
    controller.handle_timeout(at(end + 20));
    controller.handle_bus(at(end + 74), piece(end + 22, 3, &[0; 18]));
    assert_eq!(on_bus(&mut controller, end + 73), []);
    let silence = controller.poll_timeout().unwrap();
    assert_eq!(silence, piece(end + 22, 3, &[0; 18]).last() + micros(20));
    controller.handle_timeout(silence);
    let next = on_bus(&mut controller, end + 200);
    assert_eq!(at(next[0].0), silence + micros(2) + micros(3));
    assert_eq!(responses(&mut controller), [(1, ErrorCode::UNEXPECTED)]);
}

#[test]
fn parameters_that_exclude_valid_answers_are_refused() {
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

/// Returns the bytes sent to the host, with their times, for an answer received in pieces with
/// these ends.
fn forwarded(bytes: &[u8], ends: &[usize]) -> Vec<(SimTime, u8)> {
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
    /// The header is received within the time-out; otherwise the controller would need a call in
    /// between.
    #[test]
    fn relayed_answer_is_independent_of_the_pieces(
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
        prop_assert_eq!(forwarded(&bytes, &ends), forwarded(&bytes, &[]));
    }
}

/// Single bytes from `first` on at the pace of the bus, byte `wrong` with a wrong stop bit.
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
fn bytes_with_a_wrong_stop_bit_are_dropped_and_counted_on_both_sides() {
    for wrong in 4..10 {
        let (mut controller, request) = (new(), request(0));
        for piece in with_framing_error(3, &request, wrong) {
            controller.handle_link(piece.first, piece);
        }
        controller.handle_timeout(at(200));
        assert_eq!(
            responses(&mut controller),
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
            responses(&mut controller),
            [(1, ErrorCode::TRUNCATED)],
            "{wrong}"
        );
        assert_eq!(controller.counters().framing_errors, 1);
    }
}

/// The next request is on the bus as soon as the answer is known, but keeps its place in the buffer
/// until the answer ends, and is counted then.
#[test]
fn whole_answer_changes_no_count_and_no_place_of_the_buffer_before_its_end() {
    let counts = |whole: bool| {
        let config = ControllerConfig {
            packets_max: 2,
            ..ControllerConfig::default()
        };
        let mut controller = Controller::new(config).unwrap();
        controller.handle_link(at(100), piece(103, 3, &[request(0), request(1)].concat()));
        let end = on_bus(&mut controller, 200).last().unwrap().0;
        let answer = response(1);
        let (first, last) = (end + 13, end + 13 + 63);
        if whole {
            assert!(controller.receive_packet(at(end), piece(first, 3, &answer)));
        }
        // The first is on the bus, the second waits: there is no place for a third one.
        controller.handle_link(at(end + 5), piece(end + 10, 3, &request(2)));
        let before = controller.counters_at(at(last - 1));
        if !whole {
            controller.handle_bus(at(last), piece(first, 3, &answer));
        }
        let after = controller.counters_at(at(last));
        controller.handle_link(at(last + 1), piece(last + 5, 3, &request(3)));
        let sent = on_bus(&mut controller, last + 40);
        (before, after, sent)
    };
    let (whole, bytes) = (counts(true), counts(false));
    assert_eq!(whole, bytes);
    let (before, after, sent) = whole;
    assert_eq!(
        (before.requests, before.answers, before.overflows),
        (1, 0, 1)
    );
    assert_eq!((after.requests, after.answers, after.overflows), (2, 1, 1));
    assert_eq!(sent.len(), request(1).len());
}
