//! Footsteps of a recording, by leg.

use crate::{FootstepMessage, RecordError, Recording};

/// A footstep read from a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedFootstep {
    /// Time of touch-down, since the start of the run \[s\].
    pub touch_down_s: f64,
    /// Time of lift-off \[s\].
    pub lift_off_s: f64,
    /// Position of the foot at touch-down, world frame \[m\]; `None` if it was not recorded.
    pub position_m: Option<[f64; 3]>,
}

/// Returns the footsteps of each leg in order of time; legs in the order of their first footstep
/// message.
pub(super) fn footsteps(
    recording: &Recording,
) -> Result<Vec<(String, Vec<RecordedFootstep>)>, RecordError> {
    let mut legs: Vec<(String, Vec<RecordedFootstep>)> = Vec::new();
    for (_, message) in recording.messages::<FootstepMessage>()? {
        let footstep = RecordedFootstep {
            touch_down_s: message.touch_down_s,
            lift_off_s: message.lift_off_s,
            position_m: message.position_m,
        };
        match legs.iter_mut().find(|(leg, _)| *leg == message.leg) {
            Some((_, footsteps)) => footsteps.push(footstep),
            None => legs.push((message.leg, vec![footstep])),
        }
    }
    for (_, footsteps) in &mut legs {
        footsteps.sort_by(|a, b| a.touch_down_s.total_cmp(&b.touch_down_s));
    }
    Ok(legs)
}
