//! Timing of the USB serial converter with a bus, compared with the rates of real ones.

use crate::support::*;
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Timing, Wire};
use twinrig_wire::{Node, OutRule, Rs485, UsbPreset, UsbSerial, UsbTiming};

fn wire(timing: UsbTiming, nodes: Vec<Box<dyn Node>>) -> UsbSerial<Rs485> {
    let bus = Rs485::new("sbcp", BYTE, us(2), nodes).unwrap();
    UsbSerial::new("sbcp", timing, BYTE, 1, bus).unwrap()
}

fn preset(preset: UsbPreset) -> UsbTiming {
    UsbTiming::preset(preset)
}

/// Host that requests the next board as soon as the answer of the last one is complete. Returns the
/// completion times of the answers.
fn answer_times(
    wire: &mut dyn Wire,
    requests: &[Vec<u8>],
    response: usize,
    count: usize,
    think: SimDuration,
) -> Vec<SimTime> {
    let (mut done, mut bytes, mut now) = (Vec::new(), Vec::new(), SimTime::ZERO);
    wire.send(now, &requests[0]);
    while done.len() < count {
        now = wire.next_wake().unwrap();
        wire.advance(now, &mut NoPlant).unwrap();
        wire.receive(&mut bytes);
        if bytes.len() >= response {
            assert_eq!(bytes.len(), response);
            bytes.clear();
            done.push(now);
            wire.advance(now + think, &mut NoPlant).unwrap();
            wire.send(now + think, &requests[done.len() % requests.len()]);
        }
    }
    done
}

fn four_requests() -> Vec<Vec<u8>> {
    (0..4).map(|board| request(board).to_vec()).collect()
}

/// Steady-state duration of a cycle over four boards.
fn direct_cycle(timing: UsbTiming) -> SimDuration {
    let done = answer_times(&mut wire(timing, boards()), &four_requests(), 22, 44, us(0));
    let cycles: Vec<_> = done.chunks(4).map(|cycle| cycle[3]).collect();
    let lengths: Vec<_> = cycles[3..]
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .collect();
    assert!(
        lengths.iter().all(|length| *length == lengths[0]),
        "{lengths:?}"
    );
    lengths[0]
}

#[test]
fn presets_give_the_rates_of_their_hosts() {
    let table = [
        (UsbPreset::Thesis, 2_500),        // 400 Hz
        (UsbPreset::Earliest, 1_000),      // 1 kHz
        (UsbPreset::LowLatency, 4_000),    // 250 Hz
        (UsbPreset::Default, 64_000),      // 15.6 Hz
        (UsbPreset::FullSpeed, 4 * 5_000), // 50 Hz: five frames a board
    ];
    for (of, micros) in table {
        assert_eq!(direct_cycle(preset(of)), us(micros), "{}", of.name());
    }
}

#[test]
fn board_takes_four_microframes_and_its_bus_time_rounded_up() {
    for bus in (99..=1500).step_by(3) {
        let mut board = Board::new(0);
        board.reaction = us(bus - 96);
        let done = answer_times(
            &mut wire(UsbTiming::default(), vec![Box::new(board)]),
            &[request(0).to_vec()],
            22,
            5,
            us(0),
        );
        for pair in done.windows(2) {
            assert_eq!(
                pair[1] - pair[0],
                us((4 + bus.div_ceil(125)) * 125),
                "{bus}"
            );
        }
    }
}

#[test]
fn host_processing_within_a_microframe_takes_no_extra_time() {
    for think in 0..=100 {
        let done = answer_times(
            &mut wire(UsbTiming::default(), boards()),
            &four_requests(),
            22,
            9,
            us(think),
        );
        for pair in done.windows(2) {
            assert_eq!(pair[1] - pair[0], us(625), "{think}");
        }
    }
    let done = answer_times(
        &mut wire(UsbTiming::default(), boards()),
        &four_requests(),
        22,
        9,
        us(106),
    );
    assert_eq!(done[2] - done[1], us(750));
}

/// Cut-through far end: a frame of four requests, 88 bytes of answers, the last one complete `bus`
/// after the first bit.
fn cut_through(bus: u64) -> Board {
    let mut board = Board::new(0);
    (board.request, board.response) = (40, 88);
    board.reaction = us(bus - 128 * 3);
    board
}

#[test]
fn frame_through_a_cut_through_far_end_takes_eight_microframes() {
    for bus in [388, 424, 450, 499, 500] {
        let mut wire = wire(UsbTiming::default(), vec![Box::new(cut_through(bus))]);
        let done = answer_times(&mut wire, &[[0; 40].to_vec()], 88, 20, us(0));
        for pair in done.windows(2) {
            assert_eq!(pair[1] - pair[0], us(1000), "{bus}");
        }
    }
    let mut wire = wire(UsbTiming::default(), vec![Box::new(cut_through(501))]);
    let done = answer_times(&mut wire, &[[0; 40].to_vec()], 88, 20, us(0));
    assert_eq!(done[9] - done[8], us(1125));
}

#[test]
fn drifting_frames_add_at_most_one_microframe() {
    let timing = UsbTiming {
        frame_offset: us(40),
        frame_rate_ppb: -30_000,
        ..UsbTiming::default()
    };
    // A host timer of 1 ms, not synchronised with the frames, does not reach 1 kHz; one of 2 ms
    // always reaches 500 Hz.
    let mut wire = wire(timing, vec![Box::new(cut_through(424))]);
    let mut worst = us(0);
    for cycle in 0..4000 {
        let start = at(2000 * cycle);
        wire.advance(start, &mut NoPlant).unwrap();
        wire.send(start, &[0; 40]);
        let mut read = Vec::new();
        advance_wire(&mut wire, start + us(1999), &[], &mut read);
        assert_eq!(read.iter().map(|(_, bytes)| bytes.len()).sum::<usize>(), 88);
        worst = worst.max(read.last().unwrap().0 - start);
    }
    assert!(us(1000) < worst && worst <= us(1150), "{worst}");
}

/// Board with an answer of `length` bytes.
fn board_answering(length: usize) -> Board {
    let mut board = Board::new(0);
    board.response = length;
    // The bus has no wake-up within a transmission.
    board.requires_attention = false;
    board
}

fn reads_of(timing: UsbTiming, length: usize) -> Vec<(SimTime, usize)> {
    let mut wire = wire(timing, vec![Box::new(board_answering(length))]);
    wire.send(SimTime::ZERO, &request(0));
    let mut read = Vec::new();
    advance_wire(&mut wire, at(60_000), &[], &mut read);
    read.into_iter()
        .map(|(now, bytes)| (now, bytes.len()))
        .collect()
}

#[test]
fn full_packet_is_returned_before_the_timer() {
    // Bus from 250 µs on, answer from 290 µs, 510 bytes complete at 1820 µs: prepared by microframe
    // 15, returned in 16, reported at 17.
    let read = reads_of(preset(UsbPreset::Default), 900);
    assert_eq!(read[0], (at(17 * 125 + 20), 510));
    // The rest is returned by the timer, which restarted in microframe 16.
    assert_eq!(read[1], (at((16 + 128 + 1) * 125 + 20), 390));
    // With one byte less the packet is not full.
    assert_eq!(
        reads_of(preset(UsbPreset::Default), 509),
        [(at((128 + 1) * 125 + 20), 509)]
    );
    // At full speed, packets carry 62 bytes, several of them in a frame.
    let read = reads_of(preset(UsbPreset::FullSpeed), 400);
    assert!(read.iter().any(|(_, count)| *count >= 62 * 2), "{read:?}");
    assert_eq!(read.iter().map(|(_, count)| count).sum::<usize>(), 400);
}

#[test]
fn long_answer_is_read_while_it_arrives() {
    let timing = UsbTiming {
        turnaround: us(0),
        ..preset(UsbPreset::Earliest)
    };
    // The answer begins at 165 µs. At 250 µs all complete bytes are read, and more are arriving.
    let expected = [(at(250), 28), (at(375), 42), (at(500), 30)];
    assert_eq!(reads_of(timing, 100), expected);
}

#[test]
fn packets_per_microframe_are_limited() {
    let timing = UsbTiming {
        payload: 10,
        packets_per_microframe: 2,
        ..UsbTiming::default()
    };
    let read = reads_of(timing, 600);
    assert!(read.iter().all(|(_, count)| *count <= 20), "{read:?}");
    assert!(read.windows(2).all(|pair| pair[1].0 - pair[0].0 == us(125)));
    assert_eq!(read.iter().map(|(_, count)| count).sum::<usize>(), 600);
}

#[test]
fn jitter_delays_completions_and_preserves_their_order() {
    let timing = UsbTiming {
        jitter: Timing::Uniform {
            min: us(0),
            max: us(400),
        },
        ..UsbTiming::default()
    };
    let (regular, jittered) = (
        reads_of(UsbTiming::default(), 900),
        reads_of(timing.clone(), 900),
    );
    let total = |reads: &[(SimTime, usize)]| reads.iter().map(|(_, count)| count).sum::<usize>();
    assert_eq!((total(&regular), total(&jittered)), (900, 900));
    assert!(
        jittered.len() < regular.len(),
        "late completions are read together"
    );
    assert!(jittered.windows(2).all(|pair| pair[0].0 < pair[1].0));
    let again = reads_of(timing, 900);
    assert_eq!(again, jittered);
}

/// Completion times, at a board, of requests written every 2 ms.
fn received_at(timing: UsbTiming, count: u64) -> Vec<SimTime> {
    let (sent, far) = std::sync::mpsc::channel();
    let line = ScriptedLine {
        arrivals_due: Vec::new(),
        arrived: 0,
        taken: 0,
        now: SimTime::ZERO,
        sent,
    };
    let mut wire = UsbSerial::new("sbcp", timing, BYTE, 1, line).unwrap();
    for n in 0..count {
        wire.advance(at(2_000 * n), &mut NoPlant).unwrap();
        wire.send(at(2_000 * n), &request(0));
    }
    let last = far.try_iter().map(|(at, _)| at);
    last.skip(9).step_by(10).collect()
}

#[test]
fn write_jitter_delays_writes_and_preserves_their_order() {
    let with = |write_jitter, jitter, out| UsbTiming {
        write_jitter,
        jitter,
        out,
        ..UsbTiming::default()
    };
    let uniform = |max| Timing::Uniform {
        min: us(0),
        max: us(max),
    };
    let (next, none) = (OutRule::EndOfNext, Timing::ZERO);
    let regular = received_at(with(none.clone(), none.clone(), next), 500);
    assert!(
        regular
            .iter()
            .zip(0..)
            .all(|(received, n)| *received == at(2_000 * n + 280))
    );
    // Jitter of completions delays no write; write jitter within the microframe moves none.
    assert_eq!(
        received_at(with(none.clone(), uniform(400), next), 500),
        regular
    );
    assert_eq!(
        received_at(with(uniform(124), none.clone(), next), 500),
        regular
    );
    // With a jitter of 0 to 300 µs, writes fall into three microframes.
    let jittered = received_at(with(uniform(300), none.clone(), next), 500);
    for late in [0, 125, 250] {
        let count = jittered
            .iter()
            .zip(&regular)
            .filter(|(received, regular)| **received == **regular + us(late))
            .count();
        assert!(count > 50, "{count} late by {late} µs");
    }
    // Writes queue behind the previous one: always in order, none lost.
    let queued = received_at(with(uniform(6_000), none.clone(), OutRule::AtOnce), 500);
    assert_eq!(queued.len(), 500);
    assert!(queued.is_sorted());
    assert!(queued.windows(2).any(|pair| pair[1] - pair[0] == us(30)));
}

#[test]
fn jitters_are_drawn_from_separate_streams() {
    let uniform = || Timing::Uniform {
        min: us(0),
        max: us(400),
    };
    let with = |write_jitter| UsbTiming {
        write_jitter,
        jitter: uniform(),
        ..UsbTiming::default()
    };
    // A write jitter without effect leaves the completions unchanged.
    let within = Timing::Uniform {
        min: us(0),
        max: us(100),
    };
    assert_eq!(
        reads_of(with(within), 900),
        reads_of(with(Timing::ZERO), 900)
    );
}

#[test]
fn invalid_timings_are_refused() {
    let bus = || Rs485::new("sbcp", BYTE, us(2), boards()).unwrap();
    let refused = |timing, byte| {
        UsbSerial::new("sbcp", timing, byte, 1, bus())
            .err()
            .map(|e| e.to_string())
    };
    let zero = UsbTiming {
        microframe: us(0),
        ..UsbTiming::default()
    };
    assert_eq!(
        refused(zero, BYTE).unwrap(),
        "the microframe of sbcp must be longer than zero"
    );
    assert_eq!(
        refused(UsbTiming::default(), us(0)).unwrap(),
        "the byte time of sbcp must be longer than zero"
    );
    let empty = UsbTiming {
        jitter: Timing::Trace(Vec::new()),
        ..UsbTiming::default()
    };
    assert_eq!(
        refused(empty, BYTE).unwrap(),
        "jitter of sbcp: the recorded trace is empty"
    );
    let backwards = UsbTiming {
        write_jitter: Timing::Uniform {
            min: us(2),
            max: us(1),
        },
        ..UsbTiming::default()
    };
    assert!(
        refused(backwards, BYTE)
            .unwrap()
            .starts_with("write jitter of sbcp: no time lies")
    );
    assert_eq!(
        "fastest".parse::<UsbPreset>().unwrap_err().to_string(),
        "unknown USB timing \"fastest\"; available: thesis, earliest, low-latency, default, full-speed, \
         ft232r, ft232r-pi3, ch340, atmega16u2, uart"
    );
}

/// Reads of the host if the last bytes of a request are written one by one at the times `writes`
/// after `begin`, limited to the time for which the UART is busy.
fn reads_of_split_write(writes: &[u64], begin: SimTime) -> Vec<(SimTime, Vec<u8>)> {
    let mut wire = wire(UsbTiming::default(), boards());
    let request = request(1);
    let mut now = begin;
    wire.advance(now, &mut NoPlant).unwrap();
    wire.send(now, &request[..request.len() - writes.len()]);
    let rest = request.len() - writes.len()..request.len();
    for (n, after) in rest.zip(writes) {
        let busy = wire.transmit_buffer().unwrap().idle_from;
        let then = (begin + us(*after)).clamp(now, busy);
        while let Some(wake) = wire.next_wake().filter(|wake| *wake < then) {
            wire.advance(wake, &mut NoPlant).unwrap();
        }
        now = then;
        wire.advance(now, &mut NoPlant).unwrap();
        wire.send_contiguous(now, &request[n..=n]);
    }
    let mut read = Vec::new();
    while let Some(wake) = wire.next_wake().filter(|wake| *wake < begin + us(5_000)) {
        wire.advance(wake, &mut NoPlant).unwrap();
        let mut bytes = Vec::new();
        wire.receive(&mut bytes);
        if !bytes.is_empty() {
            read.push((wake, bytes));
        }
    }
    read
}

proptest! {
    #[test]
    fn bytes_written_while_the_uart_is_busy_continue_the_transmission(
        begin in 0_u64..1_000, mut writes in proptest::collection::vec(0_u64..400, 1..9),
    ) {
        writes.sort_unstable();
        let begin = SimTime::ZERO + us(begin);
        let at_once = reads_of_split_write(&[], begin);
        prop_assert!(at_once.iter().map(|(_, bytes)| bytes.len()).sum::<usize>() == 22);
        prop_assert_eq!(reads_of_split_write(&writes, begin), at_once);
    }

    #[test]
    fn transmit_buffer_room_is_4096_bytes_less_the_unsent(
        writes in proptest::collection::vec((0_u64..20_000, 1_usize..3_000), 1..9), later in 0_u64..40_000,
    ) {
        let mut wire = wire(UsbTiming::default(), boards());
        let (mut now, mut idle) = (SimTime::ZERO, SimTime::ZERO);
        for (pause, count) in writes {
            now += us(pause);
            wire.send(now, &vec![0; count]);
            // From the end of the next microframe on, unless other bytes are still being
            // transmitted.
            let frame = us(125).as_nanos();
            let in_chip = SimTime::from_nanos((now.as_nanos() / frame + 2) * frame);
            idle = in_chip.max(idle) + BYTE * count as u64;
            let unsent = usize::try_from((idle - now).as_nanos().div_ceil(BYTE.as_nanos())).unwrap();
            prop_assert_eq!(wire.transmit_buffer().unwrap().room(now), 4_096_usize.saturating_sub(unsent));
        }
        let then = now + us(later);
        if then >= idle {
            prop_assert_eq!(wire.transmit_buffer().unwrap().room(then), 4_096);
        }
    }
}
