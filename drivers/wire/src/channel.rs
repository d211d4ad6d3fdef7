use twinrig_runtime::{FaultDirection, FaultKind};

use crate::Fault;

/// Direction at a place, as faults have it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channel {
    /// Name of the random streams.
    pub(crate) name: &'static str,
    pub(crate) direction: FaultDirection,
    /// Whether babbling is received here.
    pub(crate) babbles: bool,
    /// Whether it is the stub of a board, which a loss of its supply interrupts.
    of_board: bool,
}

impl Channel {
    pub(crate) const LINE_OUT: Self = Self::new("out", FaultDirection::Out, true, false);
    pub(crate) const LINE_IN: Self = Self::new("in", FaultDirection::In, true, false);
    pub(crate) const NODE_RX: Self = Self::new("heard", FaultDirection::Out, false, true);
    pub(crate) const NODE_TX: Self = Self::new("said", FaultDirection::In, true, true);

    const fn new(
        name: &'static str,
        direction: FaultDirection,
        babbles: bool,
        of_board: bool,
    ) -> Self {
        Self {
            name,
            direction,
            babbles,
            of_board,
        }
    }

    /// Whether a fault harms bytes here, at the place `on`.
    pub(crate) fn reaches(&self, on: &str, fault: &Fault) -> bool {
        match fault.kind {
            FaultKind::Drift { .. } => false,
            FaultKind::BrownOut { .. } => self.of_board && fault.strikes(on),
            _ => fault.on == on,
        }
    }
}
