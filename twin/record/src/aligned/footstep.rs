//! The footsteps that a recording holds, leg by leg.

use crate::{FootstepMessage, RecordError, Recording};

/// A footstep as a recording holds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedFootstep {
    /// When the foot came down, since the start of the run \[s\].
    pub touch_down_s: f64,
    /// When it left the ground \[s\].
    pub lift_off_s: f64,
    /// Where it came down, world frame \[m\]; none if the recording does not say.
    pub position_m: Option<[f64; 3]>,
}

/// The footsteps of each leg in order of time; legs in the order in which they first came down.
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
