//! Whole wires: nothing is lost, doubled or turned round; saved anywhere they go on alike; running, they allocate nothing.

mod support;

use proptest::prelude::*;
use support::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Timing, Wire};
use twinrig_wire::{
    Arrivals, CompletionRule, FaultSchedule, Faulty, HostEnd, InRule, Line, OutRule, Piece, Rs485,
    Traced, Uart, UsbSerial, UsbTiming,
};

type Read = Vec<(SimTime, Vec<u8>)>;
type Sent = std::sync::mpsc::Receiver<(SimTime, u8)>;

fn scripted(arrives: &Bursts) -> (Scripted, Sent) {
    let (sent, far) = std::sync::mpsc::channel();
    (
        Scripted {
            arrives: timed(arrives),
            arrived: 0,
            taken: 0,
            now: SimTime::ZERO,
            sent,
        },
        far,
    )
}

fn timing() -> impl Strategy<Value = UsbTiming> {
    let out = prop_oneof![
        Just(OutRule::AtOnce),
        Just(OutRule::StartOfNext),
        Just(OutRule::EndOfNext)
    ];
    let inn = prop_oneof![Just(InRule::ByThisFrame), Just(InRule::ByPreviousFrame)];
    let completion = prop_oneof![
        Just(CompletionRule::AtOnce),
        Just(CompletionRule::StartOfNext)
    ];
    let chip = (0_u64..3_000, 1_usize..40, 1_usize..4);
    let up_to = |micros: u64| prop_oneof![Just(0), 0..micros];
    let host = (up_to(150), up_to(400), up_to(400));
    let frames = (0_u64..300_000, -200_000_i64..200_000);
    (out, inn, completion, chip, host, frames).prop_map(
        |(out, inn, completion, chip, host, frames)| UsbTiming {
            microframe: us(125),
            out,
            inn,
            completion,
            turnaround: us(host.0),
            latency_timer: us(chip.0),
            payload: chip.1,
            packets_per_microframe: chip.2,
            jitter: Timing::Uniform {
                min: us(0),
                max: us(host.1),
            },
            write_jitter: Timing::Uniform {
                min: us(0),
                max: us(host.2),
            },
            frame_offset: SimDuration::from_nanos(frames.0),
            frame_rate_ppb: frames.1,
        },
    )
}

fn instants() -> impl Strategy<Value = Vec<SimTime>> {
    prop::collection::btree_set(0_u64..2_000_000, 0..60)
        .prop_map(|set| set.into_iter().map(SimTime::from_nanos).collect())
}

const END: u64 = 100_000;

fn joined(read: &Read) -> Vec<u8> {
    read.iter()
        .flat_map(|(_, bytes)| bytes.iter().copied())
        .collect()
}

/// Sends bursts, each its gap after the last, and reads until the end.
fn live_with_sends(wire: &mut dyn Wire, sends: &Bursts, also: &[SimTime], read: &mut Read) {
    let (mut now, mut also) = (SimTime::ZERO, also.to_vec());
    for (gap, bytes) in sends {
        now += SimDuration::from_nanos(*gap);
        let later = also.split_off(also.partition_point(|at| *at <= now));
        live(wire, now, &also, read);
        also = later;
        wire.advance(now, &mut Nowhere).unwrap();
        wire.send(now, bytes);
    }
    live(wire, at(END), &also, read);
}

proptest! {
    #[test]
    fn usb_loses_doubles_and_reorders_nothing_however_one_looks(
        timing in timing(), sends in bursts(100), arrives in bursts(100), also in instants(),
    ) {
        let play = |also: &[SimTime]| {
            let (line, far) = scripted(&arrives);
            let mut wire = UsbSerial::new("sbcp", timing.clone(), BYTE, 1, line).unwrap();
            let mut read = Read::new();
            live_with_sends(&mut wire, &sends, also, &mut read);
            (far.try_iter().collect::<Vec<_>>(), read)
        };
        let (far, read) = play(&[]);
        let bytes = |bursts: &Bursts| bursts.iter().flat_map(|(_, bytes)| bytes.clone()).collect::<Vec<_>>();
        prop_assert_eq!(far.iter().map(|(_, byte)| *byte).collect::<Vec<_>>(), bytes(&sends));
        prop_assert!(far.windows(2).all(|pair| pair[0].0 + BYTE <= pair[1].0));
        prop_assert_eq!(joined(&read), bytes(&arrives));
        // Nothing is read before it has arrived.
        let mut count = 0;
        let arrived = timed(&arrives);
        for (now, bytes) in &read {
            count += bytes.len();
            prop_assert!(arrived[count - 1].0 <= *now);
        }
        prop_assert_eq!(play(&also), (far, read));
    }

    #[test]
    fn a_uart_sends_as_fast_as_it_can_and_no_faster(pieces in prop::collection::vec((0_u64..40_000, 0_u64..9_000, 1_usize..9), 0..9)) {
        let (line, far) = scripted(&vec![]);
        let mut uart = Uart::new(BYTE, line);
        let (mut first, mut free, mut expected) = (SimTime::ZERO, SimTime::ZERO, Vec::new());
        for (gap, spacing, count) in pieces {
            first += SimDuration::from_nanos(gap);
            let bytes: Vec<u8> = (0..count).map(|n| n.to_le_bytes()[0]).collect();
            let piece = Piece { first, spacing: SimDuration::from_nanos(spacing), bytes: &bytes, framing_error: false };
            uart.send(piece);
            for (n, byte) in bytes.iter().enumerate() {
                free = free.max(piece.at(n)) + BYTE;
                expected.push((free, *byte));
            }
            first = piece.last();
        }
        prop_assert_eq!(far.try_iter().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn a_wire_saved_amid_bytes_goes_on_alike(
        timing in timing(), boards_asked in prop::collection::vec((0_u8..4, 0_u64..900), 1..6), cut in 0_u64..3_000,
    ) {
        let new = || {
            let bus = Rs485::new("sbcp", BYTE, us(2), boards()).unwrap();
            let line = Faulty::new("wire/sbcp", BYTE, &FaultSchedule::default(), Traced::new("rs485", bus)).unwrap();
            UsbSerial::new("sbcp", timing.clone(), BYTE, 1, Uart::new(BYTE, line)).unwrap()
        };
        let mut sends: Vec<(SimTime, [u8; 10])> = Vec::new();
        for (board, gap) in &boards_asked {
            let last = sends.last().map_or(SimTime::ZERO, |(at, _)| *at);
            sends.push((last + us(*gap), request(*board)));
        }
        let play = |wire: &mut UsbSerial<_>, from: Option<SimTime>, until: SimTime, read: &mut Read| {
            for (when, bytes) in sends.iter().filter(|(when, _)| from.is_none_or(|from| *when > from) && *when <= until) {
                live(wire, *when, &[], read);
                wire.advance(*when, &mut Nowhere).unwrap();
                wire.send(*when, bytes);
            }
            live(wire, until, &[], read);
        };
        let (mut whole, mut first, mut second) = (new(), new(), new());
        let (mut expected, mut found) = (Read::new(), Read::new());
        play(&mut whole, None, at(END), &mut expected);
        play(&mut first, None, at(cut), &mut found);
        second.restore(&first.save()).unwrap();
        prop_assert_eq!(second.save(), first.save());
        prop_assert_eq!(second.next_wake(), first.next_wake());
        play(&mut second, Some(at(cut)), at(END), &mut found);
        prop_assert_eq!(&found, &expected);
        prop_assert_eq!(second.save(), whole.save());
    }
}

#[test]
fn a_host_s_own_port_paces_what_it_sends_and_reads_what_arrives() {
    let bus = Rs485::new("bus", BYTE, us(2), boards()).unwrap();
    let mut wire = HostEnd::new(Traced::new("rs485", Uart::new(BYTE, bus)));
    wire.send(at(100), &request(2));
    let mut read = Read::new();
    live(&mut wire, at(1000), &[], &mut read);
    // Ten bytes, 10 µs until the answer begins, 22 bytes.
    assert_eq!(read.first().unwrap().0, at(100 + 30 + 10 + 3));
    assert_eq!(
        (read.last().unwrap().0, joined(&read).len()),
        (at(100 + 106), 22)
    );
    assert_eq!(wire.traces(), ["rs485/out", "rs485/in"]);
    let mut passed = [Vec::new(), Vec::new()];
    wire.drain_traffic(&mut |trace, bytes| passed[trace].extend_from_slice(bytes));
    assert_eq!(passed, [request(2).to_vec(), joined(&read)]);
    wire.drain_traffic(&mut |_, _| panic!("handed over already"));
}

#[test]
fn a_port_saved_while_it_sends_goes_on_sending() {
    let new = || {
        let (line, far) = scripted(&vec![]);
        (HostEnd::new(Uart::new(BYTE, line)), far)
    };
    let ((mut first, _far), (mut second, far)) = (new(), new());
    first.send(at(0), b"first");
    second.restore(&first.save()).unwrap();
    second.send(at(3), b"2nd");
    assert_eq!(
        far.try_iter().collect::<Vec<_>>(),
        [(at(18), b'2'), (at(21), b'n'), (at(24), b'd')]
    );
}

/// A round over four boards as a host makes it.
fn round(wire: &mut dyn Wire, now: &mut SimTime, bytes: &mut Vec<u8>, wakes: &mut u32) {
    for board in 0..4 {
        wire.advance(*now, &mut Nowhere).unwrap();
        wire.send(*now, &request(board));
        bytes.clear();
        while bytes.len() < 22 {
            *now = wire.next_wake().unwrap();
            *wakes += 1;
            wire.advance(*now, &mut Nowhere).unwrap();
            wire.receive(bytes);
        }
        wire.drain_traffic(&mut |_, _| {});
    }
}

#[test]
fn running_allocates_nothing_and_wakes_rarely() {
    let bus = Rs485::new("sbcp", BYTE, us(2), boards()).unwrap();
    let schedule = FaultSchedule::default();
    let line = Faulty::new("wire/sbcp", BYTE, &schedule, Traced::new("rs485", bus)).unwrap();
    let mut wire =
        UsbSerial::new("sbcp", UsbTiming::default(), BYTE, 1, Uart::new(BYTE, line)).unwrap();
    let (mut now, mut bytes, mut wakes) = (SimTime::ZERO, Vec::new(), 0);
    for _ in 0..10 {
        round(&mut wire, &mut now, &mut bytes, &mut wakes);
    }
    wakes = 0;
    let info = allocation_counter::measure(|| {
        for _ in 0..100 {
            round(&mut wire, &mut now, &mut bytes, &mut wakes);
        }
    });
    assert_eq!(info.count_total, 0);
    // A board: its request; of the answer the first and the last byte, and each ten that attentive boards count; two reads.
    assert_eq!(wakes, 100 * 4 * 7);
}

/// Asks as a bus controller does: the next request soon after the last answer.
#[test]
fn a_cycle_of_four_boards_takes_few_wake_ups() {
    let mut bus = Rs485::new("sbcp", BYTE, us(2), listeners()).unwrap();
    let (mut near, mut wakes, mut now) = (Arrivals::default(), 0, at(0));
    for board in 0..4 {
        near.clear();
        now += us(20);
        bus.send(Piece {
            first: now + BYTE,
            spacing: BYTE,
            bytes: &request(board),
            framing_error: false,
        });
        while near.len() < 22 {
            now = bus.next_wake().unwrap();
            wakes += 1;
            bus.advance(now, &mut Nowhere).unwrap();
            bus.receive(&mut near);
        }
    }
    // Each board hears its request; the near end the first and the last byte of the answer.
    assert_eq!((wakes, now), (12, at(4 * 126)));
}
