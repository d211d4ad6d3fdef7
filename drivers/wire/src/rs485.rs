use serde::{Deserialize, Serialize};
use twinrig_kernel::{
    Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit,
};
use twinrig_runtime::{BusHealth, Part, PlantAccess, PlantSignals, TaskError, WiringError};

use crate::error::nonzero;
use crate::line::earlier;
use crate::medium::{Medium, NEAR};
use crate::{Arrivals, Line, Node, Piece, WireError};

/// Half-duplex bus with several nodes, seen from its near end, which is a station like the others.
///
/// Overlapping transmissions are garbled: the other receivers lock onto the byte that began first,
/// sample the AND of all levels in the middle of its bits, and miss the bytes that begin meanwhile.
/// So there are never more bytes received than transmitted, and equal bytes transmitted
/// simultaneously are received unchanged. A station receives nothing while it transmits; the near
/// end nothing until the turnaround time of its transceiver has passed.
pub struct Rs485 {
    name: String,
    slots: Vec<NodeSlot>,
    medium: Medium,
    /// Bytes received by the near end and not taken.
    near: Arrivals,
    /// Transmission just polled from a node.
    tx: Vec<u8>,
    /// Minimum of [`Node::min_bytes_needed`] over the nodes.
    min_bytes_needed: Option<usize>,
    /// Time of the next event; derived from the other fields.
    wake: Option<SimTime>,
}

/// Node with cached properties.
struct NodeSlot {
    node: Box<dyn Node>,
    /// Whether it has received bytes at this instant.
    received: bool,
    /// Its [`Node::next_wake`] and [`Node::min_bytes_needed`], updated whenever it was advanced.
    wake: Option<SimTime>,
    min_bytes_needed: Option<usize>,
    /// Number of values of its diagnostics.
    width: usize,
}

impl NodeSlot {
    fn new(node: Box<dyn Node>) -> Self {
        let mut slot = Self {
            received: false,
            wake: None,
            min_bytes_needed: None,
            width: Layout::of(&node.diagnostics(), Direction::Output).len(),
            node,
        };
        slot.refresh();
        slot
    }

    fn refresh(&mut self) {
        self.wake = self.node.next_wake();
        self.min_bytes_needed = self.node.min_bytes_needed();
    }
}

#[derive(Serialize, Deserialize)]
struct Saved {
    medium: Medium,
    near: Arrivals,
    nodes: Vec<Snapshot>,
}

impl Rs485 {
    /// A bus on which a byte takes `byte_time`, and whose near end receives nothing until
    /// `turnaround` after its own transmission. Diagnostic: `NAME/collisions`, the number of bytes
    /// that overlapped another.
    ///
    /// # Errors
    /// [`WireError::Zero`] if `byte_time` is zero.
    pub fn new(
        name: &str,
        byte_time: SimDuration,
        turnaround: SimDuration,
        nodes: Vec<Box<dyn Node>>,
    ) -> Result<Self, WireError> {
        nonzero(name, "byte time", byte_time)?;
        let mut bus = Self {
            name: name.to_owned(),
            medium: Medium::new(byte_time, turnaround, nodes.len()),
            near: Arrivals::default(),
            tx: Vec::new(),
            slots: nodes.into_iter().map(NodeSlot::new).collect(),
            min_bytes_needed: None,
            wake: None,
        };
        bus.update_wake();
        Ok(bus)
    }

    fn update_wake(&mut self) {
        let (mut wake, mut min_bytes_needed) = (None, None::<usize>);
        for slot in &self.slots {
            wake = earlier(wake, slot.wake);
            min_bytes_needed = match (min_bytes_needed, slot.min_bytes_needed) {
                (Some(least), Some(count)) => Some(least.min(count)),
                (least, count) => least.or(count),
            };
        }
        self.min_bytes_needed = min_bytes_needed;
        self.wake = earlier(wake, self.medium.next_wake(min_bytes_needed));
    }

    /// Processes one instant: all nodes receive, then advance, then transmit.
    fn process_instant(
        &mut self,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        let (slots, near) = (&mut self.slots, &mut self.near);
        let eager = self.min_bytes_needed.is_some();
        let received = self.medium.receive(now, eager, |receiver, piece| {
            if receiver == NEAR {
                near.push_piece(piece);
            } else {
                let slot = &mut slots[receiver - 1];
                slot.node.receive(piece);
                slot.received = true;
            }
        });
        if !received && self.wake.is_none_or(|wake| wake > now) {
            return Ok(());
        }
        for (index, slot) in self.slots.iter_mut().enumerate() {
            let received = std::mem::take(&mut slot.received);
            if !received && slot.wake.is_none_or(|wake| wake > now) {
                continue;
            }
            slot.node.advance(now, plant)?;
            loop {
                self.tx.clear();
                let tx = slot.node.poll_transmit_framed(&mut self.tx);
                let Some((start, framing_error)) = tx else {
                    break;
                };
                let piece = Piece {
                    first: start.max(now) + self.medium.byte_time(),
                    spacing: self.medium.byte_time(),
                    bytes: &self.tx,
                    framing_error,
                };
                self.medium.transmit(index + 1, piece);
            }
            slot.refresh();
        }
        self.update_wake();
        Ok(())
    }
}

impl Part for Rs485 {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        for slot in &mut self.slots {
            slot.node.connect(owner, plant)?;
            slot.refresh();
        }
        self.update_wake();
        Ok(())
    }

    fn diagnostics(&self) -> Vec<Port> {
        let collisions = Port::output(format!("{}/collisions", self.name), Unit::One, 1);
        let nodes = self.slots.iter().flat_map(|slot| slot.node.diagnostics());
        std::iter::once(collisions).chain(nodes).collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let Some((collisions, mut rest)) = values.split_first_mut() else {
            return;
        };
        *collisions = self.medium.collisions() as f64;
        for slot in &self.slots {
            let (values, after) = rest.split_at_mut(slot.width);
            slot.node.read_diagnostics(now, values);
            rest = after;
        }
    }

    fn report_health(&self, health: &mut BusHealth) {
        for slot in &self.slots {
            slot.node.report_health(health);
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            medium: self.medium.clone(),
            near: self.near.clone(),
            nodes: self.slots.iter().map(|slot| slot.node.save()).collect(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        if saved.nodes.len() != self.slots.len()
            || saved.medium.stations() != self.medium.stations()
        {
            return Err(SnapshotError::Mismatch {
                expected: format!("a bus of {} nodes", self.slots.len()),
                found: format!("one of {}", saved.nodes.len()),
            });
        }
        for (slot, snapshot) in self.slots.iter_mut().zip(&saved.nodes) {
            slot.node.restore(snapshot)?;
            slot.refresh();
        }
        (self.medium, self.near) = (saved.medium, saved.near);
        self.update_wake();
        Ok(())
    }
}

impl Line for Rs485 {
    fn send(&mut self, piece: Piece<'_>) {
        self.medium.transmit(NEAR, piece);
        self.update_wake();
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.wake
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while let Some(wake) = self.wake.filter(|wake| *wake < now) {
            self.process_instant(wake, plant)?;
        }
        self.process_instant(now, plant)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        arrivals.append(&mut self.near);
    }
}
