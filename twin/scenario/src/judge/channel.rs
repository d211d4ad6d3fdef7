//! Layouts of the observed signals, and cycles with their events.

use std::ops::Range;

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
    /// Names of the tasks (buses), in the order of their numbers in a [`RunEvent`].
    pub tasks: &'l [String],
}

impl Layouts<'_> {
    /// Returns the layout of a group.
    pub(super) fn layout(&self, group: Group) -> &Layout {
        match group {
            Group::Plant => self.plant,
            Group::ProcessInputs => self.process_inputs,
            Group::ProcessOutputs => self.process_outputs,
            Group::Diagnostics => self.diagnostics,
        }
    }

    /// Returns the groups with their layouts, in the order of the search for a signal.
    pub(super) fn groups(&self) -> [(Group, &Layout); 4] {
        [
            (Group::Plant, self.plant),
            (Group::ProcessInputs, self.process_inputs),
            (Group::ProcessOutputs, self.process_outputs),
            (Group::Diagnostics, self.diagnostics),
        ]
    }

    /// Returns group and range of the signal `name`: that of the plant, or else that of the
    /// controller or of the diagnostics.
    pub(super) fn find(&self, name: &str) -> Option<(Group, Range<usize>)> {
        let mut found = self
            .groups()
            .into_iter()
            .filter_map(|(channel, layout)| Some((channel, layout.find(name)?)));
        found.next()
    }
}

/// Periodic activity that timing claims refer to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cycle {
    /// Iterations of the controller.
    Control,
    /// Transfers of the task with this number.
    Task(usize),
}

/// An event of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CycleEvent {
    Begin,
    End,
    /// A cycle was due while the previous one was running.
    Missed,
    /// So it was, as follows from the periods.
    Waits,
}

impl CycleEvent {
    /// Returns the cycle and its event; none for other events.
    pub(super) fn of(event: RunEvent) -> Option<(Cycle, Self)> {
        match event {
            RunEvent::ProcessBegin { .. } => Some((Cycle::Control, Self::Begin)),
            RunEvent::ProcessEnd => Some((Cycle::Control, Self::End)),
            RunEvent::Overrun { .. } => Some((Cycle::Control, Self::Missed)),
            RunEvent::TaskBegin { task } => Some((Cycle::Task(task), Self::Begin)),
            RunEvent::TaskEnd { task } => Some((Cycle::Task(task), Self::End)),
            RunEvent::TaskSkipped { task, implied } => {
                let event = if implied { Self::Waits } else { Self::Missed };
                Some((Cycle::Task(task), event))
            }
            RunEvent::Change { .. } | RunEvent::Opened => None,
        }
    }
}
