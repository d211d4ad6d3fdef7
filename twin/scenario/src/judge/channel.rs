//! Layouts of the observed signals, and the cycles whose events a judge observes.

use twinrig_kernel::Layout;
use twinrig_runtime::{Group, RunEvent};

/// Layout of the samples of each group.
#[derive(Clone, Copy, Debug)]
pub struct Layouts<'l> {
    /// Of [`Group::Plant`].
    pub plant: &'l Layout,
    /// Of [`Group::ProcessInputs`].
    pub process_inputs: &'l Layout,
    /// Of [`Group::ProcessOutputs`].
    pub process_outputs: &'l Layout,
    /// Of [`Group::Diagnostics`].
    pub diagnostics: &'l Layout,
    /// Names of the tasks, in the order of their numbers in a [`RunEvent`]: those of buses.
    pub tasks: &'l [String],
}

impl Layouts<'_> {
    /// Groups and their layouts, in the order in which a signal is looked up.
    pub(super) fn groups(&self) -> [(Group, &Layout); 4] {
        [
            (Group::Plant, self.plant),
            (Group::ProcessInputs, self.process_inputs),
            (Group::ProcessOutputs, self.process_outputs),
            (Group::Diagnostics, self.diagnostics),
        ]
    }
}

/// A repeated activity that claims of timing are about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cycle {
    /// Iterations of the controller.
    Control,
    /// Transfers of the task of this number.
    Task(usize),
}

/// An event of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CycleEvent {
    Begin,
    End,
    /// A cycle was due while the last one had not ended.
    Missed,
}

impl CycleEvent {
    /// The cycle and its event; none for events of no cycle.
    pub(super) fn of(event: RunEvent) -> Option<(Cycle, Self)> {
        match event {
            RunEvent::ProcessBegin { .. } => Some((Cycle::Control, Self::Begin)),
            RunEvent::ProcessEnd => Some((Cycle::Control, Self::End)),
            RunEvent::Overrun { .. } => Some((Cycle::Control, Self::Missed)),
            RunEvent::TaskBegin { task } => Some((Cycle::Task(task), Self::Begin)),
            RunEvent::TaskEnd { task } => Some((Cycle::Task(task), Self::End)),
            RunEvent::TaskSkipped { task } => Some((Cycle::Task(task), Self::Missed)),
            RunEvent::Change { .. } | RunEvent::Opened => None,
        }
    }
}
