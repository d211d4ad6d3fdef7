//! Half duplex: who hears whom, and what comes of talking at once.

mod support;

use proptest::prelude::*;
use support::*;
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{Arrivals, Line, Node, Piece, Rs485};

/// Says given things at given times, and hands out what it hears.
struct Actor {
    says: Vec<(SimTime, Vec<u8>)>,
    said: usize,
    heard: std::sync::mpsc::Sender<(SimTime, u8)>,
}

impl Node for Actor {
    fn name(&self) -> &'static str {
        "actor"
    }

    fn connect(&mut self, _: &str, _: &PlantSignals) -> Result<(), WiringError> {
        Ok(())
    }

    fn receive(&mut self, piece: Piece<'_>) {
        for (n, byte) in piece.bytes.iter().enumerate() {
            self.heard.send((piece.at(n), *byte)).unwrap();
        }
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.says.get(self.said).map(|(start, _)| *start)
    }

    fn advance(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        assert!(self.next_wake().is_none_or(|wake| wake >= now), "too late");
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        // It makes up its mind a little before it talks, as if it were announced by what it hears.
        let (start, says) = self.says.get(self.said)?;
        bytes.extend_from_slice(says);
        self.said += 1;
        Some(*start)
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.said)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.said = snapshot.read()?;
        Ok(())
    }
}

type FrameOutcome = Vec<(SimTime, u8)>;

/// What was said when: by the near end first, then by each node.
type Script = Vec<Vec<(SimTime, Vec<u8>)>>;

const TURNAROUND: SimDuration = SimDuration::from_micros(2);

/// What the near end and each node hear.
fn play(script: &Script, also: &[SimTime]) -> Vec<FrameOutcome> {
    let mut ears = Vec::new();
    let mut nodes: Vec<Box<dyn Node>> = Vec::new();
    for says in &script[1..] {
        let (heard, ear) = std::sync::mpsc::channel();
        ears.push(ear);
        nodes.push(Box::new(Actor {
            says: says.clone(),
            said: 0,
            heard,
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
    live_line(&mut bus, SimTime::MAX, also, &mut near);
    let nodes = ears.iter().map(|ear| ear.try_iter().collect());
    std::iter::once(near.iter().collect())
        .chain(nodes)
        .collect()
}

fn bytes(heard: &FrameOutcome) -> Vec<u8> {
    heard.iter().map(|(_, byte)| *byte).collect()
}

#[test]
fn everybody_hears_the_near_end_and_nobody_himself() {
    let script = vec![
        vec![(at(10), b"ask".to_vec())],
        vec![(at(30), b"answer".to_vec())],
        vec![],
    ];
    let heard = play(&script, &[]);
    assert_eq!(bytes(&heard[0]), b"answer");
    assert_eq!(bytes(&heard[1]), b"ask");
    assert_eq!(bytes(&heard[2]), b"askanswer");
    assert_eq!(heard[2][3], (at(33), b'a'));
    assert_eq!(heard[2][8], (at(48), b'r'));
}

#[test]
fn overlapping_bytes_are_garbled_and_the_rest_is_not() {
    // The second talks into the first one's third byte, a third of a byte late.
    let first = (at(0), vec![0xFF, 0xFF, 0xFF, 0xFF, 0xFF]);
    let second = (at(7), vec![0xFF, 0xFF, 0xFF, 0xFF]);
    let heard = play(&vec![vec![], vec![first], vec![second], vec![]], &[]);
    // Two whole bytes; a start bit in bit 2 of the third, and in that place of those that follow; then one that is whole again:
    // the second one's last byte begins while the receiver is still in the first one's last.
    assert_eq!(
        heard[3],
        [
            (at(3), 0xFF),
            (at(6), 0xFF),
            (at(9), 0xFB),
            (at(12), 0xFB),
            (at(15), 0xFB),
            (at(19), 0xFF)
        ]
    );
    assert_eq!(heard[0], heard[3]);
    // Talkers hear what begins when they are done.
    assert_eq!(heard[1], [(at(19), 0xFF)]);
    assert_eq!(heard[2], [(at(3), 0xFF), (at(6), 0xFF)]);
}

#[test]
fn what_is_said_alike_and_at_once_is_heard_as_said() {
    let same = (at(5), b"me".to_vec());
    let heard = play(&vec![vec![], vec![same.clone()], vec![same], vec![]], &[]);
    assert_eq!(bytes(&heard[3]), b"me");
    let heard = play(
        &vec![vec![], vec![(at(5), vec![0xA5])], vec![(at(5), vec![0x3C])]],
        &[],
    );
    assert_eq!(bytes(&heard[0]), [0xA5 & 0x3C]);
}

#[test]
fn the_near_end_is_deaf_until_it_has_turned_round() {
    let ask = (at(0), b"ask".to_vec());
    for (start, heard_of_it) in [(9, &b"nswer"[..]), (10, b"nswer"), (11, b"answer")] {
        let script = vec![
            vec![ask.clone()],
            vec![(at(start), b"answer".to_vec())],
            vec![],
        ];
        let heard = play(&script, &[]);
        assert_eq!(bytes(&heard[0]), heard_of_it, "{start}");
        assert_eq!(bytes(&heard[2]), b"askanswer");
    }
}

fn script() -> impl Strategy<Value = Script> {
    let talk = (0_u64..400, prop::collection::vec(any::<u8>(), 1..9));
    let talker = prop::collection::vec(talk, 0..5).prop_map(|talks| {
        let mut free = SimTime::ZERO;
        let talk = |(gap, bytes): (u64, Vec<u8>)| {
            let start = free + SimDuration::from_nanos(gap * 100);
            free = start + BYTE * bytes.len() as u64;
            (start, bytes)
        };
        talks.into_iter().map(talk).collect()
    });
    prop::collection::vec(talker, 4)
}

proptest! {
    #[test]
    fn when_the_bus_is_looked_at_changes_nothing(
        script in script(), mut also in prop::collection::vec(0_u64..200_000, 0..40),
    ) {
        also.sort_unstable();
        let also: Vec<_> = also.into_iter().map(SimTime::from_nanos).collect();
        prop_assert_eq!(play(&script, &[]), play(&script, &also));
        let every: Vec<_> = (0..2000).map(|n| SimTime::from_nanos(n * 100)).collect();
        prop_assert_eq!(play(&script, &[]), play(&script, &every));
    }

    #[test]
    fn a_byte_is_heard_only_where_one_was_said_and_whole_if_nobody_interrupts(script in script()) {
        let all = play(&script, &[]);
        // Every byte with its talker, when it begins and when it is complete.
        let said: Vec<_> = (0..script.len()).flat_map(|by| {
            script[by].iter().flat_map(move |(start, bytes)| {
                bytes.iter().enumerate().map(move |(n, byte)| (by, *start + BYTE * n as u64, *byte))
            })
        }).collect();
        for (hearer, heard) in all.iter().enumerate() {
            prop_assert!(heard.windows(2).all(|pair| pair[0].0 + BYTE <= pair[1].0));
            for (at, byte) in heard {
                let here: Vec<_> = said.iter().filter(|(by, start, _)| *by != hearer && *start + BYTE == *at).collect();
                prop_assert!(!here.is_empty(), "a byte out of nothing at {at}");
                let alone = said.iter().filter(|(_, start, _)| *start < *at && *at < *start + BYTE * 2).count() == 1;
                prop_assert!(!alone || here[0].2 == *byte);
            }
            // Nothing is lost but what meets another, or talking ears.
            for (by, start, byte) in said.iter().filter(|(by, ..)| *by != hearer) {
                let meets = said.iter().any(|(other, begins, _)| {
                    let deaf = if *other == 0 && hearer == 0 { TURNAROUND } else { us(0) };
                    other != by && *begins < *start + BYTE && *start < *begins + BYTE + deaf
                });
                prop_assert!(meets || heard.contains(&(*start + BYTE, *byte)), "{byte} of {start} is lost");
            }
        }
    }

    #[test]
    fn a_bus_saved_amid_bytes_goes_on_alike(requests in prop::collection::vec(0_u8..4, 1..5), cut in 0_u64..400) {
        let start = |mut bus: Rs485| {
            for (n, board) in requests.iter().enumerate() {
                // Closer to each other than answers are long: they meet.
                bus.send(Piece { first: at(3 + 70 * n as u64), spacing: BYTE, bytes: &request(*board), framing_error: false });
            }
            bus
        };
        let new = || Rs485::new("bus", BYTE, TURNAROUND, boards()).unwrap();
        let (mut whole, mut first) = (start(new()), start(new()));
        let (mut expected, mut found) = (Arrivals::default(), Arrivals::default());
        live_line(&mut whole, at(600), &[], &mut expected);
        live_line(&mut first, at(cut), &[at(cut)], &mut found);
        let mut second = new();
        second.restore(&first.save()).unwrap();
        prop_assert_eq!(second.save(), first.save());
        live_line(&mut second, at(600), &[], &mut found);
        prop_assert_eq!(found.iter().collect::<Vec<_>>(), expected.iter().collect::<Vec<_>>());
    }
}
