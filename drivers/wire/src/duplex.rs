use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, TaskError};

use crate::arrivals::Octet;
use crate::{Arrivals, Line, Node, Piece};

/// Full-duplex connection with one device: a serial port, a USB device.
///
/// The device transmits one byte after another; a transmission that starts before the previous one
/// has ended is queued behind it.
pub struct Duplex<N> {
    byte_time: SimDuration,
    node: N,
    state: State,
    tx: Vec<u8>,
    /// Buffers of transmissions that have been taken, for further ones.
    spare: Vec<Vec<u8>>,
}

#[derive(Default, Serialize, Deserialize)]
struct State {
    now: SimTime,
    /// Bytes on the way to the device, with their completion times.
    to_device: VecDeque<(SimTime, Octet)>,
    /// Transmissions on the way from the device.
    from_device: VecDeque<Burst>,
    /// End of the device's last transmission.
    transmit_end: SimTime,
}

#[derive(Serialize, Deserialize)]
struct Burst {
    /// Completion time of the first byte.
    first: SimTime,
    bytes: Vec<u8>,
    framing_error: bool,
    /// Number of bytes taken at the near end.
    taken: usize,
}

impl<N: Node> Duplex<N> {
    /// A connection on which each byte takes `byte_time`; zero if the bytes of a transmission are
    /// complete all at once.
    pub fn new(byte_time: SimDuration, node: N) -> Self {
        Self {
            byte_time,
            node,
            state: State::default(),
            tx: Vec::new(),
            spare: Vec::new(),
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

    /// Completion time of the next byte to which the device may react.
    fn next_reception(&self) -> Option<SimTime> {
        let to_device = &self.state.to_device;
        let last = to_device.len().checked_sub(1)?;
        let index = self.node.min_bytes_needed().map_or(last, |count| {
            let count = count.max(1) - 1;
            count.min(last)
        });
        Some(to_device[index].0)
    }
}

impl<N: Node> Part for Duplex<N> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.node)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.node)
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

impl<N: Node> Line for Duplex<N> {
    fn send(&mut self, piece: Piece<'_>) {
        let framing_error = piece.framing_error;
        let octets = piece.bytes.iter().map(|&byte| Octet {
            byte,
            framing_error,
        });
        let timed = octets.enumerate().map(|(n, octet)| (piece.at(n), octet));
        self.state.to_device.extend(timed);
    }

    fn next_wake(&self) -> Option<SimTime> {
        let from_device = self.state.from_device.iter().map(|burst| self.piece(burst));
        let arrival = from_device
            .flat_map(|piece| [piece.first, piece.last()])
            .find(|&at| at > self.state.now);
        let wakes = [self.node.next_wake(), self.next_reception(), arrival];
        wakes.into_iter().flatten().min()
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.state.now = now;
        while let Some(&(at, octet)) = self.state.to_device.front().filter(|(at, _)| *at <= now) {
            self.state.to_device.pop_front();
            self.node.receive(Piece {
                first: at,
                spacing: SimDuration::ZERO,
                bytes: &[octet.byte],
                framing_error: octet.framing_error,
            });
        }
        self.node.advance(now, plant)?;
        loop {
            self.tx.clear();
            let tx = self.node.poll_transmit_framed(&mut self.tx);
            let Some((start, framing_error)) = tx else {
                break;
            };
            if self.tx.is_empty() {
                continue;
            }
            let mut bytes = self.spare.pop().unwrap_or_default();
            bytes.extend_from_slice(&self.tx);
            let burst = Burst {
                first: start.max(self.state.transmit_end) + self.byte_time,
                bytes,
                framing_error,
                taken: 0,
            };
            self.state.transmit_end = self.piece(&burst).last();
            self.state.from_device.push_back(burst);
        }
        Ok(())
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        let now = self.state.now;
        while let Some(mut burst) = self.state.from_device.pop_front() {
            let piece = self.piece(&burst);
            let complete = (burst.taken..burst.bytes.len()).take_while(|&n| piece.at(n) <= now);
            let range = burst.taken..burst.taken + complete.count();
            arrivals.push_piece(Piece {
                first: piece.at(range.start),
                bytes: &burst.bytes[range.clone()],
                ..piece
            });
            burst.taken = range.end;
            if burst.taken < burst.bytes.len() {
                self.state.from_device.push_front(burst);
                break;
            }
            burst.bytes.clear();
            self.spare.push(burst.bytes);
        }
    }
}
