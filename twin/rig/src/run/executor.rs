//! Common interface of the rigs in virtual time and on hardware, for observers.

use twinrig_kernel::{Layout, SimTime};
use twinrig_runtime::real_time::RealTimeRig;
use twinrig_runtime::{Group, Process, Rig};

/// Layouts and names of the indices that observers receive.
pub trait Executor {
    /// Returns the layout of the values of a group.
    fn layout(&self, group: Group) -> &Layout;
    /// Returns the names of the byte traces.
    fn traces(&self) -> &[String];
    /// Returns the names of the tasks.
    fn tasks(&self) -> Vec<String>;
    /// Returns the process.
    fn process(&self) -> &dyn Process;
    /// Returns whether boards and plant are hardware, so that the run cannot be replayed.
    fn on_hardware(&self) -> bool;
    /// Returns the time at which the plant was exchanged, so that the run cannot be replayed from
    /// the start.
    fn exchanged(&self) -> Option<SimTime> {
        None
    }
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
    fn process(&self) -> &dyn Process {
        self.process()
    }
    fn on_hardware(&self) -> bool {
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
    fn process(&self) -> &dyn Process {
        self.process()
    }
    fn on_hardware(&self) -> bool {
        true
    }
}
