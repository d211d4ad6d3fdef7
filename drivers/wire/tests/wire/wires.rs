//! Complete wires: no byte is lost, duplicated or reordered; a restored wire continues bit for bit;
//! a running wire does not allocate.

use crate::support::*;
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Part, Timing, Wire};
use twinrig_wire::{
    Arrivals, CompletionRule, FaultSchedule, Faulty, HostEnd, InRule, Line, OutRule, Piece, Rs485,
    Traced, Uart, UsbSerial, UsbTiming,
};

type Read = Vec<(SimTime, Vec<u8>)>;
type Sent = std::sync::mpsc::Receiver<(SimTime, u8)>;

fn scripted_line(arrivals_due: &Bursts) -> (ScriptedLine, Sent) {
    let (sent, far) = std::sync::mpsc::channel();
    (
        ScriptedLine {
            arrivals_due: timed(arrivals_due),
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
    let inn = prop_oneof![
        Just(InRule::ByThisFrame),
        Just(InRule::ByPreviousFrame),
        (0_u64..3_000).prop_map(|period| InRule::ByTimer(us(period))),
        (0_u64..3_000).prop_map(|delay| InRule::After(us(delay))),
    ];
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
fn advance_with_sends(
    wire: &mut dyn Wire,
    sends: &Bursts,
    extra_times: &[SimTime],
    read: &mut Read,
) {
    let (mut now, mut extra_times) = (SimTime::ZERO, extra_times.to_vec());
    for (gap, bytes) in sends {
        now += SimDuration::from_nanos(*gap);
        let later = extra_times.split_off(extra_times.partition_point(|at| *at <= now));
        advance_wire(wire, now, &extra_times, read);
        extra_times = later;
        wire.advance(now, &mut NoPlant).unwrap();
        wire.send(now, bytes);
    }
    advance_wire(wire, at(END), &extra_times, read);
}

proptest! {
    #[test]
    fn usb_preserves_bytes_and_order_at_any_poll_times(
        timing in timing(), sends in bursts(100), arrivals_due in bursts(100), extra_times in instants(),
    ) {
        let run = |extra_times: &[SimTime]| {
            let (line, far) = scripted_line(&arrivals_due);
            let mut wire = UsbSerial::new("sbcp", timing.clone(), BYTE, 1, line).unwrap();
            let mut read = Read::new();
            advance_with_sends(&mut wire, &sends, extra_times, &mut read);
            (far.try_iter().collect::<Vec<_>>(), read)
        };
        let (far, read) = run(&[]);
        let bytes = |bursts: &Bursts| bursts.iter().flat_map(|(_, bytes)| bytes.clone()).collect::<Vec<_>>();
        prop_assert_eq!(far.iter().map(|(_, byte)| *byte).collect::<Vec<_>>(), bytes(&sends));
        prop_assert!(far.windows(2).all(|pair| pair[0].0 + BYTE <= pair[1].0));
        prop_assert_eq!(joined(&read), bytes(&arrivals_due));
        // No byte is read before it has arrived.
        let mut count = 0;
        let arrived = timed(&arrivals_due);
        for (now, bytes) in &read {
            count += bytes.len();
            prop_assert!(arrived[count - 1].0 <= *now);
        }
        prop_assert_eq!(run(&extra_times), (far, read));
    }

    #[test]
    fn uart_transmits_at_the_byte_rate(pieces in prop::collection::vec((0_u64..40_000, 0_u64..9_000, 1_usize..9), 0..9)) {
        let (line, far) = scripted_line(&vec![]);
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
    fn restored_wire_continues_bit_for_bit(
        timing in timing(), requests in prop::collection::vec((0_u8..4, 0_u64..900), 1..6), saved_at in 0_u64..3_000,
    ) {
        let new = || {
            let bus = Rs485::new("sbcp", BYTE, us(2), boards()).unwrap();
            let line = Faulty::new("wire/sbcp", BYTE, &FaultSchedule::default(), Traced::new("rs485", bus)).unwrap();
            UsbSerial::new("sbcp", timing.clone(), BYTE, 1, Uart::new(BYTE, line)).unwrap()
        };
        let mut sends: Vec<(SimTime, [u8; 10])> = Vec::new();
        for (board, gap) in &requests {
            let last = sends.last().map_or(SimTime::ZERO, |(at, _)| *at);
            sends.push((last + us(*gap), request(*board)));
        }
        let run = |wire: &mut UsbSerial<_>, from: Option<SimTime>, until: SimTime, read: &mut Read| {
            for (when, bytes) in sends.iter().filter(|(when, _)| from.is_none_or(|from| *when > from) && *when <= until) {
                advance_wire(wire, *when, &[], read);
                wire.advance(*when, &mut NoPlant).unwrap();
                wire.send(*when, bytes);
            }
            advance_wire(wire, until, &[], read);
        };
        let (mut uninterrupted, mut first, mut second) = (new(), new(), new());
        let (mut expected, mut found) = (Read::new(), Read::new());
        run(&mut uninterrupted, None, at(END), &mut expected);
        run(&mut first, None, at(saved_at), &mut found);
        second.restore(&first.save()).unwrap();
        prop_assert_eq!(second.save(), first.save());
        prop_assert_eq!(second.next_wake(), first.next_wake());
        run(&mut second, Some(at(saved_at)), at(END), &mut found);
        prop_assert_eq!(&found, &expected);
        prop_assert_eq!(second.save(), uninterrupted.save());
    }
}

#[test]
fn host_end_paces_writes_and_reads_complete_bytes() {
    let bus = Rs485::new("bus", BYTE, us(2), boards()).unwrap();
    let mut wire = HostEnd::new(Traced::new("rs485", Uart::new(BYTE, bus)));
    wire.send(at(100), &request(2));
    let mut read = Read::new();
    advance_wire(&mut wire, at(1000), &[], &mut read);
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
fn restored_port_keeps_its_transmit_end() {
    let new = || {
        let (line, far) = scripted_line(&vec![]);
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

/// One cycle over four boards as a host performs it.
fn cycle(wire: &mut dyn Wire, now: &mut SimTime, bytes: &mut Vec<u8>, wakes: &mut u32) {
    for board in 0..4 {
        wire.advance(*now, &mut NoPlant).unwrap();
        wire.send(*now, &request(board));
        bytes.clear();
        while bytes.len() < 22 {
            *now = wire.next_wake().unwrap();
            *wakes += 1;
            wire.advance(*now, &mut NoPlant).unwrap();
            wire.receive(bytes);
        }
        wire.drain_traffic(&mut |_, _| {});
    }
}

#[test]
fn running_wire_does_not_allocate_and_needs_seven_wake_ups_per_board() {
    let bus = Rs485::new("sbcp", BYTE, us(2), boards()).unwrap();
    let schedule = FaultSchedule::default();
    let line = Faulty::new("wire/sbcp", BYTE, &schedule, Traced::new("rs485", bus)).unwrap();
    let mut wire =
        UsbSerial::new("sbcp", UsbTiming::default(), BYTE, 1, Uart::new(BYTE, line)).unwrap();
    let (mut now, mut bytes, mut wakes) = (SimTime::ZERO, Vec::new(), 0);
    for _ in 0..10 {
        cycle(&mut wire, &mut now, &mut bytes, &mut wakes);
    }
    wakes = 0;
    let info = allocation_counter::measure(|| {
        for _ in 0..100 {
            cycle(&mut wire, &mut now, &mut bytes, &mut wakes);
        }
    });
    assert_eq!(info.count_total, 0);
    // Per board: its request; the first and the last byte of the answer, and each ten bytes by the
    // attention of the boards; two reads.
    assert_eq!(wakes, 100 * 4 * 7);
}

/// Requests as a bus controller transmits them: the next one soon after the last answer.
#[test]
fn cycle_of_four_boards_takes_twelve_wake_ups() {
    let mut bus = Rs485::new("sbcp", BYTE, us(2), boards_without_attention()).unwrap();
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
            bus.advance(now, &mut NoPlant).unwrap();
            bus.receive(&mut near);
        }
    }
    // Each board receives its request; the near end the first and the last byte of the answer.
    assert_eq!((wakes, now), (12, at(4 * 126)));
}
