//! Context of the expectations of a scenario.

use twinrig_document::{Item, Reported};
use twinrig_kernel::{SimDuration, SimTime};

use crate::scenario::PushSpec;

/// Properties of the scenario that its expectations are checked against.
pub(crate) struct Context<'c> {
    /// Names of the known plants.
    pub plants: Vec<&'c str>,
    /// Duration of the run.
    pub duration: SimDuration,
    /// Time up to which the trajectory is predictable; none: it is not known.
    pub horizon: Option<SimDuration>,
    /// Time of the first change.
    pub first_change: Option<SimTime>,
    /// Pushes, from which the robot may recover.
    pub pushes: &'c [PushSpec],
}

impl Context<'_> {
    /// Returns begin and end of the push with this name.
    pub(super) fn push(&self, name: &str) -> Option<(SimTime, SimTime)> {
        let push = self.pushes.iter().find(|push| push.name == name)?;
        Some((push.at, push.at + push.lasts))
    }
}

/// Reads a time since the start, within the run.
pub(super) fn instant(item: &Item<'_>, context: &Context<'_>) -> Result<SimTime, Reported> {
    let since = item.duration()?;
    if since > context.duration {
        let message = format!("`{}` is later than the end of the run", item.key());
        return Err(item.report(message, format!("the run lasts {}", context.duration)));
    }
    Ok(SimTime::ZERO + since)
}
