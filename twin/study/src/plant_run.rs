//! One run of a plant through a scene.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Plant, PlantFault};

use crate::commands::Commands;
use crate::stopwatch::{Deadline, Stopwatch};

/// How a plant is led through a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlantRun<'a> {
    pub(crate) commands: &'a Commands,
    pub(crate) end: SimTime,
    /// It is looked at so often.
    pub(crate) grid: SimDuration,
    pub(crate) deadline: Deadline,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Ending {
    /// It came to the end of the scene.
    Whole,
    /// The plant gave up.
    Fault(PlantFault),
    /// Something was no longer a number.
    NotFinite(SimTime),
    /// Its time was up.
    TooSlow(SimTime),
    /// Whoever looked on had seen enough.
    Enough(SimTime),
}

impl PlantRun<'_> {
    /// Leads `plant` from the start of the scene to its end. `look` sees it at the start and at every instant of the grid, and
    /// says whether to go on; it is not told of the end of the scene if that is not on the grid.
    pub(crate) fn lead(
        &self,
        plant: &mut dyn Plant,
        mut look: impl FnMut(SimTime, &mut dyn Plant) -> Go,
    ) -> Ending {
        let ports = plant.ports();
        let inputs = ports
            .iter()
            .filter(|port| port.direction == twinrig_kernel::Direction::Input);
        let mut first = vec![0.0; inputs.map(|port| port.size).sum()];
        plant.first_inputs(&mut first);
        let mut player = self.commands.player(&ports, first);
        let mut now = SimTime::ZERO;
        let mut due = SimTime::ZERO;
        loop {
            if now == due {
                match look(now, plant) {
                    Go::On => {}
                    Go::NotFinite => return Ending::NotFinite(now),
                    Go::Enough => return Ending::Enough(now),
                }
                due = match now.checked_add(self.grid) {
                    Some(next) => next,
                    None => return Ending::Whole,
                };
            }
            if due > self.end {
                return Ending::Whole;
            }
            if self.deadline.passed() {
                return Ending::TooSlow(now);
            }
            player.arrive(now);
            let to = player.next().map_or(due, |next| next.min(due));
            if let Err(fault) = plant.advance(to, player.inputs()) {
                return Ending::Fault(fault);
            }
            now = to;
        }
    }

    /// The time it takes to lead `plant` through the scene without looking \[s\].
    pub(crate) fn timed(&self, plant: &mut dyn Plant) -> (Ending, f64) {
        let watch = Stopwatch::start();
        let ending = self.lead(plant, |_, _| Go::On);
        (ending, watch.elapsed_s())
    }
}

/// Whether to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Go {
    On,
    NotFinite,
    Enough,
}
