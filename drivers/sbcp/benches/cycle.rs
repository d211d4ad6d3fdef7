//! Cost of a cycle of master, bus controller and four boards that receive all bytes, and of parsing
//! alone.

#[path = "../src/tests/protocol_stack/harness.rs"]
mod harness;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use harness::ProtocolStack;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{
    Address, BYTE_TIME, ErrorCode, Instruction, Parser, RegisterTable, Request, Response, Slave,
    SlaveConfig,
};
use twinrig_wire::Piece;

fn main() {
    divan::main();
}

/// Items are packets: four requests, four responses.
#[divan::bench]
fn whole_cycle(bencher: Bencher) {
    let mut protocol_stack = ProtocolStack::new();
    bencher
        .counter(ItemsCount::new(8_u32))
        .bench_local(|| protocol_stack.cycle());
}

fn responses() -> Vec<u8> {
    let mut bytes = Vec::new();
    for id in 1..=4 {
        let from = Address::new(CLASS_MOTORDRIVER, id).unwrap();
        let response = Response::new(from, ErrorCode::OK, &[id; 16]).unwrap();
        response.emit(&mut bytes);
    }
    bytes
}

/// Four responses in one piece.
#[divan::bench]
fn parse_whole(bencher: Bencher) {
    let bytes = responses();
    let mut parser = Parser::default();
    bencher.counter(ItemsCount::new(4_u32)).bench_local(|| {
        let mut rest = black_box(&bytes[..]);
        while let Some(packet) = parser.next(&mut rest) {
            let _ = black_box(Response::parse(&packet));
        }
    });
}

/// The same, byte by byte.
#[divan::bench]
fn parse_bytewise(bencher: Bencher) {
    let bytes = responses();
    let mut parser = Parser::default();
    bencher.counter(ItemsCount::new(4_u32)).bench_local(|| {
        for byte in black_box(&bytes) {
            let mut rest = std::slice::from_ref(byte);
            while let Some(packet) = parser.next(&mut rest) {
                let _ = black_box(Response::parse(&packet));
            }
        }
    });
}

fn slave() -> Slave {
    let registers = RegisterTable::new(1, 1, &[]).unwrap();
    let mut slave = Slave::new(SlaveConfig::new(CLASS_MOTORDRIVER), registers).unwrap();
    slave.set_reply(&[7; 16]).unwrap();
    slave
}

/// A slave skips four packets for others.
#[divan::bench]
fn skip_others(bencher: Bencher) {
    let mut slave = slave();
    let bytes = responses().split_off(22).repeat(2)[..88].to_vec();
    let mut now = SimTime::ZERO;
    bencher.counter(ItemsCount::new(4_u32)).bench_local(|| {
        now += SimDuration::from_millis(1);
        slave.receive(Piece {
            first: now,
            spacing: BYTE_TIME,
            bytes: black_box(&bytes),
            framing_error: false,
        });
    });
}

/// A slave answers a low-latency request.
#[divan::bench]
fn receive_and_answer(bencher: Bencher) {
    let mut slave = slave();
    let to = slave.address();
    let request = Request::new(to, Instruction::LOW_LATENCY, &[1, 2, 3, 4]).unwrap();
    let (mut bytes, mut tx) = (Vec::new(), Vec::new());
    request.emit(&mut bytes);
    let mut now = SimTime::ZERO;
    bencher.counter(ItemsCount::new(1_u32)).bench_local(|| {
        now += SimDuration::from_millis(1);
        slave.receive(Piece {
            first: now,
            spacing: BYTE_TIME,
            bytes: black_box(&bytes),
            framing_error: false,
        });
        while slave.poll_event().is_some() {}
        tx.clear();
        black_box(slave.poll_transmit(&mut tx));
    });
}
