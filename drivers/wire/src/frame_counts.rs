use twinrig_kernel::SimDuration;

use crate::TrafficError;

/// When frames of a device are expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pacing {
    /// Answers, to requests of this period.
    Requests(SimDuration),
    /// Frames that the device transmits unasked with this period.
    Frames(SimDuration),
}

/// Counts of a protocol: accepted answers and frames, and errors by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Answers and frames accepted.
    pub accepted: u64,
    /// Number of errors of each kind; each kind at most once, in a fixed order.
    pub errors: [Option<(TrafficError, u64)>; FrameCounts::KINDS],
}

impl FrameCounts {
    /// Maximum number of kinds of errors.
    pub const KINDS: usize = 6;

    /// Returns the counts of accepted frames and of errors.
    ///
    /// # Panics
    /// If there are more than [`FrameCounts::KINDS`] kinds.
    pub fn new(accepted: u64, errors: &[(TrafficError, u64)]) -> Self {
        let mut counts = Self {
            accepted,
            ..Self::default()
        };
        let places = &mut counts.errors[..errors.len()];
        for (place, error) in places.iter_mut().zip(errors) {
            *place = Some(*error);
        }
        counts
    }
}
