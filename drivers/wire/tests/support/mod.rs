//! What the tests of this crate share: boards that answer, and hosts that ask.
#![allow(dead_code, reason = "no test uses all of it")]

use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantFault, PlantSignals, TaskError, Wire, WiringError, World};
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

impl World for Nowhere {
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

    fn hear(&mut self, piece: Piece<'_>) {
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
        Some(self.request - self.state.heard.len())
    }

    fn next_wake(&self) -> Option<SimTime> {
        None
    }

    fn advance(&mut self, _: SimTime, _: &mut dyn World) -> Result<(), TaskError> {
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let start = self.state.answers.pop()?;
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
    loop {
        let wake = line.next_wake().filter(|wake| *wake <= end);
        let extra = also.peek().copied().filter(|extra| *extra <= end);
        let Some(now) = wake.into_iter().chain(extra).min() else {
            break;
        };
        if extra == Some(now) {
            also.next();
        }
        line.advance(now, &mut Nowhere).unwrap();
        line.receive(arrivals);
        assert!(arrivals.iter().all(|(at, _)| at <= now));
        assert!(
            line.next_wake().is_none_or(|next| next > now),
            "asks for {now} again"
        );
    }
}
