//! Fixtures of this crate's tests: boards that answer, and hosts that send requests.
#![allow(dead_code, reason = "no test uses all of it")]

use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, PlantFault, TaskError, Wire};
use twinrig_wire::{Arrivals, Line, Node, Piece};

pub const BYTE: SimDuration = SimDuration::from_micros(3);

pub fn us(micros: u64) -> SimDuration {
    SimDuration::from_micros(micros)
}

pub fn at(micros: u64) -> SimTime {
    SimTime::ZERO + us(micros)
}

/// Absence of a plant.
pub struct NoPlant;

impl PlantAccess for NoPlant {
    fn sample(&mut self, _: Range<usize>) -> Result<&[f64], PlantFault> {
        Ok(&[])
    }

    fn actuate(&mut self, _: Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut [])
    }
}

/// Board that answers requests beginning with its address, `reaction` after their last byte.
pub struct Board {
    pub name: String,
    pub request: usize,
    pub response: usize,
    pub reaction: SimDuration,
    pub address: u8,
    /// Whether it requires the last byte of a request on time within a transmission.
    pub requires_attention: bool,
    pub state: BoardState,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct BoardState {
    received: Vec<u8>,
    last: Option<SimTime>,
    answers: Vec<SimTime>,
    pub all: Vec<(SimTime, u8)>,
    count: u8,
    pub log: bool,
}

impl Board {
    pub fn new(address: u8) -> Self {
        Self {
            name: format!("board {address}"),
            request: 10,
            response: 22,
            reaction: us(10),
            address,
            requires_attention: true,
            state: BoardState::default(),
        }
    }
}

impl Part for Board {
    fn save(&self) -> Snapshot {
        Snapshot::of(&self.state)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.state = snapshot.read()?;
        Ok(())
    }
}

impl Node for Board {
    fn name(&self) -> &str {
        &self.name
    }

    fn receive(&mut self, piece: Piece<'_>) {
        let state = &mut self.state;
        for (n, byte) in piece.bytes.iter().enumerate() {
            let now = piece.at(n);
            assert!(
                state.last.is_none_or(|last| last + BYTE <= now),
                "{now} overlaps"
            );
            // A pause ends a packet.
            if state.last.is_some_and(|last| last + us(15) < now) {
                state.received.clear();
            }
            state.last = Some(now);
            if state.log {
                state.all.push((now, *byte));
            }
            state.received.push(*byte);
            if state.received.len() == self.request {
                if state.received[0] == self.address {
                    state.answers.push(now + self.reaction);
                }
                state.received.clear();
            }
        }
    }

    fn min_bytes_needed(&self) -> Option<usize> {
        let missing = self.request - self.state.received.len();
        self.requires_attention.then_some(missing)
    }

    fn next_wake(&self) -> Option<SimTime> {
        None
    }

    fn advance(&mut self, _: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        if self.state.answers.is_empty() {
            return None;
        }
        let start = self.state.answers.remove(0);
        self.state.count = self.state.count.wrapping_add(1);
        bytes.extend((0..self.response).map(|n| match n {
            // Not an address.
            0 => 0xF0 | self.address,
            1 => self.state.count,
            n => n.to_le_bytes()[0],
        }));
        Some(start)
    }
}

/// Returns four boards.
pub fn boards() -> Vec<Box<dyn Node>> {
    (0..4)
        .map(|address| Box::new(Board::new(address)) as Box<dyn Node>)
        .collect()
}

/// Returns four boards that receive each transmission at its end.
pub fn boards_without_attention() -> Vec<Box<dyn Node>> {
    let mut all: [Board; 4] = [0, 1, 2, 3].map(Board::new);
    for board in &mut all {
        board.requires_attention = false;
    }
    all.map(|board| Box::new(board) as Box<dyn Node>).into()
}

/// Returns a request to that board.
pub fn request(address: u8) -> [u8; 10] {
    [address, 1, 2, 3, 4, 5, 6, 7, 8, 9]
}

/// Advances a wire to `end`, at its wake-ups and at the instants `extra_times`; appends the reads
/// with their times.
pub fn advance_wire(
    wire: &mut dyn Wire,
    end: SimTime,
    extra_times: &[SimTime],
    read: &mut Vec<(SimTime, Vec<u8>)>,
) {
    let mut extra_times = extra_times.iter().copied().peekable();
    let mut last = SimTime::ZERO;
    loop {
        let wake = wire.next_wake().filter(|wake| *wake <= end);
        let extra = extra_times.peek().copied().filter(|extra| *extra <= end);
        let Some(now) = wake.into_iter().chain(extra).min() else {
            break;
        };
        if extra == Some(now) {
            extra_times.next();
        }
        assert!(now >= last, "{now} after {last}");
        last = now;
        wire.advance(now, &mut NoPlant).unwrap();
        let mut bytes = Vec::new();
        wire.receive(&mut bytes);
        if !bytes.is_empty() {
            read.push((now, bytes));
        }
        assert!(
            wire.next_wake().is_none_or(|next| next > now),
            "repeated wake-up at {now}"
        );
    }
}

/// The same for a line, with the completion times of the bytes.
pub fn advance_line(
    line: &mut dyn Line,
    end: SimTime,
    extra_times: &[SimTime],
    arrivals: &mut Arrivals,
) {
    let mut extra_times = extra_times.iter().copied().peekable();
    let mut last: Option<SimTime> = None;
    loop {
        let wake = line.next_wake().filter(|wake| *wake <= end);
        let extra = extra_times.peek().copied().filter(|extra| *extra <= end);
        let Some(now) = wake.into_iter().chain(extra).min() else {
            break;
        };
        if extra == Some(now) {
            extra_times.next();
        }
        let mut new = Arrivals::default();
        line.advance(now, &mut NoPlant).unwrap();
        line.receive(&mut new);
        assert!(
            new.iter().all(|(at, _)| last.is_none_or(|last| at > last)),
            "late at {now}: {new:?}"
        );
        last = Some(now);
        arrivals.append(&mut new);
        assert!(arrivals.iter().all(|(at, _)| at <= now));
        assert!(
            line.next_wake().is_none_or(|next| next > now),
            "repeated wake-up at {now}"
        );
    }
}

/// Line with scripted arrivals at its near end that forwards the bytes sent into it.
pub struct ScriptedLine {
    pub arrivals_due: Vec<(SimTime, u8)>,
    pub arrived: usize,
    pub taken: usize,
    pub now: SimTime,
    pub sent: std::sync::mpsc::Sender<(SimTime, u8)>,
}

impl Part for ScriptedLine {
    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.arrived, self.taken))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.arrived, self.taken) = snapshot.read()?;
        Ok(())
    }
}

impl Line for ScriptedLine {
    fn send(&mut self, piece: Piece<'_>) {
        assert!(piece.first >= self.now, "sent at {}: {piece:?}", self.now);
        for (n, byte) in piece.bytes.iter().enumerate() {
            self.sent.send((piece.at(n), *byte)).unwrap();
        }
    }

    fn next_wake(&self) -> Option<SimTime> {
        let next = self.arrivals_due.get(self.arrived)?;
        // Of contiguous bytes, only the first and the last are reported.
        let pairs = self.arrivals_due[self.arrived..].windows(2);
        let follow = pairs
            .take_while(|pair| pair[0].0 + BYTE == pair[1].0)
            .count();
        let contiguous = self.arrived > 0 && self.arrivals_due[self.arrived - 1].0 + BYTE == next.0;
        Some(if contiguous {
            self.arrivals_due[self.arrived + follow].0
        } else {
            next.0
        })
    }

    fn advance(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.now = now;
        self.arrived = self.arrivals_due.partition_point(|(at, _)| *at <= now);
        Ok(())
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        for (at, byte) in &self.arrivals_due[self.taken..self.arrived] {
            arrivals.push(*at, BYTE, &[*byte]);
        }
        self.taken = self.arrived;
    }
}

/// Bursts of bytes, each with the pause before it \[ns\].
pub type Bursts = Vec<(u64, Vec<u8>)>;

/// Returns the bytes with their completion times.
pub fn timed(bursts: &Bursts) -> Vec<(SimTime, u8)> {
    let mut free = SimTime::ZERO;
    let mut all = Vec::new();
    for (gap, bytes) in bursts {
        free += SimDuration::from_nanos(*gap);
        for byte in bytes {
            free += BYTE;
            all.push((free, *byte));
        }
    }
    all
}

/// Arbitrary bursts of up to `bytes` bytes.
pub fn bursts(bytes: usize) -> impl proptest::strategy::Strategy<Value = Bursts> {
    use proptest::prelude::*;
    prop::collection::vec(
        (0_u64..60_000, prop::collection::vec(any::<u8>(), 1..=bytes)),
        0..8,
    )
}
