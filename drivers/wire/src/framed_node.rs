use std::collections::VecDeque;

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};

use crate::framed_driver::diagnostics;
use crate::{FrameMatch, Framer, FramerState, Node, Piece};

/// What of an emulated device is its own: what it does at its own instants, and on what it hears. [`FramedNode`] makes a
/// [`Node`] of it.
///
/// The implementor is what was configured and where the plant has its signals; everything that changes is
/// [`Emulation::State`].
pub trait Emulation: Send {
    /// Everything that changes: all of it is saved and restored.
    type State: Serialize + DeserializeOwned + Send;

    /// What can be seen of it, by name and unit, beside the bytes that belonged to no frame. The values are those of
    /// [`Emulation::read_diagnostics`].
    const DIAGNOSTICS: &'static [(&'static str, Unit)] = &[];

    /// What stands at the front of the bytes that come from the driver; see [`Framer`].
    fn match_frame(front: &[u8]) -> FrameMatch;

    /// As it is switched on.
    fn initial(&self) -> Self::State;

    /// Name, for messages, gauges and faults.
    fn name(&self) -> &str;

    /// Tells it where the plant has its signals.
    ///
    /// # Errors
    /// [`WiringError`] if the plant has not those that it cannot do without.
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError>;

    /// Its own next instant; none if it only reacts.
    fn next_instant(&self, state: &Self::State) -> Option<SimTime>;

    /// Its own next instant is `now`, and must be over after this.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails.
    fn act(
        &self,
        state: &mut Self::State,
        now: SimTime,
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError>;

    /// Hears a frame, complete at `now`, after what it does at its own instants until then.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails.
    fn receive(
        &self,
        state: &mut Self::State,
        now: SimTime,
        frame: &[u8],
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError>;

    /// Writes the gauges, in order.
    fn read_diagnostics(&self, state: &Self::State, values: &mut [f64]) {
        let _ = (state, values);
    }
}

/// What a device has to say, oldest first.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TxQueue(VecDeque<(SimTime, Vec<u8>)>);

impl TxQueue {
    /// Says what `write` appends, from `start` on or as soon as what was said before is over.
    pub fn say(&mut self, start: SimTime, write: impl FnOnce(&mut Vec<u8>)) {
        let mut bytes = Vec::new();
        write(&mut bytes);
        self.0.push_back((start, bytes));
    }
}

/// An emulated device that is spoken to in frames.
#[derive(Debug)]
pub struct FramedNode<E: Emulation> {
    emulation: E,
    framer: Framer,
    tx: TxQueue,
    /// Bytes that were dropped for their stop bits.
    framing_errors: u64,
    state: E::State,
}

impl<E: Emulation> FramedNode<E> {
    /// As it is switched on.
    pub fn new(emulation: E) -> Self {
        let state = emulation.initial();
        Self {
            emulation,
            framer: Framer::new(E::match_frame),
            tx: TxQueue::default(),
            framing_errors: 0,
            state,
        }
    }
}

impl<E: Emulation> Node for FramedNode<E> {
    fn name(&self) -> &str {
        self.emulation.name()
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.emulation.connect(owner, plant)
    }

    fn receive(&mut self, piece: Piece<'_>) {
        if piece.framing_error {
            self.framing_errors += piece.bytes.len() as u64;
        } else {
            self.framer.push(piece.bytes);
        }
    }

    fn attention(&self) -> Option<usize> {
        Some(self.framer.missing())
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.emulation.next_instant(&self.state)
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        let Self {
            emulation,
            framer,
            tx,
            state,
            ..
        } = self;
        while emulation.next_instant(state).is_some_and(|at| at <= now) {
            emulation.act(state, now, plant, tx)?;
        }
        while let Some(frame) = framer.next_frame() {
            emulation.receive(state, now, frame, plant, tx)?;
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, tx) = self.tx.0.pop_front()?;
        bytes.extend(tx);
        Some(start)
    }

    fn diagnostics(&self) -> Vec<Port> {
        diagnostics(self.name(), E::DIAGNOSTICS, "unheard")
    }

    fn read_diagnostics(&self, _now: SimTime, values: &mut [f64]) {
        if let [own @ .., unheard] = values {
            self.emulation.read_diagnostics(&self.state, own);
            *unheard = (self.framer.skipped() + self.framing_errors) as f64;
        }
    }

    fn save(&self) -> Snapshot {
        let framer = self.framer.state();
        Snapshot::of(&(&self.state, &self.tx, framer, self.framing_errors))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let framer: FramerState;
        (self.state, self.tx, framer, self.framing_errors) = snapshot.read()?;
        self.framer.set_state(framer);
        Ok(())
    }
}
