//! What the tests of this crate share: boards that answer, and hosts that ask.
#![allow(dead_code, reason = "no test uses all of it")]

use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantAccess, PlantFault, PlantSignals, TaskError, Wire, WiringError};
use twinrig_wire::{Arrivals, Line, Node, Piece};

pub const BYTE: SimDuration = SimDuration::from_micros(3);

pub fn us(micros: u64) -> SimDuration {
    SimDuration::from_micros(micros)
}

pub fn at(micros: u64) -> SimTime {
    SimTime::ZERO + us(micros)
}

/// There is no plant.
pub struct Nowhere;

impl PlantAccess for Nowhere {
    fn sample(&mut self, _: Range<usize>) -> Result<&[f64], PlantFault> {
        Ok(&[])
    }

    fn actuate(&mut self, _: Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut [])
    }
}

/// Answers requests that begin with its address, `reaction` after their last byte.
pub struct Board {
    pub name: String,
    pub request: usize,
    pub response: usize,
    pub reaction: SimDuration,
    pub address: u8,
    /// Whether it wants to hear the last byte of a request on time in the midst of others.
    pub attentive: bool,
    pub state: BoardState,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct BoardState {
    heard: Vec<u8>,
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
            attentive: true,
            state: BoardState::default(),
        }
    }
}

impl Node for Board {
    fn name(&self) -> &str {
        &self.name
    }

    fn connect(&mut self, _: &str, _: &PlantSignals) -> Result<(), WiringError> {
        Ok(())
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
                state.heard.clear();
            }
            state.last = Some(now);
            if state.log {
                state.all.push((now, *byte));
            }
            state.heard.push(*byte);
            if state.heard.len() == self.request {
                if state.heard[0] == self.address {
                    state.answers.push(now + self.reaction);
                }
                state.heard.clear();
            }
        }
    }

    fn attention(&self) -> Option<usize> {
        let missing = self.request - self.state.heard.len();
        self.attentive.then_some(missing)
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

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.state)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.state = snapshot.read()?;
        Ok(())
    }
}

/// Four of them.
pub fn boards() -> Vec<Box<dyn Node>> {
    (0..4)
        .map(|address| Box::new(Board::new(address)) as Box<dyn Node>)
        .collect()
}

/// Four that hear each packet when it is over.
pub fn listeners() -> Vec<Box<dyn Node>> {
    let mut all: [Board; 4] = [0, 1, 2, 3].map(Board::new);
    for board in &mut all {
        board.attentive = false;
    }
    all.map(|board| Box::new(board) as Box<dyn Node>).into()
}

/// A request to that board.
pub fn request(address: u8) -> [u8; 10] {
    [address, 1, 2, 3, 4, 5, 6, 7, 8, 9]
}

/// Lets a wire live until `end`, at its own wake-ups and at those of `also`; says what was read when.
pub fn live(
    wire: &mut dyn Wire,
    end: SimTime,
    also: &[SimTime],
    read: &mut Vec<(SimTime, Vec<u8>)>,
) {
    let mut also = also.iter().copied().peekable();
    let mut last = SimTime::ZERO;
    loop {
        let wake = wire.next_wake().filter(|wake| *wake <= end);
        let extra = also.peek().copied().filter(|extra| *extra <= end);
        let Some(now) = wake.into_iter().chain(extra).min() else {
            break;
        };
        if extra == Some(now) {
            also.next();
        }
        assert!(now >= last, "{now} after {last}");
        last = now;
        wire.advance(now, &mut Nowhere).unwrap();
        let mut bytes = Vec::new();
        wire.receive(&mut bytes);
        if !bytes.is_empty() {
            read.push((now, bytes));
        }
        assert!(
            wire.next_wake().is_none_or(|next| next > now),
            "asks for {now} again"
        );
    }
}

/// The same for a line; with the times at which its bytes were complete.
pub fn live_line(line: &mut dyn Line, end: SimTime, also: &[SimTime], arrivals: &mut Arrivals) {
    let mut also = also.iter().copied().peekable();
    let mut last: Option<SimTime> = None;
    loop {
        let wake = line.next_wake().filter(|wake| *wake <= end);
        let extra = also.peek().copied().filter(|extra| *extra <= end);
        let Some(now) = wake.into_iter().chain(extra).min() else {
            break;
        };
        if extra == Some(now) {
            also.next();
        }
        let mut new = Arrivals::default();
        line.advance(now, &mut Nowhere).unwrap();
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
            "asks for {now} again"
        );
    }
}

/// A line at whose near end given bytes arrive, and which hands out what is sent into it.
pub struct Scripted {
    pub arrives: Vec<(SimTime, u8)>,
    pub arrived: usize,
    pub taken: usize,
    pub now: SimTime,
    pub sent: std::sync::mpsc::Sender<(SimTime, u8)>,
}

impl Line for Scripted {
    fn connect(&mut self, _: &str, _: &PlantSignals) -> Result<(), WiringError> {
        Ok(())
    }

    fn send(&mut self, piece: Piece<'_>) {
        assert!(piece.first >= self.now, "sent at {}: {piece:?}", self.now);
        for (n, byte) in piece.bytes.iter().enumerate() {
            self.sent.send((piece.at(n), *byte)).unwrap();
        }
    }

    fn next_wake(&self) -> Option<SimTime> {
        let next = self.arrives.get(self.arrived)?;
        // Of those that follow without a pause, only the first and the last are named.
        let pairs = self.arrives[self.arrived..].windows(2);
        let follow = pairs
            .take_while(|pair| pair[0].0 + BYTE == pair[1].0)
            .count();
        let goes_on = self.arrived > 0 && self.arrives[self.arrived - 1].0 + BYTE == next.0;
        Some(if goes_on {
            self.arrives[self.arrived + follow].0
        } else {
            next.0
        })
    }

    fn advance(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.now = now;
        self.arrived = self.arrives.partition_point(|(at, _)| *at <= now);
        Ok(())
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        for (at, byte) in &self.arrives[self.taken..self.arrived] {
            arrivals.push(*at, BYTE, &[*byte]);
        }
        self.taken = self.arrived;
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.arrived, self.taken))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.arrived, self.taken) = snapshot.read()?;
        Ok(())
    }
}

/// Bytes in bursts with pauses between them \[ns\].
pub type Bursts = Vec<(u64, Vec<u8>)>;

/// When each of them is complete.
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

/// Any bursts, of up to so many bytes.
pub fn bursts(bytes: usize) -> impl proptest::strategy::Strategy<Value = Bursts> {
    use proptest::prelude::*;
    prop::collection::vec(
        (0_u64..60_000, prop::collection::vec(any::<u8>(), 1..=bytes)),
        0..8,
    )
}
