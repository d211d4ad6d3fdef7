//! The bus computed by packets and byte by byte: the same bits.

use std::cell::RefCell;

use proptest::prelude::*;
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime, Snapshot};
use twinrig_motordriver::{Bus, BusConfig, BusTopology, BusWire, FirmwareConfig, Generation};
use twinrig_runtime::{BusWork, Part, Timing, Wire};
use twinrig_sbcp::{Address, ControllerConfig, ForwardingMode, Instruction, Request, recipient};
use twinrig_wire::{UsbPreset, UsbTiming};

use super::harness::{Motors, Plant, with_clocks};

/// Bytes of the host, and the time since those before.
#[derive(Clone, Debug)]
struct Write {
    gap: SimDuration,
    bytes: Vec<u8>,
}

fn micros(range: std::ops::Range<u64>) -> impl Strategy<Value = SimDuration> {
    range.prop_map(SimDuration::from_micros)
}

/// A request to a board that is there or not, to the controller, or to all.
fn request() -> impl Strategy<Value = Vec<u8>> {
    let to = prop_oneof![
        8 => (1_u8..5).prop_map(|id| (1, id)),
        1 => Just((1, 9)),
        1 => Just((3, 1)),
        1 => Just((1, 0xFE)),
    ];
    let content = prop_oneof![
        6 => any::<[u8; 4]>().prop_map(|goals| (Instruction::LOW_LATENCY, goals.to_vec())),
        1 => prop::collection::vec(any::<u8>(), 0..8).prop_map(|bytes| (Instruction::LOW_LATENCY, bytes)),
        1 => Just((Instruction::PING, vec![])),
        1 => (0_u8..0x60).prop_map(|address| (Instruction::GET, vec![address])),
        1 => any::<[u8; 3]>().prop_map(|bytes| (Instruction::SET, bytes.to_vec())),
    ];
    (to, content).prop_map(|((class, id), (instruction, payload))| {
        let to = Address::new(class, id).unwrap();
        let mut bytes = Vec::new();
        Request::new(to, instruction, &payload)
            .unwrap()
            .emit(&mut bytes);
        bytes
    })
}

/// A frame of requests, whole or damaged, or arbitrary bytes.
fn bytes() -> impl Strategy<Value = Vec<u8>> {
    let frame = || prop::collection::vec(request(), 1..6).prop_map(|frame| frame.concat());
    prop_oneof![
        8 => frame(),
        1 => (frame(), any::<prop::sample::Index>(), any::<u8>()).prop_map(|(mut frame, at, byte)| {
            let at = at.index(frame.len());
            frame[at] = byte;
            frame
        }),
        1 => (frame(), any::<prop::sample::Index>()).prop_map(|(mut frame, at)| {
            frame.truncate(at.index(frame.len()));
            frame
        }),
        1 => prop::collection::vec(prop_oneof![Just(0xFF), any::<u8>()], 0..40),
    ]
}

/// Returns the first packet of a frame; a ping if it is none.
fn first_packet(frame: &[u8]) -> Vec<u8> {
    let length = |bytes: &[u8]| usize::from(bytes[3]) + 4;
    let first = frame.get(3).and_then(|_| frame.get(..length(frame)));
    let packet = first.filter(|packet| recipient(packet).is_some());
    packet.map_or_else(|| vec![0xFF, 1, 1, 2, 1, 5], <[u8]>::to_vec)
}

fn writes() -> impl Strategy<Value = Vec<Write>> {
    let gap = prop_oneof![micros(0..40), micros(0..600), micros(1_000..3_000)];
    let write = (gap, bytes()).prop_map(|(gap, bytes)| Write { gap, bytes });
    prop::collection::vec(write, 1..12)
}

fn controller() -> impl Strategy<Value = BusTopology> {
    let passing = prop_oneof![
        4 => Just(ForwardingMode::CutThrough),
        1 => Just(ForwardingMode::StoreAndForward),
    ];
    let times = (
        micros(13..60),
        micros(93..300),
        micros(0..20),
        micros(4..40),
    );
    (passing, times, 1_usize..6).prop_map(
        |(passing, (timeout, response_limit, gap, idle_gap), packets_max)| {
            BusTopology::Controller(ControllerConfig {
                passing,
                timeout,
                response_limit,
                gap,
                idle_gap,
                packets_max,
                ..ControllerConfig::default()
            })
        },
    )
}

fn config() -> impl Strategy<Value = BusConfig> {
    let topology = prop_oneof![
        1 => Just(BusTopology::Direct),
        2 => Just(BusTopology::Controller(ControllerConfig::default())),
        6 => controller(),
    ];
    let usb = (
        prop::sample::select(&UsbPreset::ALL[..]),
        prop::option::of(micros(1..300)),
        micros(0..125),
    );
    let clocks = (
        prop::array::uniform4(-3_000_000_i64..3_000_000),
        prop::array::uniform4(micros(0..1_000)),
    );
    let boards = prop::array::uniform4((0_u8..10, 0_u8..40));
    let bus = (
        micros(0..25),
        prop_oneof![6 => Just(3), 1 => Just(2), 1 => Just(30)],
        0_u8..8,
    );
    (topology, usb, clocks, boards, bus, any::<u64>()).prop_map(
        |(
            topology,
            (usb, jitter, offset),
            (rates, phases),
            boards,
            (turnaround, byte, trace),
            seed,
        )| {
            let byte_time = SimDuration::from_micros(byte);
            let topology = match topology {
                // The shortest that are accepted are those for the byte time.
                BusTopology::Controller(mut controller) => {
                    controller.timeout += byte_time;
                    controller.response_limit += byte_time * 31;
                    BusTopology::Controller(controller)
                }
                BusTopology::Direct => topology,
            };
            let mut config = BusConfig {
                topology,
                usb: UsbTiming::preset(usb),
                turnaround,
                byte_time,
                trace: trace == 0,
                seed,
                ..BusConfig::default()
            };
            config.usb.frame_offset = offset;
            if let Some(most) = jitter {
                config.usb.jitter = Timing::Uniform {
                    min: SimDuration::ZERO,
                    max: most,
                };
                config.usb.write_jitter = config.usb.jitter.clone();
            }
            for (board, (absent, first)) in config.boards.iter_mut().zip(boards) {
                board.present = absent > 0;
                board.firmware = FirmwareConfig {
                    generation: if first == 0 {
                        Generation::First
                    } else {
                        Generation::LowLatency
                    },
                    ..FirmwareConfig::default()
                };
            }
            with_clocks(config, rates, phases)
        },
    )
}

/// Everything that is visible: bytes at the host with their times, bytes on the traces, and the
/// diagnostics at some instants.
#[derive(Default)]
struct Seen {
    read: Vec<(SimTime, Vec<u8>)>,
    traced: Vec<(SimTime, usize, Vec<u8>)>,
    diagnostics: Vec<Vec<u64>>,
}

struct Host {
    config: BusConfig,
    wire: BusWire,
    plant: Motors,
    seen: Seen,
}

impl Host {
    fn new(config: &BusConfig, packet_level: bool) -> Self {
        let config = BusConfig {
            packet_level,
            ..config.clone()
        };
        let mut host = Self {
            wire: Bus::wire(&config).unwrap(),
            config,
            plant: Motors::new(),
            seen: Seen::default(),
        };
        host.connect();
        host
    }

    fn connect(&mut self) {
        self.wire.connect("sbcp", &Motors::signals()).unwrap();
    }

    fn advance(&mut self, now: SimTime) {
        assert!(now >= self.plant.now(), "what is visible was passed over");
        self.plant.set_now(now);
        self.wire.advance(now, &mut self.plant).unwrap();
        let mut read = Vec::new();
        self.wire.receive(&mut read);
        if !read.is_empty() {
            self.seen.read.push((now, read));
        }
        let traced = &mut self.seen.traced;
        self.wire
            .drain_traffic(&mut |trace, bytes| traced.push((now, trace, bytes.to_vec())));
    }

    fn run_until(&mut self, to: SimTime) {
        if self.config.packet_level {
            self.plant.horizon = to;
        }
        while let Some(at) = self.wire.next_wake().filter(|at| *at <= to) {
            self.advance(at);
            if self.wire.traces().is_empty() {
                let ahead = self.wire.run_ahead(at, SimTime::MAX, &mut self.plant);
                assert_eq!(ahead.unwrap(), self.plant.now());
            }
        }
    }

    fn observe(&mut self, now: SimTime) {
        let mut values = vec![0.0; Layout::of(&self.wire.diagnostics(), Direction::Output).len()];
        self.wire.read_diagnostics(now, &mut values);
        self.seen
            .diagnostics
            .push(values.iter().map(|value| value.to_bits()).collect());
    }

    /// Continues on another wire with the saved state.
    fn resume(&mut self) {
        let saved: Snapshot = self.wire.save();
        self.wire = Bus::wire(&self.config).unwrap();
        self.connect();
        self.wire.restore(&saved).unwrap();
    }

    fn work(&self) -> BusWork {
        let mut work = BusWork::default();
        self.wire.count_work(&mut work);
        work
    }
}

/// What happens between two writes: an observation at that time after the first, and whether the
/// bus is restored from a snapshot then.
type Look = (SimDuration, bool);

fn run(config: &BusConfig, packet_level: bool, writes: &[Write], looks: &[Look]) -> Host {
    let mut host = Host::new(config, packet_level);
    let mut now = SimTime::ZERO;
    let looks = looks.iter().cycle();
    for (write, (after, restored)) in writes.iter().zip(looks) {
        let at = now + write.gap;
        host.run_until(at.min(now + *after));
        host.observe(at.min(now + *after));
        if *restored {
            host.resume();
        }
        host.run_until(at);
        host.advance(at);
        host.wire.send(at, &write.bytes);
        now = at;
    }
    let end = now + SimDuration::from_millis(40);
    host.run_until(end);
    host.observe(end);
    host
}

#[test]
fn packets_and_bytes_give_the_same_bits() {
    let total = RefCell::new(BusWork::default());
    let looks = || prop::collection::vec((micros(0..600), prop::bool::weighted(0.2)), 1..6);
    proptest!(|(config in config(), mut writes in writes(), looks in looks())| {
        if config.topology == BusTopology::Direct {
            // Boards on a bus of the host receive transmissions of one packet each.
            for write in &mut writes {
                write.bytes = first_packet(&write.bytes);
            }
        }
        let by_packet = run(&config, true, &writes, &looks);
        let by_byte = run(&config, false, &writes, &looks);
        let (found, expected) = (&by_packet.seen, &by_byte.seen);
        prop_assert_eq!(&found.read, &expected.read, "bytes at the host");
        prop_assert_eq!(&found.traced, &expected.traced, "bytes on the traces");
        prop_assert_eq!(&found.diagnostics, &expected.diagnostics, "diagnostics");
        prop_assert_eq!(by_byte.work().packets, 0);
        let (mut total, work) = (total.borrow_mut(), by_packet.work());
        total.transmissions += work.transmissions;
        total.packets += work.packets;
    });
    let BusWork {
        transmissions,
        packets,
        ..
    } = total.into_inner();
    println!("{packets} of {transmissions} answers as a whole");
    // In half of the configurations the bus is direct, traced or patient, or a board is of the
    // first generation; the draws are of a fixed seed in CI.
    assert!(4 * packets > transmissions, "{packets} of {transmissions}");
}

/// A board ticks while its answer and the next request garble each other: the bytes received so far
/// are seen.
#[test]
fn disturbed_bytes_are_received_at_ticks_within_them() {
    let micros = SimDuration::from_micros;
    let request = |id, instruction, payload: &[u8]| {
        let (to, mut bytes) = (Address::new(1, id).unwrap(), Vec::new());
        Request::new(to, instruction, payload)
            .unwrap()
            .emit(&mut bytes);
        bytes
    };
    let cycle = || request(1, Instruction::LOW_LATENCY, &[0; 4]);
    let mut config = BusConfig {
        topology: BusTopology::Controller(ControllerConfig {
            timeout: micros(17),
            packets_max: 2,
            ..ControllerConfig::default()
        }),
        usb: UsbTiming::preset(UsbPreset::Earliest),
        byte_time: micros(2),
        turnaround: micros(15),
        ..BusConfig::default()
    };
    config.usb.frame_offset = micros(116);
    let clocks = [0, 1, 2, 3].map(|board| if board == 1 { micros(444) } else { micros(0) });
    let mut config = with_clocks(config, [0, -561_833, 0, 0], clocks);
    for (n, board) in config.boards.iter_mut().enumerate() {
        board.present = n == 1;
    }
    let frame = [request(2, Instruction::PING, &[]), cycle()].concat();
    let writes = [
        (2_308, cycle()),
        (432, cycle()),
        (38, cycle()),
        (71, cycle()),
        (535, frame),
    ];
    let writes = writes.into_iter().chain([(11, cycle()), (163, cycle())]);
    let writes: Vec<Write> = writes
        .map(|(gap, bytes)| Write {
            gap: micros(gap),
            bytes,
        })
        .collect();
    let [found, expected] = [true, false]
        .map(|by_packet| run(&config, by_packet, &writes, &[(micros(163), false)]).seen);
    assert_eq!(found.read, expected.read);
    assert_eq!(found.diagnostics, expected.diagnostics);
}
