use twinrig_kernel::{SimDuration, SimTime};

/// Sees everything that a run does, in order: what records, fingerprints or judges it.
///
/// Statically dispatched; an observer that does nothing costs nothing. `()` is one.
pub trait Observer {
    /// The values of a group at `now`, laid out as [`crate::Rig::layout`] says.
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]);

    /// Something happened.
    fn event(&mut self, now: SimTime, event: RunEvent);

    /// Bytes passed on a lane of a task, one of [`crate::Rig::traces`].
    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        let _ = (now, trace, bytes);
    }
}

/// Signals that are seen together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Group {
    /// Outputs of the plant, on the observation grid.
    Plant,
    /// What the process reads, at the beginning of each iteration.
    ProcessInputs,
    /// What the process wrote, at the end of each iteration.
    ProcessOutputs,
    /// Counters of drivers and boards, on the observation grid, after the plant.
    Diagnostics,
}

/// What happens in a run. Tasks and variables are numbers in the order of [`crate::Rig::task_names`] and
/// [`crate::Process::variables`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RunEvent {
    /// All devices are ready, later than at time 0: the plant is let go, and the first control step is now.
    Opened,
    /// The process begins an iteration.
    ProcessBegin {
        /// Physical time since it began the last one; zero at the first.
        elapsed: SimDuration,
    },
    /// The process has ended its iteration.
    ProcessEnd,
    /// A task begins a transfer.
    TaskBegin {
        /// Which.
        task: usize,
    },
    /// A task has ended its transfer.
    TaskEnd {
        /// Which.
        task: usize,
    },
    /// A task is busy at a control step: it sits this iteration out, and its data come next time.
    TaskSkipped {
        /// Which.
        task: usize,
    },
    /// The process misses a control step: it is still at the last one.
    Overrun {
        /// How many since it began that one, this one included.
        missed: u64,
    },
    /// A process variable was set.
    Change {
        /// Which.
        variable: usize,
        /// To what, in its unit.
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

/// Both see everything, the first first.
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
