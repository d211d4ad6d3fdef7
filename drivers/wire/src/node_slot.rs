use twinrig_kernel::{Direction, Layout, SimDuration};

use crate::{Addresses, Node, Piece};

/// Node with cached properties.
pub(crate) struct NodeSlot {
    pub(crate) node: Box<dyn Node>,
    /// Whether it has received bytes at this instant.
    pub(crate) received: bool,
    /// Its [`Node::min_bytes_needed`] and [`Node::listens_to`], updated whenever it was advanced.
    pub(crate) min_bytes_needed: Option<usize>,
    pub(crate) addresses: Option<Addresses>,
    /// Number of values of its diagnostics.
    pub(crate) width: usize,
}

impl NodeSlot {
    pub(crate) fn new(node: Box<dyn Node>, byte_time: SimDuration) -> Self {
        let mut slot = Self {
            received: false,
            min_bytes_needed: None,
            addresses: None,
            width: Layout::of(&node.diagnostics(), Direction::Output).len(),
            node,
        };
        slot.refresh(byte_time);
        slot
    }

    pub(crate) fn receive(&mut self, piece: Piece<'_>) {
        self.node.receive(piece);
        self.received = true;
    }

    /// Whether a packet to this address must be received; any that comes with others at one
    /// instant.
    pub(crate) fn listens_to(&self, address: u16) -> bool {
        match self.addresses {
            Some(addresses) if !self.received => addresses.contains(address),
            _ => true,
        }
    }

    pub(crate) fn refresh(&mut self, byte_time: SimDuration) {
        self.addresses = self.node.listens_to(byte_time);
        self.min_bytes_needed = self.node.min_bytes_needed();
    }
}
