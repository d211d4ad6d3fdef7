//! The examples of the manual of protocol 2.0 (emanual.robotis.com, docs/en/dxl/protocol2), byte
//! for byte. Where it prints a wrong checksum, that is said.

use twinrig_dynamixel::{
    BulkReads, ErrorNumber, Kept, Packet, ProtocolVersion, Request, Span, Status,
};

use super::support::{Line, servo_with};

/// Bytes of text in hexadecimal.
fn hex(text: &str) -> Vec<u8> {
    let digits = text.split_whitespace();
    digits
        .map(|it| u8::from_str_radix(it, 16).unwrap())
        .collect()
}

fn assert_is(request: Request<'_>, id: u8, text: &str) {
    let mut bytes = Vec::new();
    request
        .encode(ProtocolVersion::Two, id, &mut bytes)
        .unwrap();
    assert_eq!(bytes, hex(text), "{request:?}");
    let mut buffer = Vec::new();
    let packet = ProtocolVersion::Two.decode(&bytes, &mut buffer).unwrap();
    assert_eq!(packet.id, id);
    assert_eq!(Request::decode(ProtocolVersion::Two, &packet), Ok(request));
}

const ALL: u8 = ProtocolVersion::BROADCAST;

#[test]
fn instructions_are_those_of_the_manual() {
    let span = |address, length| Span { address, length };
    assert_is(Request::Ping, 1, "FF FF FD 00 01 03 00 01 19 4E");
    assert_is(Request::Ping, ALL, "FF FF FD 00 FE 03 00 01 31 42");
    let read = Request::Read(span(132, 4));
    assert_is(read, 1, "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15");
    let (address, data) = (116, &[0, 2, 0, 0][..]);
    let text = "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89";
    assert_is(Request::Write { address, data }, 1, text);
    let (address, data) = (104, &[200, 0, 0, 0][..]);
    let text = "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E";
    assert_is(Request::RegWrite { address, data }, 1, text);
    assert_is(Request::Action, 1, "FF FF FD 00 01 03 00 05 02 CE");
    let reset = Request::FactoryReset(Kept::Id);
    assert_is(reset, 1, "FF FF FD 00 01 04 00 06 01 A1 E6");
    assert_is(Request::Reboot, 1, "FF FF FD 00 01 03 00 08 2F 4E");
    let text = "FF FF FD 00 01 08 00 10 01 44 58 4C 22 B1 DC";
    assert_is(Request::ClearTurns, 1, text);
    let (positions, ids) = (span(132, 4), &[1, 2][..]);
    let text = "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA";
    assert_is(
        Request::SyncRead {
            span: positions,
            ids,
        },
        ALL,
        text,
    );
    let ids = &[3, 7, 4][..];
    let text = "FF FF FD 00 FE 0A 00 8A 84 00 04 00 03 07 04 20 F2";
    assert_is(
        Request::FastSyncRead {
            span: positions,
            ids,
        },
        ALL,
        text,
    );
    let data = &[1, 150, 0, 0, 0, 2, 170, 0, 0, 0][..];
    let text = "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87";
    assert_is(
        Request::SyncWrite {
            span: span(116, 4),
            data,
        },
        ALL,
        text,
    );
    let mut reads = Vec::new();
    for (id, span) in [(1, span(144, 2)), (2, span(146, 1))] {
        BulkReads::append(ProtocolVersion::Two, id, span, &mut reads).unwrap();
    }
    let text = "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05";
    assert_is(
        Request::BulkRead(BulkReads::new(ProtocolVersion::Two, &reads)),
        ALL,
        text,
    );
    let data = &[1, 32, 0, 2, 0, 160, 0, 2, 31, 0, 1, 0, 80][..];
    let text = "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68";
    assert_is(Request::BulkWrite(data), ALL, text);
}

#[test]
fn answers_are_those_of_the_manual() {
    for (id, error, data, text) in [
        (
            1,
            0,
            &[0x06, 0x04, 0x26][..],
            "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D",
        ),
        (
            2,
            0,
            &[0x06, 0x04, 0x26],
            "FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D",
        ),
        (
            1,
            0,
            &[0xa6, 0, 0, 0],
            "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0",
        ),
        (
            2,
            0,
            &[0x1f, 8, 0, 0],
            "FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE",
        ),
        (1, 0, &[], "FF FF FD 00 01 04 00 55 00 A1 0C"),
        (1, 0, &[0x77, 0], "FF FF FD 00 01 06 00 55 00 77 00 C3 69"),
        (2, 0, &[0x24], "FF FF FD 00 02 05 00 55 00 24 8B A9"),
    ] {
        let status = Status { id, error, data };
        let mut bytes = Vec::new();
        ProtocolVersion::Two
            .encode_status(&status, &mut bytes)
            .unwrap();
        assert_eq!(bytes, hex(text));
        let mut buffer = Vec::new();
        let packet = ProtocolVersion::Two.decode(&bytes, &mut buffer).unwrap();
        assert_eq!(packet.status(ProtocolVersion::Two), Some(status));
    }
}

/// The three parts of one answer, each with the CRC of all bytes before it.
#[test]
fn parts_of_a_fast_sync_read_are_those_of_the_manual() {
    let positions = [(3, 166), (7, 2_079), (4, 1_023)];
    let parts = [
        "FF FF FD 00 FE 19 00 55 00 03 A6 00 00 00 84 08",
        "00 07 1F 08 00 00 16 CA",
        "00 04 FF 03 00 00 D1 9E",
    ];
    let span = Span {
        address: 132,
        length: 4,
    };
    let request = Request::FastSyncRead {
        span,
        ids: &[3, 7, 4],
    };
    assert_eq!(fast_answers(request, &positions, &[]), parts.map(hex));
}

/// The manual prints the CRC of the instruction of the fast sync read above, `20 F2`, under this
/// instruction; the answers have their own.
#[test]
fn parts_of_a_fast_bulk_read_are_those_of_the_manual() {
    let mut reads = Vec::new();
    for (id, address, length) in [(3, 132, 4), (7, 124, 2), (4, 146, 1)] {
        let span = Span { address, length };
        BulkReads::append(ProtocolVersion::Two, id, span, &mut reads).unwrap();
    }
    let parts = [
        "FF FF FD 00 FE 14 00 55 00 03 A6 00 00 00 67 A4",
        "00 07 A5 01 24 74",
        "00 04 1F D9 C1",
    ];
    let request = Request::FastBulkRead(BulkReads::new(ProtocolVersion::Two, &reads));
    let others = [(7, 124, 0x01a5), (4, 146, 0x1f)];
    assert_eq!(
        fast_answers(request, &[(3, 166), (7, 0), (4, 0)], &others),
        parts.map(hex)
    );
}

/// Returns the parts of servos at positions, with the values of other registers, in the order of
/// the positions.
fn fast_answers(
    request: Request<'_>,
    positions: &[(u8, i32)],
    others: &[(u8, u16, i32)],
) -> Vec<Vec<u8>> {
    let servos = positions.iter().map(|&(id, position)| {
        let values = others.iter().filter(|(of, ..)| *of == id);
        let values = values.map(|&(_, address, value)| (address, value));
        servo_with(id, values.chain([(132, position)]))
    });
    Line::new(servos).packets(request, ALL)
}

#[test]
fn unknown_and_malformed_instructions_are_refused_by_number() {
    let decode = |code, parameters| {
        let packet = Packet {
            id: 1,
            code,
            parameters,
        };
        Request::decode(ProtocolVersion::Two, &packet).unwrap_err()
    };
    assert_eq!(decode(0x77, &[]), ErrorNumber::INSTRUCTION);
    assert_eq!(decode(0x02, &[1, 0, 4]), ErrorNumber::DATA_LENGTH);
    assert_eq!(decode(0x06, &[3]), ErrorNumber::DATA_RANGE);
    assert_eq!(decode(0x10, &[1, 2, 3, 4, 5]), ErrorNumber::DATA_RANGE);
}
