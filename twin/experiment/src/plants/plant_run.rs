//! Run of a single plant under recorded commands.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Plant, PlantFault};

use crate::incidents::Incidents;
use crate::plants::commands::Commands;
use crate::stopwatch::{Deadline, RunStopwatch};

/// Inputs of a run: commands, duration, sampling period and deadline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlantRun<'a> {
    pub(crate) commands: &'a Commands,
    pub(crate) end: SimTime,
    /// Sampling period.
    pub(crate) grid: SimDuration,
    pub(crate) deadline: Deadline,
    pub(crate) incidents: &'a Incidents,
}

/// Outcome of a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Ending {
    /// The run reached its end time.
    Completed,
    /// The plant reported a fault.
    Fault(PlantFault),
    /// An output or an energy is NaN or infinite.
    NotFinite(SimTime),
    /// The deadline passed.
    OverBudget(SimTime),
    /// The observer stopped the run.
    Stopped(SimTime),
}

impl PlantRun<'_> {
    /// Advances `plant` from time zero to the end. `sample` is called at time zero and at every
    /// multiple of the sampling period, and decides whether the run continues; it is not called at
    /// the end time unless that is such a multiple.
    pub(crate) fn run(
        &self,
        plant: &mut dyn Plant,
        mut sample: impl FnMut(SimTime, &mut dyn Plant) -> SampleVerdict,
    ) -> Ending {
        let ports = plant.ports();
        let inputs = ports
            .iter()
            .filter(|port| port.direction == twinrig_kernel::Direction::Input);
        let mut first = vec![0.0; inputs.map(|port| port.size).sum()];
        plant.initial_inputs(&mut first);
        let mut player = self.commands.player(&ports, first);
        let mut now = SimTime::ZERO;
        let mut due = SimTime::ZERO;
        loop {
            if now == due {
                match sample(now, plant) {
                    SampleVerdict::Continue => {}
                    SampleVerdict::NotFinite => return Ending::NotFinite(now),
                    SampleVerdict::Stop => return Ending::Stopped(now),
                }
                due = match now.checked_add(self.grid) {
                    Some(next) => next,
                    None => return Ending::Completed,
                };
            }
            if due > self.end {
                return Ending::Completed;
            }
            if self.deadline.passed() {
                self.incidents.note_over_budget();
                return Ending::OverBudget(now);
            }
            player.apply_due(now);
            let to = player.next().map_or(due, |next| next.min(due));
            if let Err(fault) = plant.advance(to, player.inputs()) {
                return Ending::Fault(fault);
            }
            now = to;
        }
    }

    /// Measures the run time without sampling \[s\].
    pub(crate) fn timed(&self, plant: &mut dyn Plant) -> (Ending, f64) {
        let stopwatch = RunStopwatch::start();
        let ending = self.run(plant, |_, _| SampleVerdict::Continue);
        (ending, stopwatch.elapsed_s())
    }
}

/// Decision of the observer at a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleVerdict {
    Continue,
    NotFinite,
    Stop,
}
