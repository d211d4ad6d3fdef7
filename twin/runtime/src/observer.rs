use twinrig_kernel::{SimDuration, SimTime};

/// Receives the samples and events of a run, in order: a recorder, a fingerprint, a judge.
///
/// Statically dispatched; an observer without code has no cost. `()` is one.
pub trait Observer {
    /// Receives the values of a group at `now`, in the layout of [`crate::Rig::layout`].
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]);

    /// Receives an event.
    fn event(&mut self, now: SimTime, event: RunEvent);

    /// Receives bytes of a byte trace, an index into [`crate::Rig::traces`].
    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        let _ = (now, trace, bytes);
    }
}

/// Signals that are sampled together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Group {
    /// Outputs of the plant, on the observation grid.
    Plant,
    /// Inputs of the process, at the beginning of each iteration.
    ProcessInputs,
    /// Outputs of the process, at the end of each iteration.
    ProcessOutputs,
    /// Diagnostics of drivers and boards, on the observation grid, after the plant.
    Diagnostics,
}

/// Events of a run. Tasks and variables are indices into [`crate::Rig::task_names`] and
/// [`crate::Process::variables`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RunEvent {
    /// All devices are open, later than at time 0: the plant is released, and the first control
    /// step is now.
    Opened,
    /// The process begins an iteration.
    ProcessBegin {
        /// Physical time since the last iteration began; zero at the first.
        elapsed: SimDuration,
    },
    /// The process has ended its iteration.
    ProcessEnd,
    /// A task begins a transfer.
    TaskBegin {
        /// Its index.
        task: usize,
    },
    /// A task has ended its transfer.
    TaskEnd {
        /// Its index.
        task: usize,
    },
    /// A task is busy at a control step: it is skipped in this iteration, and its data are read by
    /// the next.
    TaskSkipped {
        /// Its index.
        task: usize,
        /// Whether the skip follows from the periods: one transfer lasts longer than a control
        /// step ([`crate::IoTask::period`]), and this one is not overdue.
        implied: bool,
    },
    /// The process misses a control step: the last iteration is still running.
    Overrun {
        /// Steps missed since it began, this one included.
        missed: u64,
    },
    /// A process variable was set.
    Change {
        /// Its index.
        variable: usize,
        /// The new value, in its unit.
        value: f64,
    },
}

impl Observer for () {
    fn samples(&mut self, _: SimTime, _: Group, _: &[f64]) {}
    fn event(&mut self, _: SimTime, _: RunEvent) {}
}

impl<O: Observer + ?Sized> Observer for &mut O {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        (**self).samples(now, group, values);
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        (**self).event(now, event);
    }
    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        (**self).bytes(now, trace, bytes);
    }
}

/// Passes everything to both, in order.
impl<A: Observer, B: Observer> Observer for (A, B) {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.0.samples(now, group, values);
        self.1.samples(now, group, values);
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.0.event(now, event);
        self.1.event(now, event);
    }
    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        self.0.bytes(now, trace, bytes);
        self.1.bytes(now, trace, bytes);
    }
}
