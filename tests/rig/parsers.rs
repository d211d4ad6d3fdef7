//! Millions of bytes through each parser: random bytes and damaged traffic. No parser panics or
//! accepts a packet with a wrong checksum; checksums are recomputed independently here.

use twinrig_kernel::{HostTime, SimDuration, SimTime};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{
    Address, Controller, ControllerConfig, ErrorCode, Instruction, Master, MasterConfig, Parser,
    RegisterTable, Request, Response, Slave, SlaveConfig, SlaveEvent, Topology,
};
use twinrig_tactile::Tactile;
use twinrig_tactile::protocol as tactile;
use twinrig_testing::framing::{BurstGenerator, check_damaged_bursts, has_crc16};
use twinrig_wire::{Arrivals, FramedMessage, Piece};

/// Number of bytes received by each participant of SBCP.
const SBCP_BYTES: u64 = 10_000_000;

/// Most recently received bytes, at least as many as any participant can buffer.
#[derive(Default)]
struct ReceivedBytes(Vec<u8>);

impl ReceivedBytes {
    fn receive(&mut self, bytes: &[u8]) {
        if self.0.len() > 400 {
            self.0.drain(..self.0.len() - 200);
        }
        self.0.extend_from_slice(bytes);
    }

    /// Whether they contain a valid SBCP packet with this address, code and payload.
    fn has(&self, to: Address, code: u8, payload: &[u8]) -> bool {
        let len = payload.len() + 6;
        self.0.windows(len).any(|bytes| {
            let head = [
                0xFF,
                to.class(),
                to.id(),
                u8::try_from(len - 4).unwrap(),
                code,
            ];
            bytes[..5] == head && &bytes[5..len - 1] == payload && is_right(bytes)
        })
    }
}

/// Whether the checksum, the sum of all bytes except the header and itself, is right.
fn is_right(packet: &[u8]) -> bool {
    let (last, content) = packet.split_last().unwrap();
    let sum: u32 = content[1..].iter().map(|byte| u32::from(*byte)).sum();
    sum % 256 == u32::from(*last)
}

fn board_address() -> Address {
    Address::new(CLASS_MOTORDRIVER, 1).unwrap()
}

fn request() -> Request {
    Request::new(board_address(), Instruction::LOW_LATENCY, &[1, 2, 3, 4]).unwrap()
}

/// Requests and answers on a bus.
fn traffic() -> Vec<Vec<u8>> {
    let mut valid = Vec::new();
    for id in 1..=4 {
        let board = Address::new(CLASS_MOTORDRIVER, id).unwrap();
        for (instruction, payload) in [
            (Instruction::LOW_LATENCY, &[1, 2, 0xFF, 4][..]),
            (Instruction::PING, &[]),
            (Instruction::GET, &[0x10]),
            (Instruction::SET, &[0x10, 1, 0]),
        ] {
            let mut bytes = Vec::new();
            Request::new(board, instruction, payload)
                .unwrap()
                .emit(&mut bytes);
            valid.push(bytes);
        }
        for payload in [&[0xFF; 16][..], &[7; 16], &[]] {
            let mut bytes = Vec::new();
            Response::new(board, ErrorCode::OK, payload)
                .unwrap()
                .emit(&mut bytes);
            valid.push(bytes);
        }
    }
    valid
}

/// All participants of SBCP, and the number of packets accepted by each.
struct Participants {
    parser: Parser,
    slave: Slave,
    controller: Controller,
    master: Master,
    received: ReceivedBytes,
    tx: Vec<u8>,
    arrivals: Arrivals,
    accepted: [u64; 4],
    wrong: u64,
}

impl Participants {
    fn new() -> Self {
        let config = SlaveConfig {
            low_latency_request: Some(4),
            ..SlaveConfig::new(CLASS_MOTORDRIVER)
        };
        let mut slave = Slave::new(config, RegisterTable::new(1, 1, &[]).unwrap()).unwrap();
        slave.set_reply(&[7; 16]).unwrap();
        Self {
            parser: Parser::default(),
            slave,
            controller: Controller::new(ControllerConfig::default()).unwrap(),
            master: Master::new(MasterConfig::new(Topology::Controller)),
            received: ReceivedBytes::default(),
            tx: Vec::new(),
            arrivals: Arrivals::default(),
            accepted: [0; 4],
            wrong: 0,
        }
    }

    fn count_accepted(&mut self, participant: usize, right: bool) {
        self.accepted[participant] += 1;
        self.wrong += u64::from(!right);
    }

    fn receive(&mut self, piece: Piece<'_>, link: bool) {
        self.received.receive(piece.bytes);
        let mut rest = piece.bytes;
        let (mut found, mut wrong) = (0, 0);
        while let Some(packet) = self.parser.next(&mut rest) {
            found += 1;
            wrong += u64::from(!is_right(packet.bytes()));
        }
        self.accepted[0] += found;
        self.wrong += wrong;
        self.slave_receive(piece);
        self.controller_receive(piece, link);
        self.master_receive(piece);
    }

    fn slave_receive(&mut self, piece: Piece<'_>) {
        self.slave.receive(piece);
        while let Some(event) = self.slave.poll_event() {
            if let SlaveEvent::LowLatency { payload, .. } = event {
                let broadcast = |class, id| Address::new(class, id).unwrap();
                let board_addresses = [
                    board_address(),
                    broadcast(0xFE, 1),
                    broadcast(1, 0xFE),
                    broadcast(0xFE, 0xFE),
                ];
                let right = board_addresses
                    .iter()
                    .any(|to| self.received.has(*to, 0x10, &payload));
                self.count_accepted(1, right);
            }
        }
        self.tx.clear();
        self.slave.poll_transmit(&mut self.tx);
    }

    fn controller_receive(&mut self, piece: Piece<'_>, link: bool) {
        let now = piece.last();
        if self.controller.poll_timeout().is_some_and(|due| due < now) {
            self.controller.handle_timeout(now);
        }
        let before = self.controller.counters().answers;
        if link {
            self.controller.handle_link(now, piece);
        } else {
            self.controller.handle_bus(now, piece);
        }
        while self.controller.poll_bus(now, &mut |_| {}) {}
        self.arrivals.clear();
        self.controller.poll_link(&mut self.arrivals);
        for _ in before..self.controller.counters().answers {
            let any = (6..=32).any(|len| {
                let packets = self.received.0.windows(len);
                packets.into_iter().any(|bytes| {
                    bytes[0] == 0xFF && usize::from(bytes[3]) + 4 == len && is_right(bytes)
                })
            });
            self.count_accepted(2, any);
        }
    }

    fn master_receive(&mut self, piece: Piece<'_>) {
        // Accelerated time, so that the quiet time of the master elapses.
        let now = HostTime::from_nanos(100 * piece.last().as_nanos());
        self.master.handle_timeout(now);
        if !self.master.is_busy() {
            self.master.cycle(now, &[request()]).unwrap();
        }
        self.tx.clear();
        self.master.poll_transmit(&mut self.tx);
        self.master.handle_bytes(now, piece.bytes);
        if !self.master.is_busy() {
            let outcomes = self.master.outcomes().to_vec();
            for payload in outcomes.iter().flatten() {
                let right = self.received.has(board_address(), 0, payload);
                self.count_accepted(3, right);
            }
        }
    }
}

#[test]
fn sbcp_participants_reject_wrong_checksums_without_panic() {
    let mut generator = BurstGenerator::new("sbcp", traffic());
    let mut participants = Participants::new();
    let (mut now, mut bytes) = (SimTime::ZERO, 0);
    while bytes < SBCP_BYTES {
        let (pause, spacing) = (
            generator.below(60) as u64,
            3 * u64::from(generator.below(20) > 0),
        );
        let link = generator.below(2) == 0;
        let burst = generator.next_burst();
        let piece = Piece {
            first: now + SimDuration::from_micros(3 + pause),
            spacing: SimDuration::from_micros(spacing),
            bytes: burst,
            framing_error: false,
        };
        now = piece.last();
        bytes += burst.len() as u64;
        participants.receive(piece, link);
    }
    println!(
        "{bytes} bytes each; packets accepted: {:?}",
        participants.accepted
    );
    assert!(
        participants.accepted.iter().all(|taken| *taken > 100),
        "{:?}",
        participants.accepted
    );
    assert_eq!(participants.wrong, 0);
}

#[test]
fn tactile_driver_rejects_wrong_checksums_without_panic() {
    let data = tactile::Message::Data {
        boot: 0,
        sequence: 1,
        stamp: 1_000,
        volts: [3_000, -1],
        bridge: -70_000,
        status: tactile::Status::default(),
    };
    let started = tactile::Message::Acknowledgement {
        command: tactile::Command::Start,
        done: true,
    };
    let frames = [data, started].map(|message| message.to_frame());
    let driver = Tactile::new("tactile", "force").driver().unwrap();
    check_damaged_bursts::<tactile::Message>(frames.into(), has_crc16, driver);
}
