use twinrig_runtime::FaultDirection;

/// Direction at a place, as faults have it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channel {
    /// Name of the random streams.
    pub(crate) name: &'static str,
    pub(crate) direction: FaultDirection,
    /// Whether babbling is received here.
    pub(crate) babbles: bool,
}

impl Channel {
    pub(crate) const LINE_OUT: Self = Self::new("out", FaultDirection::Out, true);
    pub(crate) const LINE_IN: Self = Self::new("in", FaultDirection::In, true);
    pub(crate) const NODE_RX: Self = Self::new("heard", FaultDirection::Out, false);
    pub(crate) const NODE_TX: Self = Self::new("said", FaultDirection::In, true);

    const fn new(name: &'static str, direction: FaultDirection, babbles: bool) -> Self {
        Self {
            name,
            direction,
            babbles,
        }
    }
}
