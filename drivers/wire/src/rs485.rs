use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    BusHealth, BusWork, DriverPhase, Part, PlantAccess, PlantSignals, TaskError, WiringError,
};

use crate::error::nonzero;
use crate::line::earlier;
use crate::medium::{Medium, NEAR, Needs, Receivers};
use crate::node_slot::NodeSlot;
use crate::node_wakes::NodeWakes;
use crate::{Addresses, Arrivals, Line, Node, Piece, WireError};

/// Function for the address of a packet: see [`Rs485::with_packets`].
pub type Recipient = fn(&[u8]) -> Option<u16>;

/// Half-duplex bus with several nodes, seen from its near end, which is a station like the others.
///
/// Overlapping transmissions are garbled: the other receivers lock onto the byte that began first,
/// sample the AND of all levels in the middle of its bits, and miss the bytes that begin meanwhile.
/// So there are never more bytes received than transmitted, and equal bytes transmitted
/// simultaneously are received unchanged. A station receives nothing while it transmits; the near
/// end nothing until the turnaround time of its transceiver has passed.
///
/// On a bus with packets ([`Rs485::with_packets`]) nodes receive no packets to which they do not
/// listen, and an undisturbed answer may be passed to the near end as a whole
/// ([`Line::take_packet`]). Everything else, and all on other buses, is computed byte by byte; the
/// results are the same.
pub struct Rs485 {
    name: String,
    slots: Vec<NodeSlot>,
    /// [`Node::next_wake`] of each node, updated whenever it was advanced.
    wakes: NodeWakes,
    /// Nodes to be advanced at this instant.
    due: Vec<usize>,
    medium: Medium,
    /// Bytes received by the near end and not taken.
    near: Arrivals,
    /// Transmission just polled from a node.
    tx: Vec<u8>,
    /// Bytes on which a node may react.
    needs: Needs,
    /// Returns the address of the packet of which the bytes consist, if they are exactly one.
    recipient: Option<Recipient>,
    /// An answer that the near end may take as a whole. The bytes are those of `packet_bytes`.
    packet: Option<HeldPacket>,
    packet_bytes: Vec<u8>,
    /// Whether every node needs nothing but packets to one address.
    is_addressed: bool,
    /// Whether nothing but the near end transmits, undisturbed.
    is_undisturbed: bool,
    work: BusWork,
    /// Times of the next event of the nodes, on the wires, and of both; derived from the other
    /// fields.
    node_wake: Option<SimTime>,
    medium_wake: Option<SimTime>,
    wake: Option<SimTime>,
}

/// Answer that is not on the wires yet.
#[derive(Clone, Copy)]
struct HeldPacket {
    /// Index of the node.
    from: usize,
    /// Completion time of the first byte.
    first: SimTime,
    address: u16,
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
        let slots = nodes.into_iter().map(|node| NodeSlot::new(node, byte_time));
        let slots: Vec<_> = slots.collect();
        let mut bus = Self {
            name: name.to_owned(),
            wakes: NodeWakes::new(slots.len()),
            due: Vec::with_capacity(slots.len()),
            medium: Medium::new(byte_time, turnaround, slots.len()),
            near: Arrivals::default(),
            tx: Vec::new(),
            slots,
            needs: Needs::default(),
            recipient: None,
            packet: None,
            packet_bytes: Vec::new(),
            is_addressed: false,
            is_undisturbed: true,
            work: BusWork::default(),
            node_wake: None,
            medium_wake: None,
            wake: None,
        };
        bus.refresh();
        Ok(bus)
    }

    /// Computes undisturbed packets as a whole. `recipient` returns the address of the packet of
    /// which a transmission consists; none if it is not exactly one.
    #[must_use]
    pub fn with_packets(self, recipient: Recipient) -> Self {
        Self {
            recipient: Some(recipient),
            ..self
        }
    }

    /// Updates everything that is derived.
    fn refresh(&mut self) {
        for (index, slot) in self.slots.iter_mut().enumerate() {
            slot.refresh(self.medium.byte_time());
            self.wakes.set(index, slot.node.next_wake());
        }
        self.update_wake();
    }

    fn update_wake(&mut self) {
        let mut needs = Needs {
            bytes: None,
            packets: self.recipient.is_some(),
        };
        self.is_addressed = needs.packets;
        for slot in &self.slots {
            needs.packets &= slot.addresses.is_some();
            self.is_addressed &= slot.addresses.is_some_and(Addresses::is_one);
            needs.bytes = match (needs.bytes, slot.min_bytes_needed) {
                (Some(least), Some(count)) => Some(least.min(count)),
                (least, count) => least.or(count),
            };
        }
        self.needs = needs;
        self.is_addressed &= needs.bytes.is_none();
        self.update_node_wake();
        self.update_medium_wake();
    }

    fn update_node_wake(&mut self) {
        self.node_wake = self.wakes.next();
        self.wake = earlier(self.node_wake, self.medium_wake);
    }

    fn update_medium_wake(&mut self) {
        self.is_undisturbed = self.medium.is_undisturbed();
        // A packet that is not taken is on the wires from its first byte on.
        let packet = self.packet.map(|packet| packet.first);
        self.medium_wake = earlier(packet, self.medium.next_wake(&self.needs));
        self.wake = earlier(self.node_wake, self.medium_wake);
    }

    /// Processes one instant: all nodes receive, then advance, then transmit.
    fn process_instant(
        &mut self,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        self.work.instants += 1;
        self.transmit_packet();
        let (slots, near) = (&mut self.slots, &mut self.near);
        let (is_addressed, work) = (&mut self.is_addressed, &mut self.work);
        let received = self
            .medium
            .receive(now, &self.needs, |receivers, piece| match receivers {
                Receivers::One(NEAR) => near.push_piece(piece),
                Receivers::One(receiver) => {
                    slots[receiver - 1].receive(piece);
                    work.received += 1;
                    *is_addressed = false;
                }
                Receivers::Nodes { but, packet } => {
                    let others = slots.iter_mut().enumerate();
                    let others = others.filter(|(index, _)| index + 1 != but);
                    for (_, slot) in others {
                        if packet.is_none_or(|address| slot.listens_to(address)) {
                            slot.receive(piece);
                            work.received += 1;
                        }
                    }
                    *is_addressed &= packet.is_some();
                }
            });
        if received || self.wake.is_some_and(|wake| wake <= now) {
            self.advance_nodes(now, received, plant)?;
            self.update_wake();
        }
        Ok(())
    }

    /// Advances the nodes that must act now or, if any have, `received` bytes, and begins their
    /// transmissions; returns whether there are any.
    fn advance_nodes(
        &mut self,
        now: SimTime,
        received: bool,
        plant: &mut dyn PlantAccess,
    ) -> Result<bool, TaskError> {
        let byte_time = self.medium.byte_time();
        let mut transmits = false;
        self.due.clear();
        self.wakes.take_due(now, &mut self.due);
        if received {
            for (index, slot) in self.slots.iter_mut().enumerate() {
                if std::mem::take(&mut slot.received) {
                    self.due.push(index);
                }
            }
            self.due.sort_unstable();
            self.due.dedup();
        }
        for &index in &self.due {
            let slot = &mut self.slots[index];
            slot.node.advance(now, plant)?;
            loop {
                self.tx.clear();
                let tx = slot.node.poll_transmit_framed(&mut self.tx);
                let Some((start, framing_error)) = tx else {
                    break;
                };
                transmits = true;
                self.work.transmissions += 1;
                let start = start.max(now);
                let piece = Piece {
                    first: start + byte_time,
                    spacing: byte_time,
                    bytes: &self.tx,
                    framing_error,
                };
                let address = self.recipient.and_then(|of| of(&self.tx));
                // No other node has received anything since it was seen to listen to its address
                // only, and this one answers once.
                let may_hold = self.is_addressed && self.packet.is_none() && !framing_error;
                let is_own = |address: &u16| slot.addresses == Some(Addresses::one(*address));
                let held = address.filter(|address| may_hold && is_own(address));
                if let Some(address) = held.filter(|_| self.medium.is_clear(start)) {
                    self.packet = Some(HeldPacket {
                        from: index,
                        first: piece.first,
                        address,
                    });
                    self.packet_bytes.clone_from(&self.tx);
                } else {
                    transmit(self.packet.take(), &self.packet_bytes, &mut self.medium);
                    self.medium.transmit(index + 1, piece, address);
                }
            }
            slot.refresh(byte_time);
            self.wakes.set(index, slot.node.next_wake());
        }
        Ok(transmits)
    }

    /// Puts the packet that was not taken on the wires, to be received byte by byte.
    fn transmit_packet(&mut self) {
        transmit(self.packet.take(), &self.packet_bytes, &mut self.medium);
    }
}

/// Puts a packet on the wires, if there is one.
fn transmit(of: Option<HeldPacket>, bytes: &[u8], medium: &mut Medium) {
    if let Some(held) = of {
        let piece = packet(held.first, medium.byte_time(), bytes);
        medium.transmit(held.from + 1, piece, Some(held.address));
    }
}

/// Returns a packet whose first byte is complete at `first`.
fn packet(first: SimTime, spacing: SimDuration, bytes: &[u8]) -> Piece<'_> {
    Piece {
        first,
        spacing,
        bytes,
        framing_error: false,
    }
}

impl Part for Rs485 {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        for slot in &mut self.slots {
            slot.node.connect(owner, plant)?;
        }
        self.refresh();
        Ok(())
    }

    fn begin_phase(&mut self, now: SimTime, phase: DriverPhase) {
        for slot in &mut self.slots {
            slot.node.begin_phase(now, phase);
        }
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

    fn count_work(&self, work: &mut BusWork) {
        *work = self.work;
    }

    fn report_health(&self, health: &mut BusHealth) {
        for slot in &self.slots {
            slot.node.report_health(health);
        }
    }

    fn save(&self) -> Snapshot {
        let mut medium = self.medium.clone();
        transmit(self.packet, &self.packet_bytes, &mut medium);
        Snapshot::of(&Saved {
            medium,
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
        }
        (self.medium, self.near) = (saved.medium, saved.near);
        self.packet = None;
        self.refresh();
        Ok(())
    }
}

impl Line for Rs485 {
    fn send(&mut self, piece: Piece<'_>) {
        self.transmit_packet();
        let address = self.recipient.and_then(|of| of(piece.bytes));
        self.medium.transmit(NEAR, piece, address);
        self.update_medium_wake();
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

    fn run_ahead(
        &mut self,
        mut now: SimTime,
        before: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<SimTime, TaskError> {
        // Bytes from a node are visible at the near end, and disturbed ones to the nodes.
        if !self.is_announced() {
            return Ok(now);
        }
        let before = self.medium_wake.map_or(before, |wake| wake.min(before));
        while let Some(at) = self.node_wake.filter(|at| *at < before)
            && plant.run_ahead(at)
        {
            now = at;
            self.work.instants += 1;
            if self.advance_nodes(now, false, plant)? {
                self.update_wake();
                break;
            }
            self.update_node_wake();
        }
        Ok(now)
    }

    fn is_announced(&self) -> bool {
        self.is_addressed && self.is_undisturbed
    }

    fn is_quiet(&self) -> bool {
        self.is_addressed && self.packet.is_none() && self.medium.is_idle()
    }

    fn take_packet(&mut self, accept: &mut dyn FnMut(Piece<'_>) -> bool) {
        let Some(held) = self.packet else {
            return;
        };
        let spacing = self.medium.byte_time();
        if accept(packet(held.first, spacing, &self.packet_bytes)) {
            self.work.packets += 1;
            self.packet = None;
        } else {
            self.transmit_packet();
        }
        self.update_medium_wake();
    }
}
