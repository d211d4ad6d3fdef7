use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};

use crate::distortion::Distortion;
use crate::{FaultSchedule, Node, Piece, WireError};

/// A node with faults on its stub, in both directions; the rest of the bus has none of them, but hears what comes of it.
pub struct FaultyNode<N> {
    on: String,
    byte_time: SimDuration,
    node: N,
    heard: Distortion,
    said: Distortion,
    /// When what it said last is over.
    free_at: SimTime,
    /// What the node just says.
    bytes: Vec<u8>,
    /// When the faults do something next: follows from the rest.
    wake: Option<SimTime>,
}

impl<N: Node> FaultyNode<N> {
    /// `node` with those faults of the schedule that are `on` its stub. A byte takes `byte_time` on the bus. Its gauge, bytes
    /// that did not pass as they were, is `ON/harmed`.
    ///
    /// # Errors
    /// [`WireError`] if a fault cannot be, or `byte_time` is zero.
    pub fn new(
        on: &str,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
        node: N,
    ) -> Result<Self, WireError> {
        let mut faulty = Self {
            on: on.to_owned(),
            byte_time,
            node,
            heard: Distortion::new(on, "heard", false, byte_time, schedule)?,
            said: Distortion::new(on, "said", true, byte_time, schedule)?,
            free_at: SimTime::ZERO,
            bytes: Vec::new(),
            wake: None,
        };
        faulty.look_ahead();
        Ok(faulty)
    }

    fn look_ahead(&mut self) {
        let attention = self
            .node
            .attention()
            .and_then(|count| self.heard.byte(count));
        let own = [
            self.heard.next_event(),
            self.heard.next_byte(),
            attention,
            self.said.next_event(),
        ];
        self.wake = own.into_iter().flatten().min();
    }
}

impl<N: Node> Node for FaultyNode<N> {
    fn name(&self) -> &str {
        self.node.name()
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.node.connect(owner, plant)
    }

    fn receive(&mut self, piece: Piece<'_>) {
        self.heard.pass(piece);
        self.look_ahead();
    }

    fn next_wake(&self) -> Option<SimTime> {
        match (self.wake, self.node.next_wake()) {
            (Some(own), Some(node)) => Some(own.min(node)),
            (own, node) => own.or(node),
        }
    }

    fn attention(&self) -> Option<usize> {
        self.node.attention()
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.heard.settle(now);
        let node = &mut self.node;
        self.heard.take(now, |piece| node.receive(piece));
        self.node.advance(now, plant)?;
        loop {
            self.bytes.clear();
            let Some(start) = self.node.poll_transmit(&mut self.bytes) else {
                break;
            };
            let piece = Piece {
                first: start.max(now).max(self.free_at) + self.byte_time,
                spacing: self.byte_time,
                bytes: &self.bytes,
                framing_error: false,
            };
            if !piece.bytes.is_empty() {
                self.free_at = piece.last();
                self.said.pass(piece);
            }
        }
        self.said.settle(now);
        self.look_ahead();
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.poll_transmit_framed(bytes).map(|(start, _)| start)
    }

    fn poll_transmit_framed(&mut self, bytes: &mut Vec<u8>) -> Option<(SimTime, bool)> {
        let mut said = None;
        self.said.take_piece(|piece| {
            bytes.extend_from_slice(piece.bytes);
            let start = SimTime::ZERO + (piece.first.since_start() - self.byte_time);
            said = Some((start, piece.framing_error));
        });
        said
    }

    fn diagnostics(&self) -> Vec<Port> {
        let own = Port::output(format!("{}/harmed", self.on), Unit::One, 1);
        std::iter::once(own)
            .chain(self.node.diagnostics())
            .collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        if let Some((own, node)) = values.split_first_mut() {
            *own = (self.heard.harmed() + self.said.harmed()) as f64;
            self.node.read_diagnostics(now, node);
        }
    }

    fn save(&self) -> Snapshot {
        let (heard, said) = (self.heard.save(), self.said.save());
        Snapshot::of(&(self.free_at, heard, said, self.node.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (free_at, heard, said, node): (_, Snapshot, Snapshot, Snapshot) = snapshot.read()?;
        self.heard.restore(&heard)?;
        self.said.restore(&said)?;
        self.free_at = free_at;
        self.node.restore(&node)?;
        self.look_ahead();
        Ok(())
    }
}
