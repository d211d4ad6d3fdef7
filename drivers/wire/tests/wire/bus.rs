//! Half-duplex bus: reception by each station, and collisions.

use crate::support::*;
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, TaskError};
use twinrig_wire::{Arrivals, Line, Node, Piece, Rs485};

/// Transmits at scripted times and forwards all received bytes.
struct ScriptedNode {
    transmissions: Vec<(SimTime, Vec<u8>)>,
    sent: usize,
    received: std::sync::mpsc::Sender<(SimTime, u8)>,
}

impl Part for ScriptedNode {
    fn save(&self) -> Snapshot {
        Snapshot::of(&self.sent)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.sent = snapshot.read()?;
        Ok(())
    }
}

impl Node for ScriptedNode {
    fn name(&self) -> &'static str {
        "actor"
    }

    fn receive(&mut self, piece: Piece<'_>) {
        for (n, byte) in piece.bytes.iter().enumerate() {
            self.received.send((piece.at(n), *byte)).unwrap();
        }
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.transmissions.get(self.sent).map(|(start, _)| *start)
    }

    fn advance(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        assert!(self.next_wake().is_none_or(|wake| wake >= now), "too late");
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        // Announced before its start, as an answer to received bytes would be.
        let (start, tx) = self.transmissions.get(self.sent)?;
        bytes.extend_from_slice(tx);
        self.sent += 1;
        Some(*start)
    }
}

type Received = Vec<(SimTime, u8)>;

/// Scripted transmissions with their start times: of the near end, then of each node.
type Script = Vec<Vec<(SimTime, Vec<u8>)>>;

const TURNAROUND: SimDuration = SimDuration::from_micros(2);

/// Returns the bytes received by the near end and by each node.
fn run(script: &Script, extra_times: &[SimTime]) -> Vec<Received> {
    let mut receivers = Vec::new();
    let mut nodes: Vec<Box<dyn Node>> = Vec::new();
    for transmissions in &script[1..] {
        let (received, receiver) = std::sync::mpsc::channel();
        receivers.push(receiver);
        nodes.push(Box::new(ScriptedNode {
            transmissions: transmissions.clone(),
            sent: 0,
            received,
        }));
    }
    let mut bus = Rs485::new("bus", BYTE, TURNAROUND, nodes).unwrap();
    for (start, bytes) in &script[0] {
        bus.send(Piece {
            first: *start + BYTE,
            spacing: BYTE,
            bytes,
            framing_error: false,
        });
    }
    let mut near = Arrivals::default();
    advance_line(&mut bus, SimTime::MAX, extra_times, &mut near);
    let nodes = receivers
        .iter()
        .map(|receiver| receiver.try_iter().collect());
    std::iter::once(near.iter().collect())
        .chain(nodes)
        .collect()
}

fn bytes(received: &Received) -> Vec<u8> {
    received.iter().map(|(_, byte)| *byte).collect()
}

#[test]
fn all_others_receive_the_near_end_and_no_station_itself() {
    let script = vec![
        vec![(at(10), b"ask".to_vec())],
        vec![(at(30), b"answer".to_vec())],
        vec![],
    ];
    let received = run(&script, &[]);
    assert_eq!(bytes(&received[0]), b"answer");
    assert_eq!(bytes(&received[1]), b"ask");
    assert_eq!(bytes(&received[2]), b"askanswer");
    assert_eq!(received[2][3], (at(33), b'a'));
    assert_eq!(received[2][8], (at(48), b'r'));
}

#[test]
fn only_overlapping_bytes_are_garbled() {
    // The second transmission overlaps the first one's third byte by two thirds.
    let first = (at(0), vec![0xFF, 0xFF, 0xFF, 0xFF, 0xFF]);
    let second = (at(7), vec![0xFF, 0xFF, 0xFF, 0xFF]);
    let received = run(&vec![vec![], vec![first], vec![second], vec![]], &[]);
    // Two intact bytes; a start bit in bit 2 of the third and of those that follow; then an intact
    // one: the second transmission's last byte begins while the receiver still samples the first
    // one's last.
    assert_eq!(
        received[3],
        [
            (at(3), 0xFF),
            (at(6), 0xFF),
            (at(9), 0xFB),
            (at(12), 0xFB),
            (at(15), 0xFB),
            (at(19), 0xFF)
        ]
    );
    assert_eq!(received[0], received[3]);
    // A station receives the bytes that begin after its transmission.
    assert_eq!(received[1], [(at(19), 0xFF)]);
    assert_eq!(received[2], [(at(3), 0xFF), (at(6), 0xFF)]);
}

#[test]
fn simultaneous_equal_bytes_are_received_unchanged() {
    let same = (at(5), b"me".to_vec());
    let received = run(&vec![vec![], vec![same.clone()], vec![same], vec![]], &[]);
    assert_eq!(bytes(&received[3]), b"me");
    let received = run(
        &vec![vec![], vec![(at(5), vec![0xA5])], vec![(at(5), vec![0x3C])]],
        &[],
    );
    assert_eq!(bytes(&received[0]), [0xA5 & 0x3C]);
}

#[test]
fn near_end_receives_nothing_during_its_turnaround() {
    let request = (at(0), b"ask".to_vec());
    for (start, expected) in [(9, &b"nswer"[..]), (10, b"nswer"), (11, b"answer")] {
        let script = vec![
            vec![request.clone()],
            vec![(at(start), b"answer".to_vec())],
            vec![],
        ];
        let received = run(&script, &[]);
        assert_eq!(bytes(&received[0]), expected, "{start}");
        assert_eq!(bytes(&received[2]), b"askanswer");
    }
}

fn script() -> impl Strategy<Value = Script> {
    let transmission = (0_u64..400, prop::collection::vec(any::<u8>(), 1..9));
    let station = prop::collection::vec(transmission, 0..5).prop_map(|transmissions| {
        let mut free = SimTime::ZERO;
        let transmission = |(gap, bytes): (u64, Vec<u8>)| {
            let start = free + SimDuration::from_nanos(gap * 100);
            free = start + BYTE * bytes.len() as u64;
            (start, bytes)
        };
        transmissions.into_iter().map(transmission).collect()
    });
    prop::collection::vec(station, 4)
}

proptest! {
    #[test]
    fn bus_is_independent_of_poll_times(
        script in script(), mut extra_times in prop::collection::vec(0_u64..200_000, 0..40),
    ) {
        extra_times.sort_unstable();
        let extra_times: Vec<_> = extra_times.into_iter().map(SimTime::from_nanos).collect();
        prop_assert_eq!(run(&script, &[]), run(&script, &extra_times));
        let every: Vec<_> = (0..2000).map(|n| SimTime::from_nanos(n * 100)).collect();
        prop_assert_eq!(run(&script, &[]), run(&script, &every));
    }

    #[test]
    fn received_bytes_were_transmitted_and_are_intact_without_overlap(script in script()) {
        let all = run(&script, &[]);
        // Every byte with its station and the start of its first bit.
        let sent: Vec<_> = (0..script.len()).flat_map(|by| {
            script[by].iter().flat_map(move |(start, bytes)| {
                bytes.iter().enumerate().map(move |(n, byte)| (by, *start + BYTE * n as u64, *byte))
            })
        }).collect();
        for (station, received) in all.iter().enumerate() {
            prop_assert!(received.windows(2).all(|pair| pair[0].0 + BYTE <= pair[1].0));
            for (at, byte) in received {
                let candidates: Vec<_> = sent.iter().filter(|(by, start, _)| *by != station && *start + BYTE == *at).collect();
                prop_assert!(!candidates.is_empty(), "no byte was transmitted at {at}");
                let isolated = sent.iter().filter(|(_, start, _)| *start < *at && *at < *start + BYTE * 2).count() == 1;
                prop_assert!(!isolated || candidates[0].2 == *byte);
            }
            // A byte is lost only by an overlap or at a receiver that is transmitting.
            for (by, start, byte) in sent.iter().filter(|(by, ..)| *by != station) {
                let overlaps = sent.iter().any(|(other, begins, _)| {
                    let turnaround = if *other == 0 && station == 0 { TURNAROUND } else { us(0) };
                    other != by && *begins < *start + BYTE && *start < *begins + BYTE + turnaround
                });
                prop_assert!(overlaps || received.contains(&(*start + BYTE, *byte)), "{byte} of {start} is lost");
            }
        }
    }

    #[test]
    fn restored_bus_continues_bit_for_bit(requests in prop::collection::vec(0_u8..4, 1..5), saved_at in 0_u64..400) {
        let start = |mut bus: Rs485| {
            for (n, board) in requests.iter().enumerate() {
                // Closer than the answers are long, so they collide.
                bus.send(Piece { first: at(3 + 70 * n as u64), spacing: BYTE, bytes: &request(*board), framing_error: false });
            }
            bus
        };
        let new = || Rs485::new("bus", BYTE, TURNAROUND, boards()).unwrap();
        let (mut uninterrupted, mut first) = (start(new()), start(new()));
        let (mut expected, mut found) = (Arrivals::default(), Arrivals::default());
        advance_line(&mut uninterrupted, at(600), &[], &mut expected);
        advance_line(&mut first, at(saved_at), &[at(saved_at)], &mut found);
        let mut second = new();
        second.restore(&first.save()).unwrap();
        prop_assert_eq!(second.save(), first.save());
        advance_line(&mut second, at(600), &[], &mut found);
        prop_assert_eq!(found.iter().collect::<Vec<_>>(), expected.iter().collect::<Vec<_>>());
    }
}
