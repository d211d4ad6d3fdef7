//! An emulated servo on the bus: who answers, when, and with which error.

use proptest::prelude::*;
use twinrig_dynamixel::{
    ErrorNumber, Kept, Parser, ProtocolVersion, Received, Request, Span, Status,
};
use twinrig_kernel::{SimDuration, SimTime};

use super::support::{BYTE_TIME, Line, piece, servo_with};

const ALL: u8 = ProtocolVersion::BROADCAST;
const POSITION: Span = Span {
    address: 132,
    length: 4,
};
const GOAL: u16 = 116;
const TORQUE: u16 = 64;

/// Returns identifiers and errors of answers, with their data.
fn answers(line: &mut Line, request: Request<'_>, id: u8) -> Vec<(u8, u8, Vec<u8>)> {
    let mut parser = Parser::new(ProtocolVersion::Two);
    let mut answers = Vec::new();
    for bytes in line.packets(request, id) {
        parser.push(&bytes);
        while let Some(Received::Packet(packet)) = parser.next_packet() {
            let Status { id, error, data } = packet.status(ProtocolVersion::Two).unwrap();
            answers.push((id, error, data.to_vec()));
        }
    }
    answers
}

/// Returns the error of the only answer to a request to servo 1.
fn error(line: &mut Line, request: Request<'_>) -> ErrorNumber {
    let answers = answers(line, request, 1);
    let [(1, error, _)] = &answers[..] else {
        panic!("{answers:?}");
    };
    ErrorNumber(*error)
}

fn write(address: u16, data: &[u8]) -> Request<'_> {
    Request::Write { address, data }
}

#[test]
fn answers_begin_after_the_return_delay() {
    let mut request = Vec::new();
    Request::Read(POSITION)
        .encode(ProtocolVersion::Two, 1, &mut request)
        .unwrap();
    let end = SimTime::ZERO + BYTE_TIME * request.len() as u64;
    for (register, micros) in [(0, 0), (10, 20), (250, 500), (254, 508)] {
        let mut line = Line::new([servo_with(1, [(9, register)])]);
        let sent = line.send(&request);
        assert_eq!(sent[0].0, end + SimDuration::from_micros(micros));
    }
}

#[test]
fn servos_answer_a_sync_read_in_its_order_each_after_its_delay() {
    let servos = [1, 2, 3].map(|id| servo_with(id, [(9, 50), (132, i32::from(id))]));
    let mut line = Line::new(servos);
    let request = Request::SyncRead {
        span: POSITION,
        ids: &[3, 1, 2],
    };
    let mut bytes = Vec::new();
    request
        .encode(ProtocolVersion::Two, ALL, &mut bytes)
        .unwrap();
    let sent = line.send(&bytes);
    let (delay, answer) = (SimDuration::from_micros(100), BYTE_TIME * 15);
    let first = SimTime::ZERO + BYTE_TIME * bytes.len() as u64 + delay;
    let starts: Vec<SimTime> = sent.iter().map(|(start, _)| *start).collect();
    assert_eq!(
        starts,
        [first, first + answer + delay, first + (answer + delay) * 2]
    );
    let ids: Vec<(u8, u8)> = sent.iter().map(|(_, it)| (it[4], it[9])).collect();
    assert_eq!(ids, [(3, 3), (1, 1), (2, 2)]);
}

#[test]
fn servos_behind_a_missing_one_do_not_answer_a_sync_read() {
    let mut line = Line::new([1, 3].map(|id| servo_with(id, [])));
    let ids = &[1, 2, 3][..];
    let span = POSITION;
    for request in [
        Request::SyncRead { span, ids },
        Request::FastSyncRead { span, ids },
    ] {
        let sent = line.packets(request, ALL);
        assert_eq!(sent.len(), 1, "{sent:02x?}");
        // They answer again afterwards.
        assert_eq!(answers(&mut line, Request::Ping, 3).len(), 1);
    }
}

/// An instruction to another servo ends the wait: its answer is not that of the read.
#[test]
fn a_later_answer_does_not_continue_a_sync_read() {
    let mut line = Line::new([1, 3].map(|id| servo_with(id, [])));
    let request = Request::SyncRead {
        span: POSITION,
        ids: &[1, 2, 3],
    };
    assert_eq!(line.packets(request, ALL).len(), 1);
    line.servos.push(servo_with(2, []));
    line.now = SimTime::ZERO + SimDuration::from_millis(1);
    assert_eq!(answers(&mut line, Request::Ping, 2).len(), 1);
}

/// A servo waits for all before it, however many, and no longer than they need.
#[test]
fn a_turn_ends_when_those_before_are_late() {
    let ids: Vec<u8> = (1..=30).collect();
    let mut line = Line::new(ids.iter().map(|id| servo_with(*id, [(9, 254)])));
    let span = POSITION;
    let request = Request::SyncRead { span, ids: &ids };
    assert_eq!(line.packets(request, ALL).len(), 30);
    for (late, answers) in [(4, 1), (7, 0)] {
        let mut line = Line::new([servo_with(2, [])]);
        let (span, ids) = (POSITION, &[1, 2][..]);
        assert!(
            line.packets(Request::SyncRead { span, ids }, ALL)
                .is_empty()
        );
        line.now = SimTime::ZERO + SimDuration::from_millis(late);
        let (id, error, data) = (1, 0, &[0; 4][..]);
        let mut answer = Vec::new();
        let status = Status { id, error, data };
        ProtocolVersion::Two
            .encode_status(&status, &mut answer)
            .unwrap();
        assert_eq!(line.send(&answer).len(), answers, "{late} ms");
    }
}

#[test]
fn the_status_return_level_selects_the_answers() {
    for (level, [ping, read, written]) in [(0, [1, 0, 0]), (1, [1, 1, 0]), (2, [1, 1, 1])] {
        let mut line = Line::new([servo_with(1, [(68, level)])]);
        let mut count = |request| line.packets(request, 1).len();
        assert_eq!(count(Request::Ping), ping);
        assert_eq!(count(Request::Read(POSITION)), read);
        assert_eq!(count(write(TORQUE, &[1])), written);
        assert_eq!(line.servos[0].registers().get(TORQUE), 1);
    }
}

#[test]
fn all_are_addressed_without_answers_but_to_ping_and_reads_in_turn() {
    let mut line = Line::new([1, 2].map(|id| servo_with(id, [])));
    assert!(line.packets(write(TORQUE, &[1]), ALL).is_empty());
    assert!(line.packets(Request::Read(POSITION), ALL).is_empty());
    assert!(
        line.servos
            .iter()
            .all(|servo| servo.registers().get(TORQUE) == 1)
    );
    let found = answers(&mut line, Request::Ping, ALL);
    let model = vec![0xb0, 0x04, 52];
    assert_eq!(found, [(1, 0, model.clone()), (2, 0, model)]);
}

#[test]
fn writes_are_refused_as_documented_and_change_nothing() {
    let mut line = Line::new([servo_with(1, [])]);
    let before = line.servos[0].registers().save();
    for (request, expected) in [
        // Out of its range; beyond a limit; a part of a register; read-only; no register; beyond
        // all.
        (write(TORQUE, &[2]), ErrorNumber::DATA_RANGE),
        (write(GOAL, &[0, 16, 0, 0]), ErrorNumber::DATA_LIMIT),
        (write(100, &[0x76, 3]), ErrorNumber::DATA_LIMIT),
        (write(GOAL, &[0, 1]), ErrorNumber::DATA_LENGTH),
        (write(GOAL + 2, &[0, 0]), ErrorNumber::DATA_LENGTH),
        (write(POSITION.address, &[0; 4]), ErrorNumber::ACCESS),
        (write(14, &[0]), ErrorNumber::ACCESS),
        (write(1_000, &[0]), ErrorNumber::ACCESS),
        // The first of two registers is valid.
        (write(64, &[1, 2]), ErrorNumber::DATA_RANGE),
        (
            Request::Read(Span {
                address: 220,
                length: 9,
            }),
            ErrorNumber::ACCESS,
        ),
        (Request::Action, ErrorNumber::INSTRUCTION),
    ] {
        assert_eq!(error(&mut line, request), expected, "{request:?}");
        assert_eq!(line.servos[0].registers().save(), before, "{request:?}");
    }
    assert_eq!(line.servos[0].counters().refused, 11);
}

#[test]
fn torque_locks_the_eeprom() {
    let mut line = Line::new([servo_with(1, [])]);
    assert_eq!(error(&mut line, write(TORQUE, &[1])), ErrorNumber::OK);
    assert_eq!(error(&mut line, write(7, &[5])), ErrorNumber::ACCESS);
    assert_eq!(error(&mut line, write(TORQUE, &[0])), ErrorNumber::OK);
    assert_eq!(error(&mut line, write(9, &[5])), ErrorNumber::OK);
    // The answer has the new identifier. ASSUMED.
    let answers = answers(&mut line, write(7, &[5]), 1);
    assert_eq!(answers, [(5, 0, vec![])]);
}

#[test]
fn goals_beyond_a_turn_are_accepted_in_extended_position_mode() {
    let mut line = Line::new([servo_with(1, [])]);
    let far = 100_000_i32.to_le_bytes();
    assert_eq!(error(&mut line, write(GOAL, &far)), ErrorNumber::DATA_LIMIT);
    assert_eq!(error(&mut line, write(11, &[4])), ErrorNumber::OK);
    assert_eq!(error(&mut line, write(GOAL, &far)), ErrorNumber::OK);
    assert_eq!(line.servos[0].registers().get(GOAL), 100_000);
    assert_eq!(
        error(&mut line, write(GOAL, &(-5_i32).to_le_bytes())),
        ErrorNumber::OK
    );
    assert_eq!(line.servos[0].registers().get(GOAL), -5);
}

#[test]
fn a_registered_write_waits_for_the_action() {
    let mut line = Line::new([servo_with(1, [])]);
    let (address, data) = (GOAL, &[100, 0, 0, 0][..]);
    assert_eq!(
        error(&mut line, Request::RegWrite { address, data }),
        ErrorNumber::OK
    );
    assert_eq!(
        [GOAL, 69].map(|it| line.servos[0].registers().get(it)),
        [0, 1]
    );
    assert_eq!(error(&mut line, Request::Action), ErrorNumber::OK);
    assert_eq!(
        [GOAL, 69].map(|it| line.servos[0].registers().get(it)),
        [100, 0]
    );
}

#[test]
fn restart_and_factory_reset_keep_what_they_should() {
    let mut line = Line::new([servo_with(
        1,
        [(8, 3), (9, 0), (10, 1), (TORQUE, 1), (GOAL, 7)],
    )]);
    assert_eq!(error(&mut line, Request::Reboot), ErrorNumber::OK);
    let values = |line: &Line| [7, 8, 10, 64, 116].map(|it| line.servos[0].registers().get(it));
    assert_eq!(values(&line), [1, 3, 1, 0, 0]);
    let reset = |line: &mut Line, kept| error(line, Request::FactoryReset(kept));
    assert_eq!(reset(&mut line, Kept::IdAndBaudRate), ErrorNumber::OK);
    assert_eq!(values(&line), [1, 3, 0, 0, 0]);
    assert_eq!(reset(&mut line, Kept::Id), ErrorNumber::OK);
    assert_eq!(values(&line), [1, 1, 0, 0, 0]);
}

#[test]
fn indirect_registers_are_bytes_of_others() {
    let mut line = Line::new([servo_with(1, [(POSITION.address, 0x1234)])]);
    // The goal, and the first two bytes of the position.
    let targets: Vec<u8> = [116_u16, 117, 118, 119, 132, 133]
        .iter()
        .flat_map(|it| it.to_le_bytes())
        .collect();
    assert_eq!(error(&mut line, write(168, &targets)), ErrorNumber::OK);
    assert_eq!(error(&mut line, write(208, &[1, 2, 0, 0])), ErrorNumber::OK);
    assert_eq!(line.servos[0].registers().get(GOAL), 0x201);
    assert_eq!(error(&mut line, write(212, &[1, 2])), ErrorNumber::ACCESS);
    assert_eq!(
        error(&mut line, write(168, &[10, 0])),
        ErrorNumber::DATA_RANGE
    );
    let read = Request::Read(Span {
        address: 208,
        length: 6,
    });
    let found = answers(&mut line, read, 1);
    assert_eq!(found, [(1, 0, vec![1, 2, 0, 0, 0x34, 0x12])]);
}

/// An answer to a ping to all comes in the slot of its identifier, unless another instruction comes
/// before.
#[test]
fn an_instruction_ends_the_wait_for_the_slot_of_a_ping() {
    let (mut ping, mut read) = (Vec::new(), Vec::new());
    let two = ProtocolVersion::Two;
    Request::Ping.encode(two, ALL, &mut ping).unwrap();
    Request::Read(POSITION).encode(two, 200, &mut read).unwrap();
    let mut servo = servo_with(200, []);
    let first = piece(SimTime::ZERO, &ping);
    servo.receive(first);
    servo.handle(first.last());
    // 200 slots of 14 bytes and 3 ms.
    let slot = first.last() + (BYTE_TIME * 14 + SimDuration::from_millis(3)) * 200;
    assert_eq!(servo.next_wake(), Some(slot));
    let second = piece(first.last() + SimDuration::from_millis(10), &read);
    servo.receive(second);
    servo.handle(second.last());
    let mut answer = Vec::new();
    assert_eq!(servo.poll_transmit(&mut answer), Some(second.last()));
    assert_eq!((answer.len(), servo.next_wake()), (15, None));
}

/// A servo that waits for its part of a fast read takes other bytes for the next instruction.
#[test]
fn a_servo_does_not_transmit_into_the_next_instruction() {
    let mut line = Line::new([servo_with(2, [])]);
    let (mut read, mut write) = (Vec::new(), Vec::new());
    let request = Request::FastSyncRead {
        span: POSITION,
        ids: &[1, 2],
    };
    request
        .encode(ProtocolVersion::Two, ALL, &mut read)
        .unwrap();
    let data = [2, 7, 1, 0, 0, 3, 0, 0, 0, 0];
    let span = Span {
        address: GOAL,
        length: 4,
    };
    let goals = Request::SyncWrite { span, data: &data };
    goals.encode(ProtocolVersion::Two, ALL, &mut write).unwrap();
    assert!(line.send(&read).is_empty());
    line.now = SimTime::ZERO + SimDuration::from_millis(2);
    assert!(line.send(&write).is_empty());
    assert_eq!(line.servos[0].registers().get(GOAL), 0x107);
}

/// Goals, limits and gains as documented for another operating mode.
#[test]
fn another_operating_mode_resets_goals_and_gains() {
    let mut line = Line::new([servo_with(1, [(36, 800), (100, 0), (84, 7), (112, 9)])]);
    assert_eq!(error(&mut line, write(11, &[2])), ErrorNumber::DATA_RANGE);
    assert_eq!(error(&mut line, write(11, &[16])), ErrorNumber::OK);
    let values = [100, 102, 84, 112].map(|it| line.servos[0].registers().get(it));
    assert_eq!(values, [800, 1_750, 400, 0]);
}

#[test]
fn torque_on_makes_the_position_the_goal_until_one_is_written() {
    let mut line = Line::new([servo_with(1, [(132, 2_222)])]);
    assert_eq!(error(&mut line, write(TORQUE, &[1])), ErrorNumber::OK);
    assert_eq!(line.servos[0].registers().get(GOAL), 2_222);
    assert_eq!(
        error(&mut line, write(GOAL, &[52, 8, 0, 0])),
        ErrorNumber::OK
    );
    assert_eq!(error(&mut line, write(TORQUE, &[1])), ErrorNumber::OK);
    assert_eq!(line.servos[0].registers().get(GOAL), 2_100);
}

#[test]
fn a_factory_reset_forgets_a_registered_write() {
    let mut line = Line::new([servo_with(1, [])]);
    let (address, data) = (GOAL, &[100, 0, 0, 0][..]);
    assert_eq!(
        error(&mut line, Request::RegWrite { address, data }),
        ErrorNumber::OK
    );
    assert_eq!(
        error(&mut line, Request::FactoryReset(Kept::Id)),
        ErrorNumber::OK
    );
    assert_eq!(error(&mut line, Request::Action), ErrorNumber::INSTRUCTION);
}

#[test]
fn a_hardware_error_is_reported_by_each_answer() {
    let mut line = Line::new([servo_with(1, [(70, 0x20)])]);
    assert_eq!(error(&mut line, Request::Ping), ErrorNumber(0x80));
    assert_eq!(error(&mut line, write(14, &[0])), ErrorNumber(0x87));
}

#[test]
fn a_damaged_instruction_is_answered_by_its_servo_only() {
    let mut line = Line::new([1, 2].map(|id| servo_with(id, [])));
    let mut bytes = Vec::new();
    write(TORQUE, &[1])
        .encode(ProtocolVersion::Two, 1, &mut bytes)
        .unwrap();
    bytes[10] ^= 1;
    let sent = line.send(&bytes);
    assert_eq!(sent.len(), 1);
    assert_eq!(sent[0].1[4..9], [1, 4, 0, 0x55, 3]);
    assert_eq!(line.servos[0].registers().get(TORQUE), 0);
    assert_eq!(line.servos[0].counters().damaged, 1);
}

#[test]
fn the_beginning_of_a_packet_is_forgotten_after_silence() {
    let mut request = Vec::new();
    Request::Ping
        .encode(ProtocolVersion::Two, 1, &mut request)
        .unwrap();
    for (millis, expected) in [(4, 0), (6, 1)] {
        let mut line = Line::new([servo_with(1, [])]);
        // It asks for 30 more bytes.
        let beginning = piece(SimTime::ZERO, &[0xff, 0xff, 0xfd, 0, 1, 30, 0]);
        line.servos[0].receive(beginning);
        line.now = beginning.last() + SimDuration::from_millis(millis);
        assert_eq!(line.send(&request).len(), expected, "after {millis} ms");
    }
}

proptest! {
    /// Arbitrary bytes in arbitrary pieces do not panic, and looking at them more often changes
    /// nothing; a servo restored in between continues bit for bit.
    #[test]
    fn pieces_and_restoration_make_no_difference(
        requests in prop::collection::vec((0_u8..5, 0_u16..240, 0_u16..12, any::<u8>()), 1..8),
        noise in prop::collection::vec((0_usize..200, any::<u8>()), 0..3),
        cuts in prop::collection::vec(1_usize..20, 0..40), restored in 0_usize..40,
    ) {
        let mut stream = Vec::new();
        for (id, address, length, byte) in requests {
            let span = Span { address, length };
            let data = vec![byte; length.into()];
            let request = match byte % 4 {
                0 => Request::Read(span),
                1 => write(address, &data),
                2 => Request::SyncRead { span, ids: &[2, 1, 3] },
                _ => Request::FastSyncRead { span, ids: &[1, 2] },
            };
            let id = if id == 4 { ALL } else { id };
            request.encode(ProtocolVersion::Two, id, &mut stream).unwrap();
        }
        for (at, byte) in noise {
            let at = at % stream.len();
            stream[at] = byte;
        }
        let transmissions = |cuts: &[usize], restored: Option<usize>| {
            let mut servo = servo_with(1, []);
            let mut rest = &stream[..];
            let (mut now, mut sent) = (SimTime::ZERO, Vec::new());
            let mut cuts = cuts.iter().copied().chain(std::iter::repeat(1));
            for index in 0.. {
                if rest.is_empty() {
                    break;
                }
                // It is called in time: at the byte that may complete a packet.
                let length = cuts.next().unwrap().min(servo.missing()).min(rest.len());
                let (bytes, behind) = rest.split_at(length);
                rest = behind;
                let piece = piece(now, bytes);
                servo.receive(piece);
                now = piece.last();
                servo.handle(now);
                if Some(index) == restored {
                    let mut other = servo_with(9, []);
                    other.restore(&servo.save()).unwrap();
                    servo = other;
                }
                let mut bytes = Vec::new();
                while let Some(start) = servo.poll_transmit(&mut bytes) {
                    sent.push((start, std::mem::take(&mut bytes)));
                }
            }
            (sent, servo.save(), servo.counters(), servo.skipped())
        };
        let reference = transmissions(&[], None);
        prop_assert_eq!(&transmissions(&cuts, None), &reference);
        prop_assert_eq!(&transmissions(&cuts, Some(restored)), &reference);
    }
}
