//! Each fault has its specified effect, independently of when the line is advanced.

use crate::support::*;
use proptest::prelude::*;
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime, Snapshot};
use twinrig_runtime::{Part, TaskError};
use twinrig_wire::{
    Arrivals, DriverPhase, Fault, FaultDirection, FaultKind, FaultSchedule, FaultSelection, Faulty,
    FaultyNode, FrameChoice, FrameCount, FrameMatch, FrameReader, Line, Node, Piece, Rs485,
    UsbSerial, UsbTiming,
};

/// Frames of three bytes, of which the first is even; its remainder by 4 is the kind.
pub const FRAMES: FrameReader = FrameReader {
    match_frame: |front| match front {
        [] => FrameMatch::Missing(3),
        [first, rest @ ..] if first % 2 == 0 => match rest.len() {
            0 | 1 => FrameMatch::Missing(2 - rest.len()),
            _ => FrameMatch::Frame(3),
        },
        _ => FrameMatch::Garbage,
    },
    code: |frame| Some(frame[0] % 4),
    kinds: &[("ping", 0), ("set", 2)],
};

pub type Timed = Vec<(SimTime, u8)>;

pub const PLACE: &str = "wire/sbcp";

pub fn fault(from: u64, lasts: u64, kind: FaultKind) -> Fault {
    Fault {
        at: at(from),
        on: PLACE.to_owned(),
        kind,
        lasts: us(lasts),
        select: FaultSelection::default(),
    }
}

pub fn schedule(faults: Vec<Fault>) -> FaultSchedule {
    FaultSchedule { faults, seed: 1 }
}

/// Faulty line with the bytes received at its far end and at its near end.
pub struct Harness {
    pub line: Faulty<ScriptedLine>,
    far: std::sync::mpsc::Receiver<(SimTime, u8)>,
    near: Arrivals,
}

impl Harness {
    pub fn new(schedule: &FaultSchedule, arrivals_due: &Bursts) -> Self {
        let (sent, far) = std::sync::mpsc::channel();
        let line = ScriptedLine {
            arrivals_due: timed(arrivals_due),
            arrived: 0,
            taken: 0,
            now: SimTime::ZERO,
            sent,
        };
        let line = Faulty::framed(PLACE, BYTE, schedule, Some(FRAMES), line).unwrap();
        Self {
            line,
            far,
            near: Arrivals::default(),
        }
    }

    /// Sends bursts, each at the start of its first byte.
    pub fn advance_to(
        &mut self,
        sends: &Bursts,
        from: SimTime,
        end: SimTime,
        extra_times: &[SimTime],
    ) {
        let mut extra_times = extra_times.to_vec();
        extra_times.retain(|at| *at > from && *at < end);
        let mut free = SimTime::ZERO;
        for (gap, bytes) in sends {
            free += SimDuration::from_nanos(*gap);
            let start = free;
            free += BYTE * bytes.len() as u64;
            if start <= from && from > SimTime::ZERO {
                continue;
            }
            if start > end {
                break;
            }
            let later = extra_times.split_off(extra_times.partition_point(|at| *at <= start));
            advance_line(&mut self.line, start, &extra_times, &mut self.near);
            extra_times = later;
            let first = start + BYTE;
            let spacing = BYTE;
            self.line.send(Piece {
                first,
                spacing,
                bytes,
                framing_error: false,
            });
        }
        extra_times.push(end);
        advance_line(&mut self.line, end, &extra_times, &mut self.near);
    }

    pub fn far(&self) -> Timed {
        self.far.try_iter().collect()
    }

    pub fn near(&self) -> Timed {
        self.near.iter().collect()
    }
}

pub const END: u64 = 3_000;

/// Returns the bytes received at the far end and at the near end.
pub fn run(faults: Vec<Fault>, bursts: &Bursts) -> (Timed, Timed) {
    let mut harness = Harness::new(&schedule(faults), bursts);
    harness.advance_to(bursts, SimTime::ZERO, at(END), &[]);
    (harness.far(), harness.near())
}

fn three() -> Bursts {
    vec![
        (0, b"one".to_vec()),
        (50_000, b"two".to_vec()),
        (50_000, b"three".to_vec()),
    ]
}

pub fn text(timed: &Timed) -> String {
    timed.iter().map(|(_, byte)| char::from(*byte)).collect()
}

/// Asserts that both directions receive `expected`.
fn assert_both(faults: Vec<Fault>, expected: &str) -> (Timed, Timed) {
    let (far, near) = run(faults, &three());
    assert_eq!(
        (text(&far).as_str(), text(&near).as_str()),
        (expected, expected)
    );
    (far, near)
}

#[test]
fn burst_is_dropped_if_it_begins_within_the_fault() {
    let drop = |from, lasts| vec![fault(from, lasts, FaultKind::Drop { probability: 1.0 })];
    // The second burst's bytes are complete at 62, 65 and 68 µs.
    assert_both(drop(62, 1), "onethree");
    assert_both(drop(61, 1), "onetwothree");
    assert_both(drop(63, 30), "onetwothree");
    assert_both(drop(0, 1000), "");
    let never = FaultKind::Drop { probability: 0.0 };
    assert_both(vec![fault(0, 1000, never)], "onetwothree");
}

#[test]
fn single_bytes_are_lost_while_the_line_is_unplugged() {
    let (far, _) = assert_both(
        vec![fault(63, 3, FaultKind::Unplug { fails: false })],
        "onetothree",
    );
    assert_eq!(far[4], (at(68), b'o'));
}

#[test]
fn unplugged_line_ends_the_run_if_configured() {
    let schedule = schedule(vec![fault(60, 1, FaultKind::Unplug { fails: true })]);
    let mut line = Harness::new(&schedule, &vec![]).line;
    assert_eq!(line.next_wake(), Some(at(60)));
    line.advance(at(59), &mut NoPlant).unwrap();
    let error = line.advance(at(60), &mut NoPlant).unwrap_err();
    assert_eq!(
        error,
        TaskError::Device {
            why: "wire/sbcp is unplugged".to_owned()
        }
    );
}

#[test]
fn delayed_burst_keeps_its_order() {
    let (far, near) = assert_both(
        vec![fault(62, 1, FaultKind::Delay { by: us(10) })],
        "onetwothree",
    );
    assert_eq!(
        far[3..7],
        [
            (at(72), b't'),
            (at(75), b'w'),
            (at(78), b'o'),
            (at(121), b't')
        ]
    );
    assert_eq!(near, far);
    let (far, _) = assert_both(
        vec![fault(62, 1, FaultKind::Delay { by: us(100) })],
        "onetwothree",
    );
    assert_eq!(
        far[5..8],
        [(at(168), b'o'), (at(171), b't'), (at(174), b'h')]
    );
}

#[test]
fn wake_ups_of_a_delayed_burst_are_its_first_and_last_byte() {
    let delay = fault(62, 1, FaultKind::Delay { by: us(40) });
    let mut harness = Harness::new(&schedule(vec![delay]), &three());
    advance_line(&mut harness.line, at(68), &[], &mut harness.near);
    for expected in [102, 108, 121] {
        assert_eq!(harness.line.next_wake(), Some(at(expected)));
        advance_line(&mut harness.line, at(expected), &[], &mut harness.near);
    }
}

#[test]
fn node_behind_a_faulty_stub_is_woken_at_its_attention() {
    let delay = fault(0, 100, FaultKind::Delay { by: us(100) });
    let mut node = FaultyNode::new(PLACE, BYTE, &schedule(vec![delay]), Board::new(1)).unwrap();
    let bytes = &[request(1), request(2)].concat();
    node.receive(Piece {
        first: at(3),
        spacing: BYTE,
        bytes,
        framing_error: false,
    });
    // The first byte, the end of the first packet, the last byte.
    for wake in [103, 130, 160] {
        node.advance(at(wake - 1), &mut NoPlant).unwrap();
        assert_eq!(node.next_wake(), Some(at(wake)));
        node.advance(at(wake), &mut NoPlant).unwrap();
    }
    assert_eq!(node.poll_transmit(&mut Vec::new()), Some(at(140)));
}

#[test]
fn overlapping_answers_of_a_node_are_queued() {
    let new = || FaultyNode::new(PLACE, BYTE, &schedule(vec![]), Board::new(1)).unwrap();
    let receive = |node: &mut FaultyNode<Board>, first| {
        let piece = Piece {
            first: at(first),
            spacing: BYTE,
            bytes: &request(1),
            framing_error: false,
        };
        node.receive(piece);
        node.advance(piece.last(), &mut NoPlant).unwrap();
    };
    let (mut node, mut restored, mut tx) = (new(), new(), Vec::new());
    receive(&mut node, 3);
    assert_eq!(node.poll_transmit(&mut tx), Some(at(40)));
    restored.restore(&node.save()).unwrap();
    receive(&mut restored, 33);
    // Not at 70 µs: the first answer takes 66 µs.
    assert_eq!(restored.poll_transmit(&mut tx), Some(at(106)));
    assert_eq!((restored.poll_transmit(&mut tx), tx.len()), (None, 44));
}

#[test]
fn duplicate_follows_the_burst() {
    let (far, _) = assert_both(
        vec![fault(62, 1, FaultKind::Duplicate { probability: 1.0 })],
        "onetwotwothree",
    );
    assert_eq!(far[6..9], [(at(77), b't'), (at(80), b'w'), (at(83), b'o')]);
}

#[test]
fn reordered_bursts_swap_places() {
    let reorder = |from, lasts| vec![fault(from, lasts, FaultKind::Reorder { probability: 1.0 })];
    assert_both(reorder(0, 1000), "twoonethree");
    assert_both(reorder(62, 1), "onetwothree");
    let (far, _) = assert_both(reorder(62, 100), "onethreetwo");
    assert_eq!(far[8].0, at(121 + 4 * 3 + 6 + 3));
    // Without a next burst, the burst is held until the end of the fault.
    let (far, _) = assert_both(reorder(121, 500), "onetwothree");
    assert_eq!(far[6].0, at(621 + 3));
}

#[test]
fn stuck_line_delivers_only_zeros() {
    let (far, near) = run(vec![fault(30, 399, FaultKind::Stuck)], &three());
    assert_eq!(far, near);
    assert_eq!(text(&far)[..3], *"one");
    // One more byte would be complete at the end of the fault.
    let zeros: Timed = (1..=132).map(|n| (at(30 + 3 * n), 0)).collect();
    assert_eq!(far[3..], zeros);
}

#[test]
fn babble_has_pauses_and_fills_the_line_without_them() {
    let babble = vec![fault(0, 2_900, FaultKind::Babble { pause: us(100) })];
    let (far, near) = run(babble, &three());
    assert!(far != near && far.len() > 200, "{}", far.len());
    let pauses = far
        .windows(2)
        .filter(|pair| pair[1].0 - pair[0].0 > BYTE)
        .count();
    assert!(pauses > 5, "{pauses}");
    let (continuous, _) = run(
        vec![fault(0, 2_900, FaultKind::Babble { pause: us(0) })],
        &three(),
    );
    assert_eq!(continuous.len(), 966);
}

/// Line with 900 bytes in each direction and a bit error rate of 1/10.
fn flipping() -> (Bursts, Harness) {
    let long: Bursts = vec![(0, vec![0x5A; 900])];
    let flip = fault(0, END, FaultKind::Flip { rate: 0.1 });
    let harness = Harness::new(&schedule(vec![flip]), &long);
    (long, harness)
}

fn framing_errors(arrivals: &Arrivals) -> usize {
    let wrong = arrivals.pieces().filter(|piece| piece.framing_error);
    wrong.map(|piece| piece.bytes.len()).sum()
}

#[test]
fn bits_flip_at_the_given_rate_including_start_and_stop_bits() {
    let (long, mut harness) = flipping();
    harness.advance_to(&long, SimTime::ZERO, at(END), &[]);
    let (far, near) = (harness.far(), harness.near());
    for received in [&far, &near] {
        // One byte in ten loses its start bit; in the others each bit is wrong with the same
        // probability.
        let lost = 900 - received.len();
        assert!((55..130).contains(&lost), "{lost}");
        let flipped: u32 = received
            .iter()
            .map(|(_, byte)| (byte ^ 0x5A).count_ones())
            .sum();
        assert!((530..770).contains(&flipped), "{flipped}");
        let times: Vec<SimTime> = timed(&long).iter().map(|(at, _)| *at).collect();
        assert!(received.iter().all(|(at, _)| times.contains(at)));
    }
    assert_ne!(far, near);
    let wrong = framing_errors(&harness.near);
    assert!((45..125).contains(&wrong), "{wrong}");
}

#[test]
fn converter_delivers_and_counts_bytes_with_framing_errors() {
    let (_, mut direct) = flipping();
    advance_line(&mut direct.line, at(END), &[], &mut direct.near);
    let (_, behind) = flipping();
    let mut wire = UsbSerial::new("sbcp", UsbTiming::default(), BYTE, 1, behind.line).unwrap();
    let mut read = Vec::new();
    advance_wire(&mut wire, at(END + 1_000), &[], &mut read);
    let read: Vec<u8> = read.into_iter().flat_map(|(_, bytes)| bytes).collect();
    assert_eq!(read, direct.near.bytes());
    let diagnostics = wire.diagnostics();
    let place = diagnostics
        .iter()
        .position(|diagnostic| diagnostic.name == "sbcp/usb/framing_errors");
    let mut values = vec![0.0; diagnostics.len()];
    wire.read_diagnostics(at(END), &mut values);
    assert_eq!(values[place.unwrap()], framing_errors(&direct.near) as f64);
    assert!(values[place.unwrap()] > 0.0);
}

#[test]
fn harmed_bytes_are_counted() {
    let mut harness = Harness::new(
        &schedule(vec![fault(62, 1, FaultKind::Drop { probability: 1.0 })]),
        &three(),
    );
    harness.advance_to(&three(), SimTime::ZERO, at(END), &[]);
    assert_eq!(
        Layout::of(&harness.line.diagnostics(), Direction::Output).find("wire/sbcp/harmed"),
        Some(0..1)
    );
    let mut harmed = [0.0];
    harness.line.read_diagnostics(at(END), &mut harmed);
    assert_eq!(harmed, [6.0]);
}

#[test]
fn fault_on_one_stub_does_not_affect_the_others() {
    let stub = |from, lasts, kind| {
        let mut fault = fault(from, lasts, kind);
        fault.on = "wire/sbcp/1".to_owned();
        schedule(vec![fault])
    };
    let answers = |schedule: &FaultSchedule| {
        let nodes = (0..4).map(|n| {
            let place = format!("wire/sbcp/{n}");
            Box::new(FaultyNode::new(&place, BYTE, schedule, Board::new(n)).unwrap())
                as Box<dyn Node>
        });
        let mut bus = Rs485::new("sbcp", BYTE, us(2), nodes.collect()).unwrap();
        for (n, board) in [0, 1, 2, 3].into_iter().enumerate() {
            bus.send(Piece {
                first: at(3 + 200 * n as u64),
                spacing: BYTE,
                bytes: &request(board),
                framing_error: false,
            });
        }
        let mut near = Arrivals::default();
        advance_line(&mut bus, at(1000), &[], &mut near);
        let mut counts = [0; 4];
        for (at, _) in near.iter() {
            counts[usize::try_from(at.as_nanos() / 200_000).unwrap().min(3)] += 1;
        }
        counts
    };
    assert_eq!(answers(&schedule(vec![])), [22; 4]);
    let always = 1000;
    assert_eq!(
        answers(&stub(0, always, FaultKind::Drop { probability: 1.0 })),
        [22, 0, 22, 22]
    );
    assert_eq!(
        answers(&stub(0, always, FaultKind::Unplug { fails: true })),
        [22, 0, 22, 22]
    );
    // The node's transmissions are duplicated, and so are the requests to it, which it answers
    // twice.
    assert!(answers(&stub(200, 200, FaultKind::Duplicate { probability: 1.0 }))[1] > 22);
    // A transceiver that holds the wires low blocks all stations.
    assert!(
        answers(&stub(0, always, FaultKind::Stuck))
            .iter()
            .all(|count| *count > 40)
    );
    assert_ne!(
        answers(&stub(0, always, FaultKind::Babble { pause: us(50) })),
        [22; 4]
    );
}

#[test]
fn invalid_faults_are_refused() {
    let schedule = schedule(vec![fault(0, 1, FaultKind::Drop { probability: 1.5 })]);
    let error = FaultyNode::new(PLACE, BYTE, &schedule, Board::new(0))
        .err()
        .unwrap();
    assert_eq!(
        error.to_string(),
        "probability of a fault on wire/sbcp is 1.5, not between 0 and 1"
    );
    // A fault at another place is not checked here.
    assert!(FaultyNode::new("wire/other", BYTE, &schedule, Board::new(0)).is_ok());
}

#[test]
fn schedule_is_displayed_in_scenario_syntax() {
    let schedule = schedule(vec![
        fault(
            1_500,
            20_000,
            FaultKind::Babble {
                pause: SimDuration::from_nanos(1_500),
            },
        ),
        fault(0, 3_000_000, FaultKind::Unplug { fails: true }),
        fault(0, 1, FaultKind::Flip { rate: 1e-3 }),
    ]);
    let printed = "[[fault]]\nat = \"1500 us\"\non = \"wire/sbcp\"\nkind = \"babble\"\npause = \"1500 ns\"\nfor = \"20 ms\"\n\n\
        [[fault]]\nat = \"0 s\"\non = \"wire/sbcp\"\nkind = \"unplug\"\nfails = true\nfor = \"3 s\"\n\n\
        [[fault]]\nat = \"0 s\"\non = \"wire/sbcp\"\nkind = \"flip\"\nrate = 0.001\nfor = \"1 us\"\n";
    assert_eq!(schedule.to_string(), printed);
    assert_eq!(
        Snapshot::of(&schedule).read::<FaultSchedule>().unwrap(),
        schedule
    );
}

fn kind() -> impl Strategy<Value = FaultKind> {
    let probability = prop_oneof![Just(1.0), 0.0..1.0];
    prop_oneof![
        probability
            .clone()
            .prop_map(|probability| FaultKind::Drop { probability }),
        (0.0..0.2).prop_map(|rate| FaultKind::Flip { rate }),
        (0_u64..100_000).prop_map(|ns| FaultKind::Delay {
            by: SimDuration::from_nanos(ns)
        }),
        probability
            .clone()
            .prop_map(|probability| FaultKind::Duplicate { probability }),
        probability.prop_map(|probability| FaultKind::Reorder { probability }),
        Just(FaultKind::Unplug { fails: false }),
        Just(FaultKind::Stuck),
        (0_u64..100_000).prop_map(|ns| FaultKind::Babble {
            pause: SimDuration::from_nanos(ns)
        }),
    ]
}

fn any_schedule() -> impl Strategy<Value = FaultSchedule> {
    let count = prop_oneof![
        Just(FrameCount::All),
        (1_u64..5).prop_map(FrameCount::Nth),
        (1_u64..4).prop_map(FrameCount::Every),
    ];
    let after = prop_oneof![Just(None), Just(Some("ping".to_owned()))];
    let frames = (count, after).prop_map(|(count, after)| FrameChoice { after, count });
    let phase = prop_oneof![Just(None), Just(Some(DriverPhase::Opening))];
    let direction = prop_oneof![Just(FaultDirection::Out), Just(FaultDirection::In)];
    let frames = (prop::option::of(frames), phase);
    let select = (prop::option::of(direction), frames, kind());
    let select = select.prop_map(|(direction, (frames, phase), kind)| {
        let (frames, phase) = if kind.selects() {
            (frames, phase)
        } else {
            (None, None)
        };
        (
            FaultSelection {
                direction,
                phase,
                frames,
            },
            kind,
        )
    });
    let fault = (0_u64..400_000, 0_u64..300_000, select);
    let fault = fault.prop_map(|(from, lasts, (select, kind))| Fault {
        at: SimTime::from_nanos(from),
        on: PLACE.to_owned(),
        kind,
        lasts: SimDuration::from_nanos(lasts),
        select,
    });
    (prop::collection::vec(fault, 0..4), any::<u64>())
        .prop_map(|(faults, seed)| FaultSchedule { faults, seed })
}

fn instants() -> impl Strategy<Value = Vec<SimTime>> {
    prop::collection::btree_set(0_u64..600_000, 0..60)
        .prop_map(|set| set.into_iter().map(SimTime::from_nanos).collect())
}

proptest! {
    #[test]
    fn faulty_line_is_independent_of_poll_times(
        schedule in any_schedule(), outward in bursts(11), inward in bursts(11), extra_times in instants(),
    ) {
        let run_with = |extra_times: &[SimTime]| {
            let mut harness = Harness::new(&schedule, &inward);
            harness.advance_to(&outward, SimTime::ZERO, at(END), extra_times);
            (harness.far(), harness.near())
        };
        let (far, near) = run_with(&[]);
        for direction in [&far, &near] {
            prop_assert!(direction.windows(2).all(|pair| pair[0].0 < pair[1].0), "{direction:?}\n{schedule}");
        }
        prop_assert_eq!(run_with(&extra_times), (far, near), "{}", schedule);
    }

    #[test]
    fn faulty_line_is_independent_of_announcement_times(
        schedule in any_schedule(), outward in bursts(11), lead in prop::collection::vec(0_u64..200_000, 8),
    ) {
        let mut punctual = Harness::new(&schedule, &vec![]);
        punctual.advance_to(&outward, SimTime::ZERO, at(END), &[]);
        let mut announced = Harness::new(&schedule, &vec![]);
        let (mut now, mut free) = (SimTime::ZERO, SimTime::ZERO);
        for ((gap, bytes), lead) in outward.iter().zip(lead) {
            let start = free + SimDuration::from_nanos(*gap);
            now = now.max(SimTime::from_nanos(start.as_nanos().saturating_sub(lead)));
            advance_line(&mut announced.line, now, &[], &mut announced.near);
            announced.line.send(Piece { first: start + BYTE, spacing: BYTE, bytes, framing_error: false });
            free = start + BYTE * bytes.len() as u64;
        }
        advance_line(&mut announced.line, at(END), &[], &mut announced.near);
        prop_assert_eq!(announced.far(), punctual.far(), "{}", schedule);
    }

    #[test]
    fn restored_faulty_line_continues_bit_for_bit(
        schedule in any_schedule(), outward in bursts(11), inward in bursts(11), saved_at in 1_u64..500_000,
    ) {
        let saved_at = SimTime::from_nanos(saved_at);
        let mut uninterrupted = Harness::new(&schedule, &inward);
        uninterrupted.advance_to(&outward, SimTime::ZERO, at(END), &[]);
        let mut first = Harness::new(&schedule, &inward);
        first.advance_to(&outward, SimTime::ZERO, saved_at, &[]);
        let mut second = Harness::new(&schedule, &inward);
        second.line.restore(&first.line.save()).unwrap();
        prop_assert_eq!(second.line.save(), first.line.save());
        second.advance_to(&outward, saved_at, at(END), &[]);
        prop_assert_eq!([first.far(), second.far()].concat(), uninterrupted.far(), "{}", schedule);
        prop_assert_eq!([first.near(), second.near()].concat(), uninterrupted.near(), "{}", schedule);
    }

    #[test]
    fn bytes_outside_the_time_of_a_fault_are_unchanged(inward in bursts(11), outward in bursts(11), kind in kind()) {
        let all = schedule(vec![fault(2_000, 500, kind)]);
        let mut harness = Harness::new(&all, &inward);
        harness.advance_to(&outward, SimTime::ZERO, at(1_999), &[]);
        prop_assert_eq!(harness.far(), timed(&outward));
        prop_assert_eq!(harness.near(), timed(&inward));
    }
}

/// Bus of boards with faults on one stub.
fn bus(schedule: &FaultSchedule) -> Rs485 {
    let nodes = (0..3).map(|n| {
        let place = if n == 1 { PLACE } else { "wire/other" };
        Box::new(FaultyNode::framed(place, BYTE, schedule, Some(FRAMES), Board::new(n)).unwrap())
            as Box<dyn Node>
    });
    Rs485::new("sbcp", BYTE, us(2), nodes.collect()).unwrap()
}

proptest! {
    #[test]
    fn bus_with_a_faulty_stub_is_independent_of_poll_times_and_restorable(
        schedule in any_schedule(), requests in prop::collection::vec((0_u8..3, 0_u64..200), 1..7), extra_times in instants(), saved_at in 0_u64..600,
    ) {
        let start = || {
            let (mut bus, mut first) = (bus(&schedule), at(3));
            for (board, gap) in &requests {
                bus.send(Piece { first, spacing: BYTE, bytes: &request(*board), framing_error: false });
                first += us(30 + gap);
            }
            bus
        };
        let run_with = |mut bus: Rs485, extra_times: &[SimTime], mut near: Arrivals| {
            advance_line(&mut bus, at(END), extra_times, &mut near);
            (near.iter().collect::<Timed>(), bus.save())
        };
        let (expected, end) = run_with(start(), &[], Arrivals::default());
        prop_assert_eq!(run_with(start(), &extra_times, Arrivals::default()).0, expected.clone(), "{}", schedule);
        let mut first = start();
        let mut near = Arrivals::default();
        advance_line(&mut first, at(saved_at), &[], &mut near);
        let mut second = bus(&schedule);
        second.restore(&first.save()).unwrap();
        prop_assert_eq!(run_with(second, &[], near), (expected, end), "{}", schedule);
    }
}
