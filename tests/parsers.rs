//! Ten million bytes through everything that parses: random ones, and traffic that was damaged. Nobody panics, and nothing is
//! taken for a packet whose checksum is wrong. The checksums are calculated anew here.

use twinrig_kernel::{HostTime, SimDuration, SimTime, Stream, stream};
use twinrig_optoforce::OptoForce;
use twinrig_optoforce::protocol as optoforce;
use twinrig_phidget::protocol as phidget;
use twinrig_phidget::{Board, Phidget};
use twinrig_rb110::protocol as rb110;
use twinrig_rb110::{PulseMap, Rb110};
use twinrig_runtime::{Driver, Transfer};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{
    Address, Controller, ControllerConfig, ErrorCode, Instruction, Master, MasterConfig, Parser,
    RegisterTable, Request, Response, Slave, SlaveConfig, SlaveEvent, Topology,
};
use twinrig_wire::{Arrivals, FrameMatch, Framer, Piece};

/// Bytes that each of the parties of SBCP hears, and each of the other parsers.
const SBCP_BYTES: u64 = 10_000_000;
const OTHER_BYTES: u64 = 10_000_000;

/// Makes bursts of bytes: noise, or good packets of which some bytes were changed, lost or added.
struct Mangler {
    random: Stream,
    good: Vec<Vec<u8>>,
    burst: Vec<u8>,
}

impl Mangler {
    fn new(name: &str, good: Vec<Vec<u8>>) -> Self {
        let (random, burst) = (stream(1, name), Vec::new());
        Self {
            random,
            good,
            burst,
        }
    }

    fn below(&mut self, end: usize) -> usize {
        let drawn = self.random.between(0, end as u64 - 1);
        usize::try_from(drawn).unwrap()
    }

    fn next(&mut self) -> &[u8] {
        self.burst.clear();
        if self.below(4) == 0 {
            for _ in 0..=self.below(60) {
                let [byte, ..] = self.random.bits().to_le_bytes();
                self.burst.push(byte);
            }
            return &self.burst;
        }
        for _ in 0..=self.below(3) {
            let which = self.below(self.good.len());
            self.burst.extend_from_slice(&self.good[which]);
        }
        for _ in 0..self.below(4) {
            let (at, end) = (self.below(self.burst.len()), self.burst.len());
            match self.below(4) {
                0 => self.burst[at] ^= 1 << self.below(8),
                1 => self.burst[at] = self.random.bits().to_le_bytes()[0],
                2 if end > 1 => drop(self.burst.remove(at)),
                // A whole header's worth of hope.
                _ => self.burst.insert(at, self.good[0][0]),
            }
        }
        &self.burst
    }
}

/// What was heard last: as much as any of them can still have in mind.
#[derive(Default)]
struct Heard(Vec<u8>);

impl Heard {
    fn receive(&mut self, bytes: &[u8]) {
        if self.0.len() > 400 {
            self.0.drain(..self.0.len() - 200);
        }
        self.0.extend_from_slice(bytes);
    }

    /// Whether a packet of SBCP with a right checksum is among it, with that code and payload.
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

/// The sum of every byte but header and itself.
fn is_right(packet: &[u8]) -> bool {
    let (last, said) = packet.split_last().unwrap();
    let sum: u32 = said[1..].iter().map(|byte| u32::from(*byte)).sum();
    sum % 256 == u32::from(*last)
}

fn own() -> Address {
    Address::new(CLASS_MOTORDRIVER, 1).unwrap()
}

fn request() -> Request {
    Request::new(own(), Instruction::LOW_LATENCY, &[1, 2, 3, 4]).unwrap()
}

/// Requests and answers as they go over a bus.
fn traffic() -> Vec<Vec<u8>> {
    let mut good = Vec::new();
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
            good.push(bytes);
        }
        for payload in [&[0xFF; 16][..], &[7; 16], &[]] {
            let mut bytes = Vec::new();
            Response::new(board, ErrorCode::OK, payload)
                .unwrap()
                .emit(&mut bytes);
            good.push(bytes);
        }
    }
    good
}

/// Everybody who hears SBCP, and how many packets each has taken for good.
struct Parties {
    parser: Parser,
    slave: Slave,
    controller: Controller,
    master: Master,
    heard: Heard,
    said: Vec<u8>,
    arrivals: Arrivals,
    accepted: [u64; 4],
    wrong: u64,
}

impl Parties {
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
            heard: Heard::default(),
            said: Vec::new(),
            arrivals: Arrivals::default(),
            accepted: [0; 4],
            wrong: 0,
        }
    }

    fn judge(&mut self, who: usize, right: bool) {
        self.accepted[who] += 1;
        self.wrong += u64::from(!right);
    }

    fn receive(&mut self, piece: Piece<'_>, link: bool) {
        self.heard.receive(piece.bytes);
        let mut rest = piece.bytes;
        let (mut found, mut wrong) = (0, 0);
        while let Some(packet) = self.parser.next(&mut rest) {
            found += 1;
            wrong += u64::from(!is_right(packet.bytes()));
        }
        self.accepted[0] += found;
        self.wrong += wrong;
        self.slave_hears(piece);
        self.controller_hears(piece, link);
        self.master_hears(piece);
    }

    fn slave_hears(&mut self, piece: Piece<'_>) {
        self.slave.receive(piece);
        while let Some(event) = self.slave.poll_event() {
            if let SlaveEvent::LowLatency { payload, .. } = event {
                let broadcast = |class, id| Address::new(class, id).unwrap();
                let mine = [
                    own(),
                    broadcast(0xFE, 1),
                    broadcast(1, 0xFE),
                    broadcast(0xFE, 0xFE),
                ];
                let right = mine.iter().any(|to| self.heard.has(*to, 0x10, &payload));
                self.judge(1, right);
            }
        }
        self.said.clear();
        self.slave.poll_transmit(&mut self.said);
    }

    fn controller_hears(&mut self, piece: Piece<'_>, link: bool) {
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
                let packets = self.heard.0.windows(len);
                packets.into_iter().any(|bytes| {
                    bytes[0] == 0xFF && usize::from(bytes[3]) + 4 == len && is_right(bytes)
                })
            });
            self.judge(2, any);
        }
    }

    fn master_hears(&mut self, piece: Piece<'_>) {
        // Its time runs faster, so that it comes to see the line quiet.
        let now = HostTime::from_nanos(100 * piece.last().as_nanos());
        self.master.handle_timeout(now);
        if !self.master.is_busy() {
            self.master.cycle(now, &[request()]).unwrap();
        }
        self.said.clear();
        self.master.poll_transmit(&mut self.said);
        self.master.handle_bytes(now, piece.bytes);
        if !self.master.is_busy() {
            let outcomes = self.master.outcomes().to_vec();
            for payload in outcomes.iter().flatten() {
                let right = self.heard.has(own(), 0, payload);
                self.judge(3, right);
            }
        }
    }
}

#[test]
fn ten_million_damaged_and_random_bytes_make_nobody_on_sbcp_panic_or_take_a_wrong_checksum() {
    let mut mangler = Mangler::new("sbcp", traffic());
    let mut parties = Parties::new();
    let (mut now, mut bytes) = (SimTime::ZERO, 0);
    while bytes < SBCP_BYTES {
        let (pause, spacing) = (
            mangler.below(60) as u64,
            3 * u64::from(mangler.below(20) > 0),
        );
        let link = mangler.below(2) == 0;
        let burst = mangler.next();
        let piece = Piece {
            first: now + SimDuration::from_micros(3 + pause),
            spacing: SimDuration::from_micros(spacing),
            bytes: burst,
            framing_error: false,
        };
        now = piece.last();
        bytes += burst.len() as u64;
        parties.receive(piece, link);
    }
    println!("{bytes} bytes each; packets taken: {:?}", parties.accepted);
    assert!(
        parties.accepted.iter().all(|taken| *taken > 100),
        "{:?}",
        parties.accepted
    );
    assert_eq!(parties.wrong, 0);
}

/// CRC-16/IBM-3740, a byte at a time.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc: u16, byte| {
        let mut x = (crc >> 8) as u8 ^ byte;
        x ^= x >> 4;
        let x = u16::from(x);
        (crc << 8) ^ (x << 12) ^ (x << 5) ^ x
    })
}

fn has_crc(frame: &[u8]) -> bool {
    let (said, found) = frame.split_at(frame.len() - 2);
    crc(said).to_le_bytes() == found
}

fn has_sum(frame: &[u8]) -> bool {
    let (said, found) = frame.split_at(frame.len() - 2);
    let sum: u32 = said.iter().map(|byte| u32::from(*byte)).sum();
    (sum % 65_536).to_be_bytes()[2..] == *found
}

/// Frames of a parser whose checksum is right, and wrong; the driver hears the same bytes.
fn frames(
    name: &str,
    good: Vec<Vec<u8>>,
    match_frame: fn(&[u8]) -> FrameMatch,
    right: fn(&[u8]) -> bool,
    driver: &mut dyn Driver,
) -> [u64; 2] {
    let mut mangler = Mangler::new(name, good);
    let mut framer = Framer::new(match_frame);
    let (mut bytes, mut found, mut said) = (0, [0; 2], Vec::new());
    let mut now = HostTime::from_nanos(0);
    driver.open(now);
    while bytes < OTHER_BYTES / 3 {
        let pause = mangler.below(20_000_000) as u64;
        let burst = mangler.next();
        bytes += burst.len() as u64;
        framer.push(burst);
        while let Some(frame) = framer.next_frame() {
            found[usize::from(!right(frame))] += 1;
        }
        now = HostTime::from_nanos(now.as_nanos() + pause);
        driver.handle_bytes(now, burst);
        driver.handle_timeout(now);
        said.clear();
        while driver.poll_transmit(&mut said) {}
        match driver.poll_transfer() {
            Ok(Transfer::Done) => driver.begin(now, &[0.1]),
            Ok(Transfer::Busy) => {}
            Err(_) => driver.open(now),
        }
        assert!(driver.to_process().iter().all(|value| value.is_finite()));
    }
    println!("{name}: {bytes} bytes, {found:?} frames right and wrong");
    found
}

fn encoded(encode: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode(&mut bytes);
    bytes
}

#[test]
fn ten_million_damaged_and_random_bytes_make_no_other_parser_panic_or_take_a_wrong_checksum() {
    let servos = |sequence| rb110::Request {
        sequence,
        twice: sequence == 2,
        pulses: [Some(75_000); 16],
        inputs: [true; 8],
    };
    let answers = |sequence| rb110::Answer {
        sequence,
        replaced: false,
        counts: [Some(512); 8],
    };
    let good = (0..3).flat_map(|n| {
        [
            encoded(|bytes| servos(n).encode(bytes)),
            encoded(|bytes| answers(n).encode(bytes)),
        ]
    });
    let mut driver = Rb110::with_servos("rb110", PulseMap::ONCILLA, &[(15, "LF")])
        .driver()
        .unwrap();
    let rb110 = frames(
        "rb110",
        good.collect(),
        rb110::match_frame,
        has_crc,
        &mut driver,
    );

    let data = (0..3_u16).map(|n| {
        let data = optoforce::Message::Data {
            counter: n,
            status: optoforce::Status(0),
            counts: optoforce::Counts::Three([1, -2, 300]),
        };
        encoded(|bytes| data.encode(bytes))
    });
    let told = encoded(|bytes| optoforce::Message::Acknowledgement { status: 0 }.encode(bytes));
    let good = data.chain([told]).collect();
    let mut driver = OptoForce::new("optoforce", "force").driver().unwrap();
    let optoforce = frames(
        "optoforce",
        good,
        optoforce::match_frame,
        has_sum,
        &mut driver,
    );

    let good = [
        phidget::Message::Accepted { done: true },
        phidget::Message::Bridge {
            sequence: 1,
            overload: [false; 4],
            counts: [1, -1, 70_000, 0],
        },
        phidget::Message::InterfaceKit {
            sequence: 2,
            readings: [500; 8],
        },
    ];
    let good = good.map(|message| encoded(|bytes| message.encode(bytes)));
    let mut driver = Phidget::new("bridge", Board::default()).driver().unwrap();
    let phidget = frames(
        "phidget",
        good.into(),
        phidget::match_frame,
        has_crc,
        &mut driver,
    );

    for [right, wrong] in [rb110, optoforce, phidget] {
        assert!(right > 1_000);
        assert_eq!(wrong, 0);
    }
}
