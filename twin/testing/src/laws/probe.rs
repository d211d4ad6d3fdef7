use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, TaskError};
use twinrig_wire::{Node, Piece, earlier};

use super::turns::Turns;

/// Transmissions of the devices of a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Tap(Arc<Mutex<Vec<Transmission>>>);

/// A transmission of a device, or of the driver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Transmission {
    /// Start of its first bit.
    pub(super) start: SimTime,
    pub(super) bytes: Vec<u8>,
}

impl Tap {
    /// Returns the transmissions so far.
    pub(super) fn transmissions(&self) -> MutexGuard<'_, Vec<Transmission>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes over the transmissions of another run.
    pub(super) fn copy_from(&self, other: &Self) {
        self.transmissions().clone_from(&other.transmissions());
    }
}

/// A device that is watched: its transmissions are recorded, what it receives is cut into pieces,
/// and it is advanced at further instants.
pub(super) struct Probe {
    node: Box<dyn Node>,
    tap: Tap,
    pieces: Option<Turns>,
    looks: Option<Turns>,
    /// Time of the next look.
    look: Option<SimTime>,
}

impl Probe {
    pub(super) fn new(
        node: Box<dyn Node>,
        tap: Tap,
        pieces: Option<Turns>,
        looks: Option<Turns>,
    ) -> Self {
        let look = looks.is_some().then_some(SimTime::ZERO);
        Self {
            node,
            tap,
            pieces,
            looks,
            look,
        }
    }
}

impl Part for Probe {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&*self.node)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut *self.node)
    }

    fn save(&self) -> Snapshot {
        self.node.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.node.restore(snapshot)
    }
}

impl Node for Probe {
    fn name(&self) -> &str {
        self.node.name()
    }

    fn receive(&mut self, piece: Piece<'_>) {
        let Some(pieces) = &mut self.pieces else {
            return self.node.receive(piece);
        };
        let mut from = 0;
        while from < piece.bytes.len() {
            let to = (from + pieces.next_usize()).min(piece.bytes.len());
            self.node.receive(Piece {
                first: piece.at(from),
                bytes: &piece.bytes[from..to],
                ..piece
            });
            from = to;
        }
    }

    fn min_bytes_needed(&self) -> Option<usize> {
        self.node.min_bytes_needed()
    }

    fn next_wake(&self) -> Option<SimTime> {
        earlier(self.look, self.node.next_wake())
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while let (Some(looks), Some(at)) = (&mut self.looks, self.look.filter(|at| *at <= now)) {
            self.look = Some(at + SimDuration::from_nanos(looks.next()));
        }
        self.node.advance(now, plant)
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.poll_transmit_framed(bytes).map(|(start, _)| start)
    }

    fn poll_transmit_framed(&mut self, bytes: &mut Vec<u8>) -> Option<(SimTime, bool)> {
        let before = bytes.len();
        let found = self.node.poll_transmit_framed(bytes)?;
        if bytes.len() > before {
            self.tap.transmissions().push(Transmission {
                start: found.0,
                bytes: bytes[before..].to_vec(),
            });
        }
        Some(found)
    }
}
