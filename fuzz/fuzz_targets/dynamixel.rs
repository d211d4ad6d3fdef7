//! Parsers of both protocols, and an emulated servo, under arbitrary bytes in arbitrary pieces: no
//! panic, the same numbers of packets in all divisions, and a bounded queue of answers.

#![no_main]

use libfuzzer_sys::fuzz_target;
use twinrig_dynamixel::{Parser, ProtocolVersion, Received, Request, Responder, x};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

const BYTE_TIME: SimDuration = SimDuration::from_micros(10);

/// Number of packets, and of damaged ones, in pieces of this length.
fn found(protocol: ProtocolVersion, stream: &[u8], length: usize) -> [usize; 2] {
    let mut parser = Parser::new(protocol);
    let mut counts = [0; 2];
    for piece in stream.chunks(length) {
        parser.push(piece);
        while let Some(received) = parser.next_packet() {
            match received {
                Received::Packet(packet) => {
                    counts[0] += 1;
                    let _ = Request::decode(protocol, &packet);
                }
                Received::Damaged { .. } => counts[1] += 1,
            }
        }
    }
    counts
}

fuzz_target!(|data: &[u8]| {
    let Some((&length, stream)) = data.split_first() else {
        return;
    };
    let length = usize::from(length).max(1);
    for protocol in [ProtocolVersion::One, ProtocolVersion::Two] {
        let whole = found(protocol, stream, usize::MAX);
        assert_eq!(found(protocol, stream, length), whole);
    }
    let mut servo = Responder::new(x::XL330_M288.model, 1, BYTE_TIME);
    let (mut now, mut bytes) = (SimTime::ZERO, Vec::new());
    for piece in stream.chunks(length) {
        let first = now + BYTE_TIME;
        let piece = Piece {
            first,
            spacing: BYTE_TIME,
            bytes: piece,
            framing_error: false,
        };
        servo.receive(piece);
        now = piece.last();
        servo.handle(now);
        let mut answers = 0;
        while let Some(start) = servo.poll_transmit(&mut bytes) {
            assert!(start >= now);
            answers += 1;
        }
        // The bytes that the parser keeps, and this piece: an answered packet takes ten.
        assert!(answers <= (ProtocolVersion::Two.packet_max() + length) / 10, "{answers}");
        bytes.clear();
    }
});
