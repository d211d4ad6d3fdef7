use twinrig_kernel::{Direction, Layout, SimDuration};

use crate::{Node, Piece};

/// Node with cached properties.
pub(crate) struct NodeSlot {
    pub(crate) node: Box<dyn Node>,
    /// Whether it has received bytes at this instant.
    pub(crate) received: bool,
    /// Its [`Node::min_bytes_needed`] and [`Node::packet_address`], updated whenever it was
    /// advanced.
    pub(crate) min_bytes_needed: Option<usize>,
    pub(crate) address: Option<u16>,
    /// Number of values of its diagnostics.
    pub(crate) width: usize,
}

impl NodeSlot {
    pub(crate) fn new(node: Box<dyn Node>, byte_time: SimDuration) -> Self {
        let mut slot = Self {
            received: false,
            min_bytes_needed: None,
            address: None,
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

    pub(crate) fn refresh(&mut self, byte_time: SimDuration) {
        self.address = self.node.packet_address(byte_time);
        self.min_bytes_needed = self.node.min_bytes_needed();
    }
}
