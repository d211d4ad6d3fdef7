use serde::{Deserialize, Serialize};
use twinrig_kernel::{
    Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit,
};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};

use crate::error::nonzero;
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
    nodes: Vec<Box<dyn Node>>,
    medium: Medium,
    /// What the near end has heard and not taken.
    near: Arrivals,
    /// Which nodes have heard something at this instant.
    heard: Vec<bool>,
    /// What a node just says.
    said: Vec<u8>,
    /// How many values the gauges of each node are.
    widths: Vec<usize>,
    /// When anything happens next: follows from the rest.
    wake: Option<SimTime>,
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
            heard: vec![false; nodes.len()],
            said: Vec::new(),
            widths: nodes.iter().map(|node| width(&node.gauges())).collect(),
            nodes,
            wake: None,
        };
        bus.look_ahead();
        Ok(bus)
    }

    fn look_ahead(&mut self) {
        let attention = self.nodes.iter().filter_map(|node| node.attention()).min();
        let nodes = self.nodes.iter().filter_map(|node| node.next_wake());
        self.wake = nodes.chain(self.medium.next_wake(attention)).min();
    }

    /// Lets everybody hear, then think, then talk.
    fn instant(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        let (nodes, near, heard) = (&mut self.nodes, &mut self.near, &mut self.heard);
        self.medium.hear(now, |hearer, piece| {
            if hearer == NEAR {
                near.push(piece.first, piece.spacing, piece.bytes);
            } else {
                nodes[hearer - 1].hear(piece);
                heard[hearer - 1] = true;
            }
        });
        for (index, node) in self.nodes.iter_mut().enumerate() {
            let heard = std::mem::take(&mut self.heard[index]);
            if !heard && node.next_wake().is_none_or(|wake| wake > now) {
                continue;
            }
            node.advance(now, world)?;
            loop {
                self.said.clear();
                let Some(start) = node.poll_transmit(&mut self.said) else {
                    break;
                };
                let piece = Piece {
                    first: start.max(now) + self.medium.byte_time(),
                    spacing: self.medium.byte_time(),
                    bytes: &self.said,
                };
                self.medium.say(index + 1, piece);
            }
        }
        self.look_ahead();
        Ok(())
    }
}

/// How many values those gauges are.
fn width(gauges: &[Port]) -> usize {
    Layout::of(gauges, Direction::Output).len()
}

impl Line for Rs485 {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let mut nodes = self.nodes.iter_mut();
        nodes.try_for_each(|node| node.connect(owner, plant))?;
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

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        while let Some(wake) = self.wake.filter(|wake| *wake < now) {
            self.instant(wake, world)?;
        }
        self.instant(now, world)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        arrivals.append(&mut self.near);
    }

    fn gauges(&self) -> Vec<Port> {
        let own = Port::output(format!("{}/collisions", self.name), Unit::One, 1);
        let nodes = self.nodes.iter().flat_map(|node| node.gauges());
        std::iter::once(own).chain(nodes).collect()
    }

    fn read_gauges(&self, now: SimTime, values: &mut [f64]) {
        let Some((own, mut rest)) = values.split_first_mut() else {
            return;
        };
        *own = self.medium.collisions() as f64;
        for (node, width) in self.nodes.iter().zip(&self.widths) {
            let (values, after) = rest.split_at_mut(*width);
            node.read_gauges(now, values);
            rest = after;
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            medium: self.medium.clone(),
            near: self.near.clone(),
            nodes: self.nodes.iter().map(|node| node.save()).collect(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        if saved.nodes.len() != self.nodes.len() || saved.medium.talkers() != self.medium.talkers()
        {
            return Err(SnapshotError::Mismatch {
                expected: format!("a bus of {} nodes", self.nodes.len()),
                found: format!("one of {}", saved.nodes.len()),
            });
        }
        for (node, snapshot) in self.nodes.iter_mut().zip(&saved.nodes) {
            node.restore(snapshot)?;
        }
        (self.medium, self.near) = (saved.medium, saved.near);
        self.look_ahead();
        Ok(())
    }
}
