//! What runs a scene, as those see it who look on: in virtual time or at hardware.

use twinrig_kernel::{Layout, SimTime};
use twinrig_runtime::real_time::RealTimeRig;
use twinrig_runtime::{Group, Process, Rig};

/// What an observer is told by numbers, by name.
pub(crate) trait Executor {
    /// How the values of a group lie.
    fn layout(&self, group: Group) -> &Layout;
    /// The names of the lanes of bytes.
    fn traces(&self) -> &[String];
    /// The names of the tasks.
    fn tasks(&self) -> Vec<String>;
    /// The names of the process variables.
    fn variables(&self) -> Vec<String>;
    /// Whether boards and plant are hardware, so that nobody can do the same again.
    fn at_hardware(&self) -> bool;
    /// When its plant took the place of another, so that nobody can do the same from the start.
    fn exchanged(&self) -> Option<SimTime> {
        None
    }
}

fn variables(process: &dyn Process) -> Vec<String> {
    let variables = process.variables().iter();
    variables
        .map(|variable| variable.name().to_owned())
        .collect()
}

impl Executor for Rig {
    fn layout(&self, group: Group) -> &Layout {
        self.layout(group)
    }
    fn traces(&self) -> &[String] {
        self.traces()
    }
    fn tasks(&self) -> Vec<String> {
        self.task_names().map(str::to_owned).collect()
    }
    fn variables(&self) -> Vec<String> {
        variables(self.process())
    }
    fn at_hardware(&self) -> bool {
        false
    }
    fn exchanged(&self) -> Option<SimTime> {
        self.exchanged()
    }
}

impl Executor for RealTimeRig {
    fn layout(&self, group: Group) -> &Layout {
        self.layout(group)
    }
    fn traces(&self) -> &[String] {
        self.traces()
    }
    fn tasks(&self) -> Vec<String> {
        self.task_names().map(str::to_owned).collect()
    }
    fn variables(&self) -> Vec<String> {
        variables(self.process())
    }
    fn at_hardware(&self) -> bool {
        true
    }
}
