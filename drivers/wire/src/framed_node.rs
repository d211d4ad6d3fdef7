use std::collections::VecDeque;

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Part, PlantAccess, PlantSignals, TaskError, WiringError};

use crate::framed_driver::diagnostics;
use crate::{FrameMatch, Framer, FramerState, Node, Piece};

/// Device-specific part of an emulated device: its timed actions and its reactions to frames.
/// [`FramedNode`] turns it into a [`Node`].
///
/// The implementor holds the configuration and the indices of its plant signals; all changing state
/// is in [`Emulation::State`].
pub trait Emulation: Send {
    /// Changing state: all of it is saved and restored.
    type State: Serialize + DeserializeOwned + Send;

    /// Diagnostics by name and unit, besides the count of bytes outside frames. The values are
    /// written by [`Emulation::read_diagnostics`].
    const DIAGNOSTICS: &'static [(&'static str, Unit)] = &[];

    /// Matches a frame at the front of the bytes received from the driver; see [`Framer`].
    fn match_frame(front: &[u8]) -> FrameMatch;

    /// Returns the state at power-on.
    fn initial(&self) -> Self::State;

    /// Name, for messages, diagnostics and faults.
    fn name(&self) -> &str;

    /// Resolves the plant signals that it samples and actuates.
    ///
    /// # Errors
    /// [`WiringError`] if the plant lacks a required signal.
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError>;

    /// Returns the time of its next action; none if it only reacts to frames.
    fn next_instant(&self, state: &Self::State) -> Option<SimTime>;

    /// Performs the action due at `now`; afterwards [`Emulation::next_instant`] must be later.
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

    /// Handles a frame complete at `now`, after all actions due by then.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails.
    fn handle_frame(
        &self,
        state: &mut Self::State,
        now: SimTime,
        frame: &[u8],
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError>;

    /// Writes the diagnostics, in order.
    fn read_diagnostics(&self, state: &Self::State, values: &mut [f64]) {
        let _ = (state, values);
    }
}

/// Pending transmissions of a device, oldest first.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TxQueue(VecDeque<(SimTime, Vec<u8>)>);

impl TxQueue {
    /// Queues the bytes appended by `write` for transmission from `start` on, or as soon as the
    /// previous transmission has ended.
    pub fn say(&mut self, start: SimTime, write: impl FnOnce(&mut Vec<u8>)) {
        let mut bytes = Vec::new();
        write(&mut bytes);
        self.0.push_back((start, bytes));
    }
}

/// Emulated device with a framed protocol.
#[derive(Debug)]
pub struct FramedNode<E: Emulation> {
    emulation: E,
    framer: Framer,
    tx: TxQueue,
    /// Number of bytes dropped for a wrong stop bit.
    framing_errors: u64,
    state: E::State,
}

impl<E: Emulation> FramedNode<E> {
    /// A device at power-on.
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

impl<E: Emulation> Part for FramedNode<E> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.emulation.connect(owner, plant)
    }

    fn diagnostics(&self) -> Vec<Port> {
        diagnostics(self.name(), E::DIAGNOSTICS, "unheard")
    }

    fn read_diagnostics(&self, _now: SimTime, values: &mut [f64]) {
        if let [specific @ .., skipped] = values {
            self.emulation.read_diagnostics(&self.state, specific);
            *skipped = (self.framer.skipped() + self.framing_errors) as f64;
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

impl<E: Emulation> Node for FramedNode<E> {
    fn name(&self) -> &str {
        self.emulation.name()
    }

    fn receive(&mut self, piece: Piece<'_>) {
        if piece.framing_error {
            self.framing_errors += piece.bytes.len() as u64;
        } else {
            self.framer.push(piece.bytes);
        }
    }

    fn min_bytes_needed(&self) -> Option<usize> {
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
            emulation.handle_frame(state, now, frame, plant, tx)?;
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, tx) = self.tx.0.pop_front()?;
        bytes.extend(tx);
        Some(start)
    }
}
