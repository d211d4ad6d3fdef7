//! Buses of servos computed by packets and byte by byte: the same bits.

use std::cell::Cell;

use proptest::prelude::*;
use twinrig_dynamixel::x::XL330_M288;
use twinrig_dynamixel::{
    JointSignals, ProtocolVersion, Request, ServoConfig, ServoKind, ServoNode, Span,
};
use twinrig_feetech::STS3215;
use twinrig_kernel::{BoardClock, Direction, Layout, LocalDuration, SimDuration, SimTime};
use twinrig_runtime::{BusWork, Part, Plant};
use twinrig_testing::wired_harness::Joints;
use twinrig_wire::{Arrivals, Line, Node, Piece, Rs485};

const BYTE: SimDuration = SimDuration::from_micros(10);
const SERVOS: u8 = 4;

/// Bytes of the host, and the pause before them.
type Write = (SimDuration, Vec<u8>);

/// Kind of the servos, and registers of position, return delay, identifier and status return level.
type Kind = (&'static ServoKind, [u16; 4]);

const KINDS: [Kind; 2] = [(&XL330_M288, [116, 9, 7, 68]), (&STS3215, [42, 7, 5, 8])];

fn micros(range: std::ops::Range<u64>) -> impl Strategy<Value = SimDuration> {
    range.prop_map(SimDuration::from_micros)
}

/// An instruction to servos that are there or not.
fn instruction((kind, registers): Kind) -> impl Strategy<Value = Vec<u8>> {
    let protocol = kind.model.protocol;
    let id = 1..=SERVOS + 1;
    let ids = prop::collection::vec(id.clone(), 1..6);
    let span = (0..60_u16, 1..9_u16).prop_map(|(address, length)| Span { address, length });
    let register = prop::sample::select(registers.to_vec());
    (0..9_u8, id, ids, span, register, any::<[u8; 2]>()).prop_map(
        move |(which, id, ids, span, address, data)| {
            let all = ProtocolVersion::BROADCAST;
            let data = &data[..];
            let (id, request) = match which {
                0 => (id, Request::Ping),
                1 => (all, Request::Ping),
                2 | 3 => (id, Request::Read(span)),
                4 => (id, Request::Write { address, data }),
                5 => (all, Request::Write { address, data }),
                6 if protocol == ProtocolVersion::Two => {
                    (all, Request::FastSyncRead { span, ids: &ids })
                }
                _ => (all, Request::SyncRead { span, ids: &ids }),
            };
            let mut bytes = Vec::new();
            request.encode(protocol, id, &mut bytes).unwrap();
            bytes
        },
    )
}

/// Packets, whole or damaged, or arbitrary bytes.
fn bytes(kind: Kind) -> impl Strategy<Value = Vec<u8>> {
    let packets = prop_oneof![
        8 => prop::collection::vec(instruction(kind), 1),
        1 => prop::collection::vec(instruction(kind), 2..4),
    ];
    let packets = packets.prop_map(|packets| packets.concat()).boxed();
    prop_oneof![
        8 => packets.clone(),
        1 => (packets.clone(), any::<prop::sample::Index>(), any::<u8>()).prop_map(
            |(mut bytes, at, byte)| {
                let at = at.index(bytes.len());
                bytes[at] = byte;
                bytes
            }
        ),
        1 => (packets, any::<prop::sample::Index>()).prop_map(|(mut bytes, at)| {
            bytes.truncate(at.index(bytes.len()));
            bytes
        }),
        1 => prop::collection::vec(prop_oneof![Just(0xFF), any::<u8>()], 0..30),
    ]
}

fn writes(kind: Kind) -> impl Strategy<Value = Vec<Write>> {
    let gap = prop_oneof![micros(0..60), micros(0..900), micros(2_000..12_000)];
    prop::collection::vec((gap, bytes(kind)), 1..14)
}

/// Return delay in units of 2 µs, and clock, of each servo.
type Boards = [(i32, u64, i64); SERVOS as usize];

fn boards() -> impl Strategy<Value = Boards> {
    let delay = prop_oneof![3 => 0..30_i32, 1 => 0..254_i32];
    prop::array::uniform4((delay, 0..1_000_u64, -40_000..40_000_i64))
}

fn bus((kind, registers): Kind, boards: &Boards, turnaround: SimDuration) -> Rs485 {
    let node = |(n, &(delay, phase, ppb)): (usize, &(i32, u64, i64))| {
        let offset = LocalDuration::from_nanos(1_000 * i64::try_from(phase).unwrap());
        let config = ServoConfig {
            name: format!("joint{n}"),
            kind,
            id: u8::try_from(n + 1).unwrap(),
            registers: vec![(registers[1], delay)],
            settings: Vec::new(),
            signals: JointSignals::of_joint(&format!("joint{n}")),
            command: String::new(),
            voltage: 5.0,
            temperature: 25.0,
            clock: BoardClock::new(offset, ppb).unwrap(),
        };
        Box::new(ServoNode::new("bus", &config, BYTE)) as Box<dyn Node>
    };
    let nodes = boards.iter().enumerate().map(node).collect();
    Rs485::new("bus", BYTE, turnaround, nodes).unwrap()
}

/// Everything that is visible at the host.
#[derive(Debug, Default, PartialEq)]
struct Seen {
    read: Vec<(SimTime, u8)>,
    diagnostics: Vec<Vec<u64>>,
}

struct Host<'b> {
    build: &'b dyn Fn() -> Rs485,
    bus: Rs485,
    joints: Joints,
    seen: Seen,
}

impl<'b> Host<'b> {
    fn new(build: &'b dyn Fn() -> Rs485) -> Self {
        let names: Vec<String> = (0..SERVOS).map(|n| format!("joint{n}")).collect();
        let (joints, signals) = Joints::new(&names);
        let mut bus = build();
        bus.connect("bus", &signals).unwrap();
        Self {
            build,
            bus,
            joints,
            seen: Seen::default(),
        }
    }

    fn run_until(&mut self, to: SimTime) {
        while let Some(at) = self.bus.next_wake().filter(|at| *at < to) {
            self.advance(at);
        }
        self.advance(to);
    }

    fn advance(&mut self, now: SimTime) {
        let mut arrivals = Arrivals::default();
        let inputs = self.joints.inputs.clone();
        self.joints.advance(now, &inputs).unwrap();
        self.bus.advance(now, &mut self.joints).unwrap();
        self.bus.receive(&mut arrivals);
        self.seen.read.extend(arrivals.iter());
    }

    fn observe(&mut self, now: SimTime, restored: bool) {
        let mut values = vec![0.0; Layout::of(&self.bus.diagnostics(), Direction::Output).len()];
        self.bus.read_diagnostics(now, &mut values);
        let bits = values.iter().map(|value| value.to_bits()).collect();
        self.seen.diagnostics.push(bits);
        if restored {
            let saved = self.bus.save();
            *self = Self {
                seen: std::mem::take(&mut self.seen),
                ..Self::new(self.build)
            };
            self.bus.restore(&saved).unwrap();
        }
    }
}

/// Writes to a bus, and looks at it at some time after each write.
fn run(
    build: &dyn Fn() -> Rs485,
    writes: &[Write],
    looks: &[(SimDuration, bool)],
) -> (Seen, BusWork) {
    let mut host = Host::new(build);
    let mut now = SimTime::ZERO;
    for ((gap, bytes), (after, restored)) in writes.iter().zip(looks.iter().cycle()) {
        let at = now + *gap;
        host.run_until(at.min(now + *after));
        host.observe(at.min(now + *after), *restored);
        host.run_until(at);
        let piece = Piece {
            first: at + BYTE,
            spacing: BYTE,
            bytes,
            framing_error: false,
        };
        host.bus.send(piece);
        now = if bytes.is_empty() { at } else { piece.last() };
    }
    let end = now + SimDuration::from_millis(60);
    host.run_until(end);
    host.observe(end, false);
    let mut work = BusWork::default();
    host.bus.count_work(&mut work);
    (host.seen, work)
}

#[test]
fn packets_and_bytes_give_the_same_bits() {
    let received = Cell::new((0, 0));
    let kinds = (0..KINDS.len()).prop_flat_map(|kind| (Just(kind), writes(KINDS[kind])));
    let looks = || prop::collection::vec((micros(0..900), prop::bool::weighted(0.2)), 1..6);
    proptest!(|(
        (kind, writes) in kinds, boards in boards(), turnaround in micros(0..30), looks in looks(),
    )| {
        let by_byte = || bus(KINDS[kind], &boards, turnaround);
        let by_packet = || by_byte().with_packets(match KINDS[kind].0.model.protocol {
            ProtocolVersion::One => |bytes| ProtocolVersion::One.packet_address(bytes),
            ProtocolVersion::Two => |bytes| ProtocolVersion::Two.packet_address(bytes),
        });
        let (expected, all) = run(&by_byte, &writes, &looks);
        let (found, some) = run(&by_packet, &writes, &looks);
        prop_assert_eq!(found, expected);
        let (few, many) = received.get();
        received.set((few + some.received, many + all.received));
    });
    let (few, many) = received.get();
    // Of four servos two hear an answer to a sync read where all would; collisions, damage and
    // partial packets are received by all.
    assert!(6 * few < 5 * many, "{few} of {many} pieces");
}
