use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};

use crate::arrivals::Octet;
use crate::{Arrivals, Line, Node, Piece};

/// A connection with one device at its far end, which may talk while it hears: a serial port, a USB device.
///
/// What the device says leaves it byte after byte; what it says while it still talks waits until that is over.
pub struct Duplex<N> {
    byte_time: SimDuration,
    node: N,
    state: State,
    spoken: Vec<u8>,
}

#[derive(Default, Serialize, Deserialize)]
struct State {
    now: SimTime,
    /// On its way to the device, with the times at which it is complete there.
    outward: VecDeque<(SimTime, Octet)>,
    /// On its way from the device.
    homeward: VecDeque<Burst>,
    /// When the device is done with talking.
    silent: SimTime,
}

#[derive(Serialize, Deserialize)]
struct Burst {
    /// When its first byte is complete.
    first: SimTime,
    bytes: Vec<u8>,
    framing_error: bool,
    /// How many of them were taken at the near end.
    taken: usize,
}

impl<N: Node> Duplex<N> {
    /// Of a device whose bytes take `byte_time` each; zero if all bytes that it says at once come at once.
    pub fn new(byte_time: SimDuration, node: N) -> Self {
        Self {
            byte_time,
            node,
            state: State::default(),
            spoken: Vec::new(),
        }
    }

    fn piece<'b>(&self, burst: &'b Burst) -> Piece<'b> {
        Piece {
            first: burst.first,
            spacing: self.byte_time,
            bytes: &burst.bytes,
            framing_error: burst.framing_error,
        }
    }

    /// The next byte to which the device may react.
    fn next_heard(&self) -> Option<SimTime> {
        let outward = &self.state.outward;
        let last = outward.len().checked_sub(1)?;
        let of_note = self.node.attention().map_or(last, |count| {
            let count = count.max(1) - 1;
            count.min(last)
        });
        Some(outward[of_note].0)
    }
}

impl<N: Node> Line for Duplex<N> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.node.connect(owner, plant)
    }

    fn send(&mut self, piece: Piece<'_>) {
        let framing_error = piece.framing_error;
        let octets = piece.bytes.iter().map(|&byte| Octet {
            byte,
            framing_error,
        });
        let timed = octets.enumerate().map(|(n, octet)| (piece.at(n), octet));
        self.state.outward.extend(timed);
    }

    fn next_wake(&self) -> Option<SimTime> {
        let homeward = self.state.homeward.iter().map(|burst| self.piece(burst));
        let home = homeward
            .flat_map(|piece| [piece.first, piece.last()])
            .find(|&at| at > self.state.now);
        let wakes = [self.node.next_wake(), self.next_heard(), home];
        wakes.into_iter().flatten().min()
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.state.now = now;
        while let Some(&(at, octet)) = self.state.outward.front().filter(|(at, _)| *at <= now) {
            self.state.outward.pop_front();
            self.node.receive(Piece {
                first: at,
                spacing: SimDuration::ZERO,
                bytes: &[octet.byte],
                framing_error: octet.framing_error,
            });
        }
        self.node.advance(now, plant)?;
        loop {
            self.spoken.clear();
            let spoken = self.node.poll_transmit_framed(&mut self.spoken);
            let Some((start, framing_error)) = spoken else {
                break;
            };
            if self.spoken.is_empty() {
                continue;
            }
            let burst = Burst {
                first: start.max(self.state.silent) + self.byte_time,
                bytes: self.spoken.clone(),
                framing_error,
                taken: 0,
            };
            self.state.silent = self.piece(&burst).last();
            self.state.homeward.push_back(burst);
        }
        Ok(())
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        let now = self.state.now;
        while let Some(mut burst) = self.state.homeward.pop_front() {
            let piece = self.piece(&burst);
            let by_now = (burst.taken..burst.bytes.len()).take_while(|&n| piece.at(n) <= now);
            let whole = burst.taken..burst.taken + by_now.count();
            arrivals.push_piece(Piece {
                first: piece.at(whole.start),
                bytes: &burst.bytes[whole.clone()],
                ..piece
            });
            burst.taken = whole.end;
            if burst.taken < burst.bytes.len() {
                self.state.homeward.push_front(burst);
                break;
            }
        }
    }

    fn diagnostics(&self) -> Vec<Port> {
        self.node.diagnostics()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        self.node.read_diagnostics(now, values);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.state, self.node.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (state, node): (State, Snapshot) = snapshot.read()?;
        self.node.restore(&node)?;
        self.state = state;
        Ok(())
    }
}
