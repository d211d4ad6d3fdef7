use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Stream};

use crate::frame_selection::FrameSelection;
use crate::{Fault, FaultKind};

/// Faults drawn for one burst.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct BurstFaults {
    pub(crate) dropped: bool,
    pub(crate) delay: SimDuration,
    pub(crate) copied: bool,
    /// End of the fault that holds the burst back.
    pub(crate) held: Option<SimTime>,
}

impl BurstFaults {
    /// Draws the faults of the burst whose first byte is complete at `at`, and counts them;
    /// `holds`: whether a burst is held back already.
    pub(crate) fn draw(
        faults: &[Fault],
        selection: &mut FrameSelection,
        stream: &mut Stream,
        holds: bool,
        at: SimTime,
    ) -> Self {
        selection.begin_burst(faults, at);
        let mut burst = Self::default();
        for (index, fault) in faults.iter().enumerate() {
            if !selection.is_active(index, fault, at) {
                continue;
            }
            let mut drawn = |probability| stream.unit() < probability;
            let acts = match fault.kind {
                FaultKind::Drop { probability } => {
                    let dropped = drawn(probability);
                    burst.dropped |= dropped;
                    dropped
                }
                FaultKind::Delay { by } => {
                    burst.delay += by;
                    !by.is_zero()
                }
                FaultKind::Duplicate { probability } => {
                    let copied = drawn(probability);
                    burst.copied |= copied;
                    copied
                }
                // One burst at a time: it swaps places with the next one.
                FaultKind::Reorder { probability } => {
                    let held = drawn(probability) && !holds;
                    if held {
                        burst.held = Some(fault.until());
                    }
                    held
                }
                _ => false,
            };
            if acts {
                selection.count(index);
            }
        }
        burst
    }
}
