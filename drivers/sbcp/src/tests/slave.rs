//! Answers of a slave, and requests that it does not answer.

use super::support::{board, micros, slave, slave_with};
use proptest::collection::vec;
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_sbcp::codes::{CLASS_MOTORDRIVER, HEADER, REGISTER_FIRST_OWN, REGISTER_ID};
use twinrig_sbcp::{
    BYTE_TIME, ErrorCode, Instruction, Packet, Register, RegisterTable, Request, Response, Slave,
    SlaveConfig, SlaveEvent,
};
use twinrig_wire::Piece;

const GAIN: u8 = REGISTER_FIRST_OWN;
const STATUS: u8 = REGISTER_FIRST_OWN + 1;
const MODE: u8 = REGISTER_FIRST_OWN + 2;

fn with_registers() -> Slave {
    let specific = [
        Register::u16(GAIN, 400).non_volatile(),
        Register::u16(STATUS, 7).read_only(),
        Register::u8(MODE, 0).within(0, 3),
    ];
    let registers = RegisterTable::new(3, 5, &specific).unwrap();
    Slave::new(SlaveConfig::new(CLASS_MOTORDRIVER), registers).unwrap()
}

fn piece(first: SimTime, bytes: &[u8]) -> Piece<'_> {
    Piece {
        first,
        spacing: BYTE_TIME,
        bytes,
        framing_error: false,
    }
}

fn emitted(request: &Request) -> Vec<u8> {
    let mut bytes = Vec::new();
    request.emit(&mut bytes);
    bytes
}

fn exchange(slave: &mut Slave, now: &mut SimTime, request: &Request) -> Option<Response> {
    *now += micros(100);
    slave.receive(piece(*now, &emitted(request)));
    let mut bytes = Vec::new();
    slave.poll_transmit(&mut bytes)?;
    Some(Response::parse(&Packet::new(&bytes).unwrap()).unwrap())
}

#[test]
fn register_access_returns_values_and_errors() {
    let (mut slave, mut now) = (with_registers(), SimTime::ZERO);
    let mut send = |instruction, payload: &[u8]| {
        let request = Request::new(board(3), instruction, payload).unwrap();
        let response = exchange(&mut slave, &mut now, &request).unwrap();
        assert_eq!(response.from(), board(3));
        (response.error, response.payload.to_vec())
    };
    let (get, set) = (Instruction::GET, Instruction::SET);
    let ok = |bytes: &[u8]| (ErrorCode::OK, bytes.to_vec());
    let no = |error| (error, Vec::new());
    assert_eq!(send(Instruction::PING, &[]), ok(&[]));
    assert_eq!(send(Instruction::PING, &[1]), no(ErrorCode::BAD_LENGTH));
    assert_eq!(send(get, &[REGISTER_ID]), ok(&[3]));
    assert_eq!(send(get, &[GAIN]), ok(&[0x90, 0x01]));
    assert_eq!(send(get, &[]), no(ErrorCode::BAD_LENGTH));
    assert_eq!(send(get, &[0x77]), no(ErrorCode::UNKNOWN_REGISTER));
    assert_eq!(send(set, &[GAIN, 0x2C, 0x01]), ok(&[]));
    assert_eq!(send(get, &[GAIN]), ok(&[0x2C, 0x01]));
    assert_eq!(send(set, &[GAIN, 1]), no(ErrorCode::BAD_LENGTH));
    assert_eq!(send(set, &[]), no(ErrorCode::BAD_LENGTH));
    assert_eq!(send(set, &[STATUS, 1, 0]), no(ErrorCode::READ_ONLY));
    assert_eq!(send(set, &[MODE, 4]), no(ErrorCode::BAD_VALUE));
    assert_eq!(send(set, &[MODE, 3]), ok(&[]));
    assert_eq!(
        send(Instruction(0x66), &[]),
        no(ErrorCode::UNKNOWN_INSTRUCTION)
    );
    assert_eq!(
        send(Instruction::LOW_LATENCY, &[]),
        no(ErrorCode::NOT_READY)
    );
    let written: Vec<_> = std::iter::from_fn(|| slave.poll_event()).collect();
    assert!(matches!(
        written[0],
        SlaveEvent::Written {
            address: GAIN,
            value: 300,
            ..
        }
    ));
    assert!(matches!(
        written[1],
        SlaveEvent::Written {
            address: MODE,
            value: 3,
            ..
        }
    ));
    assert!(matches!(written[2], SlaveEvent::LowLatency { .. }));
    assert_eq!(slave.counters().answers, 15);
}

#[test]
fn only_saved_registers_survive_a_power_cycle() {
    let (mut slave, mut now) = (with_registers(), SimTime::ZERO);
    let mut set = |slave: &mut Slave, address, bytes: &[u8]| {
        let payload = [&[address], bytes].concat();
        let request = Request::new(slave.address(), Instruction::SET, &payload).unwrap();
        assert_eq!(
            exchange(slave, &mut now, &request).unwrap().error,
            ErrorCode::OK
        );
    };
    set(&mut slave, GAIN, &[1, 0]);
    slave.power_cycle();
    assert_eq!(slave.registers().get(GAIN), Some(400));
    set(&mut slave, GAIN, &[2, 0]);
    set(&mut slave, REGISTER_ID, &[9]);
    set(&mut slave, MODE, &[1]);
    let save = Request::new(board(3), Instruction::SAVE, &[]).unwrap();
    let mut later = SimTime::from_nanos(1_000_000_000);
    assert!(exchange(&mut slave, &mut later, &save).is_some());
    slave.registers_mut().put(GAIN, 3).unwrap();
    assert_eq!(slave.address(), board(3));
    slave.power_cycle();
    assert_eq!(slave.registers().get(GAIN), Some(2));
    assert_eq!(slave.registers().get(MODE), Some(0));
    assert_eq!(slave.address(), board(9));
}

#[test]
fn low_latency_answer_starts_ten_microseconds_after_the_last_bit_with_the_reply_of_that_instant() {
    let mut slave = slave(2);
    slave.set_reply(b"before").unwrap();
    let request = Request::new(board(2), Instruction::LOW_LATENCY, &[1, 2, 3, 4]).unwrap();
    let begin = SimTime::from_nanos(1_000_000);
    slave.receive(piece(begin, &emitted(&request)));
    slave.set_reply(b"after").unwrap();
    let end = begin + BYTE_TIME * 9;
    let event = slave.poll_event();
    assert_eq!(
        event,
        Some(SlaveEvent::LowLatency {
            at: end,
            payload: request.payload
        })
    );
    let mut bytes = Vec::new();
    assert_eq!(slave.poll_transmit(&mut bytes), Some(end + micros(10)));
    assert_eq!(Packet::new(&bytes).unwrap().payload(), b"before");
}

#[test]
fn length_of_low_latency_requests_is_checked_if_configured() {
    let config = SlaveConfig {
        low_latency_request: Some(4),
        ..SlaveConfig::new(CLASS_MOTORDRIVER)
    };
    let mut slave = slave_with(1, config);
    let request = Request::new(board(1), Instruction::LOW_LATENCY, &[1, 2, 3]).unwrap();
    let response = exchange(&mut slave, &mut SimTime::ZERO.clone(), &request).unwrap();
    assert_eq!(response.error, ErrorCode::BAD_LENGTH);
    assert_eq!(slave.poll_event(), None);
}

#[test]
fn idle_gap_resets_the_parser_in_any_state() {
    let request = emitted(&Request::new(board(2), Instruction::PING, &[]).unwrap());
    for garbage in [
        &[HEADER][..],
        &[HEADER, CLASS_MOTORDRIVER, 2, 28, 1, 1],
        &[HEADER, CLASS_MOTORDRIVER, 1, 28, 1],
    ] {
        for (silence, received) in [(14, false), (16, true)] {
            let mut slave = slave(2);
            let now = SimTime::from_nanos(1_000_000);
            slave.receive(piece(now, garbage));
            let next = piece(now, garbage).last() + micros(silence) + BYTE_TIME;
            slave.receive(piece(next, &request));
            let answered = slave.poll_transmit(&mut Vec::new()).is_some();
            // A single header has no effect: the next one takes its place.
            assert_eq!(
                answered,
                received || garbage.len() == 1,
                "{garbage:?} {silence}"
            );
        }
    }
}

/// Stream of packets for arbitrary devices, damaged packets and noise.
fn stream() -> impl Strategy<Value = Vec<Vec<u8>>> {
    let packet = (
        1..4_u8,
        1..6_u8,
        prop_oneof![1..5_u8, Just(0x10)],
        vec(any::<u8>(), 0..20),
    );
    let packet = packet.prop_map(|(class, id, code, payload)| {
        let to = twinrig_sbcp::Address::new(class, id).unwrap();
        emitted(&Request::new(to, Instruction(code), &payload).unwrap())
    });
    let noise = vec(prop_oneof![any::<u8>(), Just(HEADER), 0..6_u8], 1..40);
    let damaged = (packet.clone(), any::<prop::sample::Index>(), 1..=255_u8);
    let damaged = damaged.prop_map(|(mut bytes, at, change)| {
        let at = at.index(bytes.len());
        bytes[at] ^= change;
        bytes
    });
    vec(prop_oneof![4 => packet, 1 => noise, 1 => damaged], 1..20)
}

/// Returns the answers with their start times, for a stream received in pieces of these lengths.
fn answers(bytes: &[u8], pieces: &[usize]) -> Vec<(SimTime, Vec<u8>)> {
    let mut slave = slave(2);
    let mut found = Vec::new();
    let mut at = 0;
    let mut lengths = pieces.iter().cycle();
    while at < bytes.len() {
        let count = (*lengths.next().unwrap()).clamp(1, bytes.len() - at);
        let first = SimTime::ZERO + BYTE_TIME * (at as u64 + 1);
        slave.receive(piece(first, &bytes[at..at + count]));
        at += count;
        let mut answer = Vec::new();
        if let Some(start) = slave.poll_transmit(&mut answer) {
            found.push((start, answer));
        }
    }
    found
}

proptest! {
    #[test]
    fn slave_answers_only_complete_requests_to_itself(stream in stream()) {
        let bytes = stream.concat();
        for (start, answer) in answers(&bytes, &[1]) {
            let end = start - SimTime::ZERO - micros(10);
            let received = usize::try_from(end.as_nanos() / BYTE_TIME.as_nanos()).unwrap();
            let request = (6..=32.min(received)).find_map(|len| {
                let packet = Packet::new(&bytes[received - len..received]).ok()?;
                Request::parse(&packet).ok().filter(|request| request.to == board(2))
            });
            prop_assert!(request.is_some());
            let response = Response::parse(&Packet::new(&answer).unwrap()).unwrap();
            prop_assert_eq!(response.from(), board(2));
        }
    }

    #[test]
    fn answers_are_independent_of_the_pieces(
        stream in stream(),
        pieces in vec(1..7_usize, 1..8),
    ) {
        // Pieces contain less than two requests, so that no answer replaces another.
        let bytes = stream.concat();
        prop_assert_eq!(answers(&bytes, &pieces).len(), answers(&bytes, &[1]).len());
        prop_assert_eq!(answers(&bytes, &pieces), answers(&bytes, &[1]));
    }

    #[test]
    fn slave_answers_after_garbage_and_an_idle_gap(garbage in vec(any::<u8>(), 0..100)) {
        let mut slave = slave(2);
        let mut now = SimTime::from_nanos(1_000_000);
        slave.receive(piece(now, &garbage));
        while slave.poll_transmit(&mut Vec::new()).is_some() {}
        now = piece(now, &garbage).last() + BYTE_TIME + SimDuration::from_micros(16);
        let request = Request::new(board(2), Instruction::PING, &[]).unwrap();
        slave.receive(piece(now, &emitted(&request)));
        prop_assert!(slave.poll_transmit(&mut Vec::new()).is_some());
    }
}

#[test]
fn byte_with_a_wrong_stop_bit_is_dropped_and_counted() {
    let (mut slave, mut now) = (slave(3), SimTime::ZERO);
    let request = emitted(&super::support::frame()[2]);
    for wrong in 0..request.len() {
        now += micros(1_000);
        let whole = piece(now, &request);
        for (n, byte) in request.iter().enumerate() {
            slave.receive(Piece {
                first: whole.at(n),
                bytes: &[*byte],
                framing_error: n == wrong,
                ..whole
            });
        }
        assert_eq!(slave.poll_transmit(&mut Vec::new()), None, "byte {wrong}");
        assert_eq!(slave.counters().framing_errors, 1 + wrong as u64);
        // The next request is answered.
        now += micros(1_000);
        slave.receive(piece(now, &request));
        assert!(slave.poll_transmit(&mut Vec::new()).is_some());
    }
}

/// A truncated packet is discarded in the idle gap, even if the first byte behind the gap is
/// dropped.
#[test]
fn dropped_byte_after_an_idle_gap_resets_the_parser() {
    let (mut slave, mut now) = (slave(3), SimTime::from_nanos(1_000_000));
    let long = Request::new(board(3), Instruction::PING, &[7; 16]).unwrap();
    slave.receive(piece(now, &emitted(&long)[..6]));
    now += micros(1_000);
    slave.receive(Piece {
        framing_error: true,
        ..piece(now, &[0])
    });
    slave.receive(piece(
        now + BYTE_TIME,
        &emitted(&super::support::frame()[2]),
    ));
    assert!(slave.poll_transmit(&mut Vec::new()).is_some());
}
