//! Froude and Strouhal number and cost of transport of a gait, for the report of a run.

use twinrig_kernel::{SimTime, signal};
use twinrig_runtime::Group;

use super::Layouts;
use super::footstep::Footstep;
use super::gait::{Transport, Work};
use super::tracked::Similarity;
use super::tracker::seconds;
use crate::scene::Scene;

/// Observer of a gait of full size.
#[derive(Clone, Debug)]
pub(super) struct GaitNumbers {
    /// Group of the trunk.
    group: Group,
    transport: Transport,
    weight: f64,
    /// Touch-downs of the first leg: the first, the last, and the strides between them.
    strides: Option<(SimTime, SimTime, u32)>,
}

impl GaitNumbers {
    /// Creates the observer; none where nothing observes the trunk.
    pub fn new(scene: &Scene, layouts: &Layouts<'_>) -> Option<Self> {
        let (group, position) = layouts.find(signal::BODY_POSITION)?;
        let together = |name: &str| {
            let found = layouts.find(name).filter(|(other, _)| *other == group);
            found.map(|(_, range)| range.start).ok_or(())
        };
        let yaw = together(signal::BODY_RPY).ok()? + 2;
        let legs = scene.legs.iter().map(|leg| leg.name.as_str());
        let work = Work::of_legs(legs, together).ok();
        Some(Self {
            group,
            transport: Transport::new(position.start, yaw, work),
            weight: scene.weight,
            strides: None,
        })
    }

    /// Evaluates the samples of a group.
    #[inline]
    pub fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group == self.group {
            self.transport.sample(now, values);
        }
    }

    /// Evaluates a completed footstep.
    pub fn footstep(&mut self, step: &Footstep) {
        if step.leg == 0 {
            let now = step.touch_down;
            let (first, _, number) = self.strides.unwrap_or((now, now, 0));
            let number = number + u32::from(first < now);
            self.strides = Some((first, now, number));
        }
    }

    /// Returns the numbers up to now.
    pub fn similarity(&self) -> Similarity {
        let strides = self.strides.filter(|(.., number)| *number > 0);
        let frequency =
            strides.map(|(first, last, number)| f64::from(number) / seconds(last - first));
        let finite = |number: Result<f64, _>| number.ok().filter(|number| number.is_finite());
        Similarity {
            froude: finite(self.transport.froude()),
            strouhal: finite(self.transport.strouhal(frequency)),
            cost_of_transport: finite(self.transport.cost(self.weight)),
        }
    }
}
