use serde::{Deserialize, Serialize};
use twinrig_kernel::{
    Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit,
};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};

use crate::error::nonzero;
use crate::line::earlier;
use crate::medium::{Medium, NEAR};
use crate::{Arrivals, Line, Node, Piece, WireError};

/// A half-duplex bus with several nodes, seen from its near end, which is a talker like any other.
///
/// Who talks while another does garbles what overlaps: the receivers of the others lock onto the byte that began first,
/// sample the AND of all levels in the middle of its bits, and miss the bytes that begin meanwhile. So there
/// are never more bytes than were said, and what two say alike and at once is heard as said. Who talks hears nothing;
/// the near end neither until its transceiver has turned round.
pub struct Rs485 {
    name: String,
    seats: Vec<NodeSlot>,
    medium: Medium,
    /// What the near end has heard and not taken.
    near: Arrivals,
    /// What a node just says.
    said: Vec<u8>,
    /// The least attention that any node pays.
    attention: Option<usize>,
    /// When anything happens next: follows from the rest.
    wake: Option<SimTime>,
}

/// A node, and what the bus has to know of it.
struct NodeSlot {
    node: Box<dyn Node>,
    /// Whether it has heard something at this instant.
    heard: bool,
    /// Its [`Node::next_wake`] and [`Node::attention`]: asked for whenever it was advanced.
    wake: Option<SimTime>,
    attention: Option<usize>,
    /// How many values its gauges are.
    width: usize,
}

impl NodeSlot {
    fn new(node: Box<dyn Node>) -> Self {
        let mut seat = Self {
            heard: false,
            wake: None,
            attention: None,
            width: Layout::of(&node.diagnostics(), Direction::Output).len(),
            node,
        };
        seat.ask();
        seat
    }

    fn ask(&mut self) {
        self.wake = self.node.next_wake();
        self.attention = self.node.attention();
    }
}

#[derive(Serialize, Deserialize)]
struct Saved {
    medium: Medium,
    near: Arrivals,
    nodes: Vec<Snapshot>,
}

impl Rs485 {
    /// A bus on which a byte takes `byte_time`, and whose near end hears nothing until `turnaround` after it has talked
    /// itself. `name` is for its gauge, bytes that met another: `sbcp/collisions`.
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
            said: Vec::new(),
            seats: nodes.into_iter().map(NodeSlot::new).collect(),
            attention: None,
            wake: None,
        };
        bus.look_ahead();
        Ok(bus)
    }

    fn look_ahead(&mut self) {
        let (mut wake, mut attention) = (None, None::<usize>);
        for seat in &self.seats {
            wake = earlier(wake, seat.wake);
            attention = match (attention, seat.attention) {
                (Some(least), Some(count)) => Some(least.min(count)),
                (least, count) => least.or(count),
            };
        }
        self.attention = attention;
        self.wake = earlier(wake, self.medium.next_wake(attention));
    }

    /// Lets everybody hear, then think, then talk.
    fn instant(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        let (seats, near) = (&mut self.seats, &mut self.near);
        let eager = self.attention.is_some();
        let heard = self.medium.receive(now, eager, |hearer, piece| {
            if hearer == NEAR {
                near.push_piece(piece);
            } else {
                let seat = &mut seats[hearer - 1];
                seat.node.receive(piece);
                seat.heard = true;
            }
        });
        if !heard && self.wake.is_none_or(|wake| wake > now) {
            return Ok(());
        }
        for (index, seat) in self.seats.iter_mut().enumerate() {
            let heard = std::mem::take(&mut seat.heard);
            if !heard && seat.wake.is_none_or(|wake| wake > now) {
                continue;
            }
            seat.node.advance(now, plant)?;
            loop {
                self.said.clear();
                let said = seat.node.poll_transmit_framed(&mut self.said);
                let Some((start, framing_error)) = said else {
                    break;
                };
                let piece = Piece {
                    first: start.max(now) + self.medium.byte_time(),
                    spacing: self.medium.byte_time(),
                    bytes: &self.said,
                    framing_error,
                };
                self.medium.say(index + 1, piece);
            }
            seat.ask();
        }
        self.look_ahead();
        Ok(())
    }
}

impl Line for Rs485 {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        for seat in &mut self.seats {
            seat.node.connect(owner, plant)?;
            seat.ask();
        }
        self.look_ahead();
        Ok(())
    }

    fn send(&mut self, piece: Piece<'_>) {
        self.medium.say(NEAR, piece);
        self.look_ahead();
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.wake
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while let Some(wake) = self.wake.filter(|wake| *wake < now) {
            self.instant(wake, plant)?;
        }
        self.instant(now, plant)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        arrivals.append(&mut self.near);
    }

    fn diagnostics(&self) -> Vec<Port> {
        let own = Port::output(format!("{}/collisions", self.name), Unit::One, 1);
        let nodes = self.seats.iter().flat_map(|seat| seat.node.diagnostics());
        std::iter::once(own).chain(nodes).collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let Some((own, mut rest)) = values.split_first_mut() else {
            return;
        };
        *own = self.medium.collisions() as f64;
        for seat in &self.seats {
            let (values, after) = rest.split_at_mut(seat.width);
            seat.node.read_diagnostics(now, values);
            rest = after;
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            medium: self.medium.clone(),
            near: self.near.clone(),
            nodes: self.seats.iter().map(|seat| seat.node.save()).collect(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        if saved.nodes.len() != self.seats.len() || saved.medium.talkers() != self.medium.talkers()
        {
            return Err(SnapshotError::Mismatch {
                expected: format!("a bus of {} nodes", self.seats.len()),
                found: format!("one of {}", saved.nodes.len()),
            });
        }
        for (seat, snapshot) in self.seats.iter_mut().zip(&saved.nodes) {
            seat.node.restore(snapshot)?;
            seat.ask();
        }
        (self.medium, self.near) = (saved.medium, saved.near);
        self.look_ahead();
        Ok(())
    }
}
