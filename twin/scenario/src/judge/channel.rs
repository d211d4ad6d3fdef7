//! What a judge is fed with: samples of channels, and events of cycles.

use twinrig_kernel::Layout;

/// Where samples come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The outputs of the plant.
    Plant,
    /// What the controller is told.
    ProcessInputs,
    /// What the controller says.
    ProcessOutputs,
    /// What drivers and boards count.
    Diagnostics,
}

/// How the samples of each channel are laid out.
#[derive(Clone, Copy, Debug)]
pub struct Layouts<'l> {
    /// Of [`Channel::Plant`].
    pub plant: &'l Layout,
    /// Of [`Channel::ProcessInputs`].
    pub process_inputs: &'l Layout,
    /// Of [`Channel::ProcessOutputs`].
    pub process_outputs: &'l Layout,
    /// Of [`Channel::Diagnostics`].
    pub diagnostics: &'l Layout,
    /// The names of the tasks, which [`CycleSource::Task`] numbers: those of buses.
    pub tasks: &'l [String],
}

impl Layouts<'_> {
    /// Channels and their layouts, in the order in which a signal is looked for.
    pub(super) fn channels(&self) -> [(Channel, &Layout); 4] {
        [
            (Channel::Plant, self.plant),
            (Channel::ProcessInputs, self.process_inputs),
            (Channel::ProcessOutputs, self.process_outputs),
            (Channel::Diagnostics, self.diagnostics),
        ]
    }
}

/// Whose cycle something happens to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CycleSource {
    /// The controller's.
    Control,
    /// That of the task of this number.
    Task(usize),
}

/// What happens to a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CycleEvent {
    /// A cycle begins.
    CycleBegin,
    /// It ends.
    CycleEnd,
    /// A cycle could not begin when it should have: the last one had not ended.
    CycleMissed,
}
