//! Drives of the robot in a plan.

use serde::Serialize;
use twinrig_scenario::SetPointKind;

use super::format::ms;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::report::seconds;

/// Drives of the robot, and the course of their set-points.
#[derive(Serialize)]
pub(super) struct Actuator {
    kind: &'static str,
    /// Course of the set-points between commands; none without servos.
    set_point: Option<&'static str>,
    /// Delay that linear set-points add to held ones, in the mean and at most.
    set_point_delay_mean_s: f64,
    set_point_delay_max_s: f64,
}

impl Actuator {
    /// Returns the drives of the robot; none for a standalone model.
    pub(super) fn of(assembly: &Assembly<'_>) -> Option<Self> {
        assembly.body().robot()?;
        let spec = &assembly.scenario().actuator;
        let set_point = spec.set_point;
        let delays = set_point.map(|course| course.added_delays(assembly.period()));
        let delays = delays.unwrap_or_default();
        let [mean, max] = delays.map(|delay| seconds(delay.as_nanos()));
        Some(Self {
            kind: spec.kind.name(),
            set_point: set_point.map(SetPointKind::name),
            set_point_delay_mean_s: mean,
            set_point_delay_max_s: max,
        })
    }

    /// Returns the kind of the drives, and the course of their set-points with the delay it adds.
    pub(super) fn describe(&self) -> String {
        let kind = self.kind;
        let Some(course) = self.set_point else {
            return kind.to_owned();
        };
        let (mean, max) = (self.set_point_delay_mean_s, self.set_point_delay_max_s);
        if max == 0.0 {
            return format!("{kind}, {course} set-points");
        }
        let (mean, max) = (ms(mean), ms(max));
        format!(
            "{kind}, {course} set-points: later than held ones by {mean} in the mean, {max} at most"
        )
    }
}
