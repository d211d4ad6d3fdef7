//! Packets against the vendors' own libraries, byte for byte: `dynamixel_sdk` of both protocols,
//! and Feetech's `scservo_sdk`.

use std::fmt::Write;
use std::path::Path;

use serde_json::{Value, json};
use twinrig_dynamixel::{
    BulkReads, Kept, Parser, ProtocolVersion, Received, Request, Span, Status,
};
use twinrig_kernel::{Stream, stream};
use twinrig_testing::python;

const PACKETS: usize = 100_000;

/// Random numbers and bytes, of which many are those of headers and stuffing.
struct Random(Stream);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0.between(0, end - 1)
    }

    fn byte(&mut self) -> u8 {
        match self.below(4) {
            0 => 0xff,
            1 => 0xfd,
            _ => u8::try_from(self.below(256)).unwrap(),
        }
    }

    fn bytes(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.byte()).collect()
    }

    fn id(&mut self) -> u8 {
        u8::try_from(self.below(253)).unwrap()
    }
}

/// Appends the argument of protocol 2.0 that selects fast reads.
fn with_fast(mut call: Value, two: bool) -> Value {
    if let (Value::Array(arguments), true) = (&mut call, two) {
        arguments.push(json!(false));
    }
    call
}

/// Returns a call of the library, and the packet that it should transmit.
fn call(library: &str, protocol: ProtocolVersion, random: &mut Random) -> (Value, Vec<u8>) {
    let mut bytes = Vec::new();
    let id = random.id();
    let most = if protocol == ProtocolVersion::Two {
        600
    } else {
        255
    };
    let address = u16::try_from(random.below(most)).unwrap();
    let length = u16::try_from(random.below(12) + 1).unwrap();
    let span = Span { address, length };
    let data = random.bytes(length.into());
    let ids: Vec<u8> = (0..=random.below(5)).map(|_| random.id()).collect();
    let each: Vec<u8> = ids
        .iter()
        .flat_map(|id| [vec![*id], random.bytes(length.into())].concat())
        .collect();
    let mut reads = Vec::new();
    for id in &ids {
        BulkReads::append(protocol, *id, span, &mut reads).unwrap();
    }
    let writes: Vec<u8> = ids
        .iter()
        .flat_map(|id| {
            let entry = [&[*id][..], &address.to_le_bytes(), &length.to_le_bytes()].concat();
            [entry, random.bytes(length.into())].concat()
        })
        .collect();
    let two = protocol == ProtocolVersion::Two;
    let kinds = match (library, two) {
        ("scs", _) => 7,
        (_, false) => 8,
        (_, true) => 12,
    };
    let all = ProtocolVersion::BROADCAST;
    let (call, id, request) = match random.below(kinds) {
        0 => (json!(["ping", id]), id, Request::Ping),
        1 => (
            json!(["readTx", id, address, length]),
            id,
            Request::Read(span),
        ),
        2 => (
            json!(["writeTxOnly", id, address, length, data]),
            id,
            Request::Write {
                address,
                data: &data,
            },
        ),
        3 => (
            json!(["regWriteTxOnly", id, address, length, data]),
            id,
            Request::RegWrite {
                address,
                data: &data,
            },
        ),
        4 => (json!(["action", all]), all, Request::Action),
        5 => (
            json!(["syncWriteTxOnly", address, length, each, each.len()]),
            all,
            Request::SyncWrite { span, data: &each },
        ),
        6 if library == "scs" || two => {
            let call = with_fast(json!(["syncReadTx", address, length, ids, ids.len()]), two);
            (call, all, Request::SyncRead { span, ids: &ids })
        }
        6 => (
            json!(["factoryReset", id]),
            id,
            Request::FactoryReset(Kept::Nothing),
        ),
        7 => {
            let call = with_fast(json!(["bulkReadTx", reads, reads.len()]), two);
            (
                call,
                all,
                Request::BulkRead(BulkReads::new(protocol, &reads)),
            )
        }
        8 => (
            json!(["bulkWriteTxOnly", writes, writes.len()]),
            all,
            Request::BulkWrite(&writes),
        ),
        9 => (json!(["reboot", id]), id, Request::Reboot),
        10 => (json!(["clearMultiTurn", id]), id, Request::ClearTurns),
        _ => (
            json!(["syncReadTx", address, length, ids, ids.len(), true]),
            all,
            Request::FastSyncRead { span, ids: &ids },
        ),
    };
    request.encode(protocol, id, &mut bytes).unwrap();
    (call, bytes)
}

fn hex(bytes: &[u8]) -> String {
    let mut text = String::new();
    for byte in bytes {
        write!(text, "{byte:02x}").unwrap();
    }
    text
}

fn check(library: &str, protocol: ProtocolVersion, module: &str) {
    let Some(python) = python::python(module) else {
        return;
    };
    let mut random = Random(stream(1, library));
    let (mut calls, mut requests) = (Vec::new(), Vec::new());
    let (mut answers, mut statuses) = (Vec::new(), Vec::new());
    for _ in 0..PACKETS {
        let (call, bytes) = call(library, protocol, &mut random);
        calls.push(call);
        requests.push(hex(&bytes));
        // Bits of errors: the libraries refuse the highest one in protocol 1.0.
        let (id, error) = (random.id(), random.byte() & 0x7f);
        let length = random.below(20);
        let data = random.bytes(usize::try_from(length).unwrap());
        let status = Status {
            id,
            error,
            data: &data,
        };
        let mut bytes = Vec::new();
        protocol.encode_status(&status, &mut bytes).unwrap();
        answers.push(hex(&bytes));
        statuses.push(json!([id, error, hex(&data)]));
        let mut parser = Parser::new(protocol);
        parser.push(&bytes);
        let Some(Received::Packet(packet)) = parser.next_packet() else {
            panic!("{status:?}");
        };
        assert_eq!(packet.status(protocol), Some(status));
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dynamixel/protocol/sdk.py");
    let task = json!({"protocol": library, "calls": calls, "answers": answers});
    let theirs = python::run(&python, &script, &[], &task);
    let mut unstuffed = 0;
    for (index, ours) in requests.iter().enumerate() {
        let call = &calls[index];
        assert_eq!(theirs["stuffed"][index], *ours, "{call}");
        let sent = theirs["requests"][index].as_str().unwrap();
        unstuffed += usize::from(sent != ours);
    }
    let mut misread = 0;
    for (index, sent) in statuses.iter().enumerate() {
        let found = &theirs["statuses"][index];
        if found != sent {
            assert_eq!(protocol, ProtocolVersion::Two, "{sent} {found}");
            let wrong = unstuffed_in_place(&answers[index]);
            assert_eq!(found[2], wrong, "{}", answers[index]);
            misread += 1;
        }
    }
    eprintln!("{library}: {unstuffed} requests without stuffing, {misread} answers misread");
    assert_eq!(
        unstuffed > 0 && misread > 0,
        protocol == ProtocolVersion::Two
    );
}

/// Returns the data of an answer as `removeStuffing` of `dynamixel_sdk` 4.1.0 reads them: it moves
/// the bytes behind a removed one to the front in the same array, and searches for the next pattern
/// in what it has moved. `FF FD FD` behind another byte then seems to be one.
fn unstuffed_in_place(answer: &str) -> String {
    let digits = answer.as_bytes().chunks_exact(2);
    let digits = digits.map(|it| std::str::from_utf8(it).unwrap());
    let mut packet: Vec<u8> = digits
        .map(|it| u8::from_str_radix(it, 16).unwrap())
        .collect();
    let (start, mut kept) = (7, 7);
    for at in start..packet.len() - 2 {
        if packet[at - 2..=at + 1] != [0xff, 0xff, 0xfd, 0xfd] {
            packet[kept] = packet[at];
            kept += 1;
        }
    }
    hex(&packet[start + 2..kept])
}

#[test]
fn packets_of_protocol_2_are_those_of_the_vendors_library() {
    check("2.0", ProtocolVersion::Two, "dynamixel_sdk");
}

#[test]
fn packets_of_protocol_1_are_those_of_the_vendors_library() {
    check("1.0", ProtocolVersion::One, "dynamixel_sdk");
}

#[test]
fn packets_of_protocol_1_are_those_of_feetechs_library() {
    check("scs", ProtocolVersion::One, "scservo_sdk");
}
