//! Full-duplex line with one device in both directions, and the framer on arbitrary bytes.

use proptest::collection::vec;
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, PlantFault, TaskError};
use twinrig_wire::{Arrivals, Duplex, FrameMatch, Framer, Line, Node, Piece};

const BYTE: SimDuration = SimDuration::from_micros(10);

/// Transmits every received byte again, and one byte of 0xff every millisecond.
#[derive(Default)]
struct Echo {
    received: Vec<(SimTime, u8)>,
    tx: Vec<u8>,
    ticks: u64,
    now: SimTime,
}

impl Part for Echo {
    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.received, &self.tx, self.ticks, self.now))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.received, self.tx, self.ticks, self.now) = snapshot.read()?;
        Ok(())
    }
}

impl Node for Echo {
    fn name(&self) -> &'static str {
        "echo"
    }

    fn receive(&mut self, piece: Piece<'_>) {
        for (n, &byte) in piece.bytes.iter().enumerate() {
            self.received.push((piece.at(n), byte));
            self.tx.push(byte);
        }
    }

    fn min_bytes_needed(&self) -> Option<usize> {
        Some(1)
    }

    fn next_wake(&self) -> Option<SimTime> {
        Some(SimTime::ZERO + SimDuration::from_millis(self.ticks))
    }

    fn advance(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.now = now;
        while self.next_wake().is_some_and(|at| at <= now) {
            self.ticks += 1;
            self.tx.push(0xff);
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let any = !self.tx.is_empty();
        bytes.append(&mut self.tx);
        any.then_some(self.now)
    }
}

struct NoPlant;

impl PlantAccess for NoPlant {
    fn sample(&mut self, _: std::ops::Range<usize>) -> Result<&[f64], PlantFault> {
        Ok(&[])
    }

    fn actuate(&mut self, _: std::ops::Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut [])
    }
}

/// Advances to `end` at every wake-up and at the instants `extra`; returns the received bytes with
/// their times.
fn run(line: &mut Duplex<Echo>, extra_times: &[SimTime], end: SimTime) -> Vec<(SimTime, u8)> {
    let mut arrived = Vec::new();
    let mut extra_times = extra_times.iter().copied().peekable();
    loop {
        let wake = line.next_wake().unwrap_or(SimTime::MAX);
        let now = extra_times.peek().map_or(wake, |&extra| extra.min(wake));
        if now > end {
            return arrived;
        }
        while extra_times.peek().is_some_and(|&extra| extra <= now) {
            extra_times.next();
        }
        line.advance(now, &mut NoPlant).unwrap();
        let mut arrivals = Arrivals::default();
        line.receive(&mut arrivals);
        arrived.extend(arrivals.iter());
        assert!(
            arrived.iter().all(|(at, _)| *at <= now),
            "no byte is received before it is complete"
        );
    }
}

fn at(micros: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_micros(micros)
}

proptest! {
    #[test]
    fn bytes_are_preserved_and_transmissions_do_not_overlap(
        bytes in vec(0..0xff_u8, 1..40), start in 0..3_000_u64, extra_times in vec(0..5_000_u64, 0..20),
    ) {
        let mut line = Duplex::new(BYTE, Echo::default());
        line.send(Piece { first: at(start), spacing: BYTE, bytes: &bytes, framing_error: false });
        let mut extra_times: Vec<SimTime> = extra_times.into_iter().map(at).collect();
        extra_times.sort_unstable();
        let arrived = run(&mut line, &extra_times, at(5_000));
        let echoed: Vec<u8> = arrived.iter().map(|(_, byte)| *byte).filter(|byte| *byte != 0xff).collect();
        prop_assert_eq!(echoed, bytes);
        prop_assert!(arrived.windows(2).all(|pair| pair[1].0 - pair[0].0 >= BYTE));
        prop_assert_eq!(arrived[0].0, at(10), "the first tick is at once");
    }

    #[test]
    fn duplex_line_is_independent_of_poll_times(
        bytes in vec(0..0xff_u8, 1..40), start in 0..3_000_u64, extra_times in vec(0..5_000_u64, 0..20),
    ) {
        let run_with = |extra_times: &[SimTime]| {
            let mut line = Duplex::new(BYTE, Echo::default());
            line.send(Piece { first: at(start), spacing: BYTE, bytes: &bytes, framing_error: false });
            run(&mut line, extra_times, at(5_000))
        };
        let mut extra_times: Vec<SimTime> = extra_times.into_iter().map(at).collect();
        extra_times.sort_unstable();
        prop_assert_eq!(run_with(&extra_times), run_with(&[]));
    }

    #[test]
    fn restored_duplex_line_continues_bit_for_bit(bytes in vec(any::<u8>(), 1..40), saved_at in 0..2_000_u64) {
        let mut line = Duplex::new(BYTE, Echo::default());
        line.send(Piece { first: at(500), spacing: BYTE, bytes: &bytes, framing_error: false });
        run(&mut line, &[at(saved_at)], at(saved_at));
        let saved = line.save();
        let rest = run(&mut line, &[], at(4_000));
        let mut restored = Duplex::new(BYTE, Echo::default());
        restored.restore(&saved).unwrap();
        prop_assert_eq!(run(&mut restored, &[], at(4_000)), rest);
    }

    #[test]
    fn every_byte_is_in_a_frame_or_skipped(pieces in vec(vec(0..6_u8, 0..10), 0..20)) {
        /// A length from 1 to 4, then as many bytes, the first of which is not 0.
        fn match_frame(front: &[u8]) -> FrameMatch {
            match front {
                [length @ 1..=4, first, ..] if *first != 0 => {
                    let length = usize::from(*length) + 1;
                    if front.len() < length {
                        FrameMatch::Missing(length - front.len())
                    } else {
                        FrameMatch::Frame(length)
                    }
                }
                [] => FrameMatch::Missing(2),
                [1..=4] => FrameMatch::Missing(1),
                _ => FrameMatch::Garbage,
            }
        }
        let mut framer = Framer::new(match_frame);
        let mut framed = 0;
        for piece in &pieces {
            framer.push(piece);
            while let Some(frame) = framer.next_frame() {
                prop_assert_eq!(match_frame(frame), FrameMatch::Frame(frame.len()));
                framed += frame.len();
            }
            let mut restored = Framer::new(match_frame);
            let state = Snapshot::of(framer.state());
            restored.set_state(state.read().unwrap());
            prop_assert_eq!(restored.missing(), framer.missing());
        }
        let pushed: usize = pieces.iter().map(Vec::len).sum();
        let done = framed + usize::try_from(framer.skipped()).unwrap();
        prop_assert!((0..=4).contains(&(pushed - done)), "only a possible beginning of a frame is kept");
    }
}
