use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{BusHealth, DriverPhase, Part, PlantAccess, TaskError};

use crate::channel::Channel;
use crate::distortion::Distortion;
use crate::outages::Outages;
use crate::{FaultSchedule, FrameReader, Node, Piece, WireError, earlier};

/// Node with faults on its stub, in both directions, and of its supply. The rest of the bus has
/// none, but receives the altered transmissions.
pub struct FaultyNode<N> {
    on: String,
    byte_time: SimDuration,
    node: N,
    rx: Distortion,
    tx: Distortion,
    outages: Outages,
    /// End of the last transmission.
    free_at: SimTime,
    /// Transmission just polled from the node.
    bytes: Vec<u8>,
    /// Time of the next event of the faults; derived from the other fields.
    wake: Option<SimTime>,
}

impl<N: Node> FaultyNode<N> {
    /// Applies the faults of the schedule that are `on` the stub of `node`. A byte takes
    /// `byte_time` on the bus. Diagnostic: `ON/harmed`, the number of bytes that were altered,
    /// delayed, lost or added.
    ///
    /// # Errors
    /// [`WireError`] if a fault is invalid or `byte_time` is zero, or if its supply fails and it does
    /// not model that ([`Node::boot_time`]).
    pub fn new(
        on: &str,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
        node: N,
    ) -> Result<Self, WireError> {
        Self::framed(on, byte_time, schedule, None, node)
    }

    /// As [`FaultyNode::new`], with the frames on the bus. Without them a burst counts as a frame,
    /// and messages have no kinds.
    ///
    /// # Errors
    /// As [`FaultyNode::new`].
    pub fn framed(
        on: &str,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
        frames: Option<FrameReader>,
        node: N,
    ) -> Result<Self, WireError> {
        let boot = node.boot_time();
        let (outages, schedule) = Outages::of(on, schedule, boot.unwrap_or_default());
        if boot.is_none() && !outages.is_empty() {
            return Err(WireError::Supply { on: on.to_owned() });
        }
        let distortion = |channel| Distortion::new(on, channel, byte_time, &schedule, frames);
        let mut faulty = Self {
            on: on.to_owned(),
            byte_time,
            node,
            rx: distortion(Channel::NODE_RX)?,
            tx: distortion(Channel::NODE_TX)?,
            outages,
            free_at: SimTime::ZERO,
            bytes: Vec::new(),
            wake: None,
        };
        faulty.update_wake();
        Ok(faulty)
    }

    fn update_wake(&mut self) {
        let min_bytes_needed = self
            .node
            .min_bytes_needed()
            .and_then(|count| self.rx.byte(count));
        let events = [
            self.rx.next_event(),
            self.rx.next_byte(),
            min_bytes_needed,
            self.tx.next_event(),
            self.outages.next(),
        ];
        self.wake = events.into_iter().flatten().min();
    }

    /// Lets the node work up to `now`.
    fn advance_node(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.node.advance(now, plant)?;
        loop {
            self.bytes.clear();
            let Some(start) = self.node.poll_transmit(&mut self.bytes) else {
                return Ok(());
            };
            let piece = Piece {
                first: start.max(now).max(self.free_at) + self.byte_time,
                spacing: self.byte_time,
                bytes: &self.bytes,
                framing_error: false,
            };
            if !piece.bytes.is_empty() {
                self.free_at = piece.last();
                self.tx.pass(piece);
            }
        }
    }

    /// Switches the supply as is due at `now`.
    fn switch(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while let Some(at) = self.outages.next().filter(|at| *at <= now) {
            if self.outages.is_off() {
                self.node.power_on(at);
            } else {
                self.node.power_off(plant)?;
                self.tx.count_outages(at);
            }
            self.outages.passed += 1;
        }
        Ok(())
    }
}

impl<N: Node> Part for FaultyNode<N> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.node)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.node)
    }

    fn begin_phase(&mut self, now: SimTime, phase: DriverPhase) {
        self.rx.selection.begin_phase(now, phase);
        self.tx.selection.begin_phase(now, phase);
        self.node.begin_phase(now, phase);
    }

    fn report_health(&self, health: &mut BusHealth) {
        self.rx.report_effects(health);
        self.tx.report_effects(health);
        self.node.report_health(health);
    }

    fn diagnostics(&self) -> Vec<Port> {
        let harmed = Port::output(format!("{}/harmed", self.on), Unit::One, 1);
        std::iter::once(harmed)
            .chain(self.node.diagnostics())
            .collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        if let Some((harmed, node)) = values.split_first_mut() {
            *harmed = (self.rx.harmed() + self.tx.harmed()) as f64;
            self.node.read_diagnostics(now, node);
        }
    }

    fn save(&self) -> Snapshot {
        let (rx, tx) = (self.rx.save(), self.tx.save());
        Snapshot::of(&(self.free_at, self.outages.passed, rx, tx, self.node.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (free_at, passed, rx, tx, node): (_, _, Snapshot, Snapshot, Snapshot) =
            snapshot.read()?;
        self.outages.passed = passed;
        self.rx.restore(&rx)?;
        self.tx.restore(&tx)?;
        self.free_at = free_at;
        self.node.restore(&node)?;
        self.update_wake();
        Ok(())
    }
}

impl<N: Node> Node for FaultyNode<N> {
    fn name(&self) -> &str {
        self.node.name()
    }

    fn receive(&mut self, piece: Piece<'_>) {
        self.rx.pass(piece);
        self.tx.accept_messages(&mut self.rx);
        self.update_wake();
    }

    fn next_wake(&self) -> Option<SimTime> {
        let of_node = if self.outages.is_off() {
            None
        } else {
            self.node.next_wake()
        };
        earlier(self.wake, of_node)
    }

    fn min_bytes_needed(&self) -> Option<usize> {
        self.node.min_bytes_needed()
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.rx.process_until(now);
        let node = &mut self.node;
        self.rx.take(now, |piece| node.receive(piece));
        if !self.outages.is_off() {
            self.advance_node(now, plant)?;
        }
        self.switch(now, plant)?;
        self.tx.process_until(now);
        self.update_wake();
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.poll_transmit_framed(bytes).map(|(start, _)| start)
    }

    fn poll_transmit_framed(&mut self, bytes: &mut Vec<u8>) -> Option<(SimTime, bool)> {
        let mut tx = None;
        self.tx.take_piece(|piece| {
            bytes.extend_from_slice(piece.bytes);
            let start = SimTime::ZERO + (piece.first.since_start() - self.byte_time);
            tx = Some((start, piece.framing_error));
        });
        tx
    }
}
