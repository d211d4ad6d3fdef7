use std::collections::VecDeque;

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, PlantSignals, TaskError, WiringError};

use crate::{Diagnostics, FrameError, FramedMessage, Framer, FramerState, Node, Piece};

/// Device-specific part of an emulated device: its timed actions and its reactions to frames.
/// [`FramedNode`] turns it into a [`Node`].
///
/// The implementor holds the configuration and the indices of its plant signals; all changing state
/// is in [`Emulation::State`].
pub trait Emulation: Send {
    /// Changing state: all of it is saved and restored.
    type State: Serialize + DeserializeOwned + Send;

    /// Messages of the driver.
    type Message: FramedMessage;

    /// Returns the state at power-on.
    fn initial(&self) -> Self::State;

    /// Name, for messages, diagnostics and faults.
    fn name(&self) -> &str;

    /// Resolves the plant signals that it samples and actuates.
    ///
    /// # Errors
    /// [`WiringError`] if the plant lacks a required signal.
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError>;

    /// Returns the time of its next action; none if it only reacts to messages.
    fn next_instant(&self, state: &Self::State) -> Option<SimTime> {
        let _ = state;
        None
    }

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
    ) -> Result<(), TaskError> {
        let _ = (state, now, plant, tx);
        Ok(())
    }

    /// Handles a message complete at `now`, after all actions due by then.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails.
    fn handle_message(
        &self,
        state: &mut Self::State,
        now: SimTime,
        message: Self::Message,
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError>;

    /// Handles a frame with invalid content, complete at `now`: ignores it, or transmits a
    /// rejection.
    fn handle_invalid(&self, now: SimTime, error: FrameError, tx: &mut TxQueue) {
        let _ = (now, error, tx);
    }

    /// Reports the diagnostics, besides the count of bytes outside frames.
    fn report(&self, state: &Self::State, diagnostics: &mut Diagnostics<'_>) {
        let _ = (state, diagnostics);
    }
}

/// Pending transmissions of a device, oldest first.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TxQueue {
    /// Start and length of each.
    pending: VecDeque<(SimTime, usize)>,
    /// Bytes of all of them, end to end.
    bytes: Vec<u8>,
}

impl TxQueue {
    /// Queues a message for transmission from `start` on, or as soon as the previous transmission
    /// has ended.
    pub fn send(&mut self, start: SimTime, message: &impl FramedMessage) {
        let before = self.bytes.len();
        message.encode(&mut self.bytes);
        self.pending.push_back((start, self.bytes.len() - before));
    }

    /// Moves the bytes of the oldest transmission to the end of `bytes` and returns its start.
    fn pop(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, length) = self.pending.pop_front()?;
        // A snapshot of another part must not make this panic.
        let length = length.min(self.bytes.len());
        bytes.extend(self.bytes.drain(..length));
        Some(start)
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
            framer: Framer::new(E::Message::match_frame),
            tx: TxQueue::default(),
            framing_errors: 0,
            state,
        }
    }

    fn report(&self, diagnostics: &mut Diagnostics<'_>) {
        self.emulation.report(&self.state, diagnostics);
        diagnostics.count("unheard", self.framer.skipped() + self.framing_errors);
    }
}

impl<E: Emulation> Part for FramedNode<E> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.emulation.connect(owner, plant)
    }

    fn diagnostics(&self) -> Vec<Port> {
        Diagnostics::ports(self.name(), |diagnostics| self.report(diagnostics))
    }

    fn read_diagnostics(&self, _now: SimTime, values: &mut [f64]) {
        Diagnostics::read(values, |diagnostics| self.report(diagnostics));
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
            match E::Message::decode(frame) {
                Ok(message) => emulation.handle_message(state, now, message, plant, tx)?,
                Err(error) => emulation.handle_invalid(now, error, tx),
            }
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.tx.pop(bytes)
    }
}
