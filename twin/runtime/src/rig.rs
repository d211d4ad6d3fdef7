use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Agenda, Layout, PartId, Port, SimDuration, SimTime, Snapshot, Wake};

use crate::interrupt;
use crate::plant_host::PlantHost;
use crate::process_slot::{ProcessSlot, ProcessSlotState};
use crate::wiring::TaskLinks;
use crate::{
    Change, ControlStep, Group, IoTask, Manager, Observer, PartKind, Plant, Process, Progress,
    RigError, RunEvent, TaskError, TimeSource, in_part,
};

mod assembly;
mod exchange;
mod snapshot;

/// Order of the events of one instant.
mod rank {
    use twinrig_kernel::Rank;

    /// First, transfers end, so that their tasks are idle at a control step at the same instant.
    pub(super) const TASK: Rank = Rank(0);
    /// Then the process ends, so that an iteration of exactly one period is not late.
    pub(super) const PROCESS_END: Rank = Rank(1);
    /// Then the process begins.
    pub(super) const CONTROL_STEP: Rank = Rank(2);
    /// Last, the plant is observed.
    pub(super) const OBSERVATION: Rank = Rank(3);
}

/// A process, its tasks and a plant, wired by name and run in virtual time: the lockstep executor
/// of the scheduling rule ([`Manager`]).
///
/// There are four kinds of events; at one instant they are handled in this order:
///
/// 0. a task continues its transfer;
/// 1. the process ends its iteration, and the tasks that take part begin theirs, in order of
///    registration;
/// 2. a control step: due changes are applied, and the process begins;
/// 3. the plant is observed.
///
/// Before the first control step the tasks open their devices; it occurs at the first multiple of
/// the period at which all are open. The plant is held at its start until then.
///
/// An iteration or a transfer of zero duration ends at the instant of its beginning, before the
/// observation. The plant is advanced to exactly the instants at which a task samples or actuates
/// and to those of the observation grid, under the commands last applied, at first the plant's
/// initial ones. Another observation period is therefore another run, unless the plant's own step
/// divides both.
pub struct Rig {
    process: ProcessSlot,
    tasks: Vec<TaskSlot>,
    plant_host: PlantHost,
    state: RigState,
    /// Diagnostics of all tasks, concatenated.
    diagnostics: Layout,
    traces: Vec<String>,
    period: SimDuration,
    observe: SimDuration,
    parts: Parts,
    /// Error that ended the run, if any.
    failed: Option<RigError>,
}

/// Mutable state of a rig, apart from its parts.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct RigState {
    manager: Manager,
    agenda: Agenda,
    compute: TimeSource,
    diagnostics: Vec<f64>,
}

struct TaskSlot {
    task: Box<dyn IoTask>,
    name: String,
    links: TaskLinks,
    /// Inputs of the task, collected at the beginning of a transfer.
    from_process: Vec<f64>,
    /// Range of its diagnostics.
    diagnostics: Range<usize>,
    /// Index of its first byte trace.
    first_trace: usize,
    part: PartId,
}

/// Agenda entries other than tasks. Tasks precede them, in their order.
struct Parts {
    process_end: PartId,
    control_step: PartId,
    observation: PartId,
}

impl TaskSlot {
    /// Calls the task; a panic is attributed to it.
    fn call<R>(&mut self, call: impl FnOnce(&mut dyn IoTask) -> R) -> R {
        in_part(PartKind::Task, &self.name, || call(&mut *self.task))
    }

    /// Saves the state of the task.
    fn save(&self) -> Snapshot {
        in_part(PartKind::Task, &self.name, || self.task.save())
    }
}

impl Rig {
    /// Schedules the change of a process variable before the first iteration that begins at `at` or
    /// later. Changes due at one iteration are applied in the order of their times, then in the
    /// order of scheduling.
    ///
    /// # Errors
    /// [`RigError::NoSuchVariable`], [`RigError::ChangeInThePast`], or [`RigError::Change`] if the
    /// value is always out of range. A change *by* an amount is checked when it is applied.
    pub fn schedule(
        &mut self,
        at: SimTime,
        variable: &str,
        change: Change,
    ) -> Result<(), RigError> {
        self.process.schedule(self.now(), at, variable, change)
    }

    /// Handles every event up to and at `to`. Running in pieces is equivalent to running at once.
    ///
    /// # Errors
    /// [`RigError`] if a part fails; `observer` has then received everything before the failure,
    /// and the rig returns the same error from every further call. [`RigError::Interrupted`] if the
    /// program is requested to end: the rig can continue from there.
    pub fn run_until<O: Observer>(
        &mut self,
        to: SimTime,
        observer: &mut O,
    ) -> Result<(), RigError> {
        while let Some(time) = self.step(to, observer)? {
            if interrupt::is_requested() {
                // The events of one instant are not separated.
                while self.step(time, observer)?.is_some() {}
                return Err(RigError::Interrupted { time });
            }
        }
        Ok(())
    }

    /// Handles the next event, if it is at `limit` or before, and returns its time.
    ///
    /// # Errors
    /// As [`Rig::run_until`].
    pub fn step<O: Observer>(
        &mut self,
        limit: SimTime,
        observer: &mut O,
    ) -> Result<Option<SimTime>, RigError> {
        if let Some(error) = &self.failed {
            return Err(error.clone());
        }
        let handled = match self.state.agenda.pop_until(limit) {
            Ok(None) => return Ok(None),
            Ok(Some(wake)) => self.handle(wake, observer).map(|()| Some(wake.time)),
            Err(error) => Err(error.into()),
        };
        if let Err(error) = &handled {
            self.failed = Some(error.clone());
        }
        handled
    }

    fn handle<O: Observer>(&mut self, wake: Wake, observer: &mut O) -> Result<(), RigError> {
        self.plant_host.state.now = wake.time;
        if wake.part == self.parts.observation {
            self.observe(observer)
        } else if wake.part == self.parts.control_step {
            self.control_step(observer)
        } else if wake.part == self.parts.process_end {
            self.process_end(observer)
        } else {
            let task = wake.part.index();
            let progress = self.tasks[task].call(|task| task.wake(wake.time, &mut self.plant_host));
            self.apply_progress(task, progress, observer)
        }
    }

    /// Begins an iteration of the process, unless the last one is still running.
    fn control_step<O: Observer>(&mut self, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        self.state
            .agenda
            .arm(self.parts.control_step, now + self.period);
        if self.plant_host.is_held() && !self.open_devices(observer)? {
            return Ok(());
        }
        let elapsed = match self.state.manager.control_step(now) {
            ControlStep::Begin { elapsed, .. } => elapsed,
            // Reported immediately: a process that never ends never begins again.
            ControlStep::Late { missed } => {
                observer.event(now, RunEvent::Overrun { missed });
                return Ok(());
            }
        };
        self.process.apply_changes(now, now, observer)?;
        for (n, slot) in self.tasks.iter().enumerate() {
            if self.state.manager.takes_part(n) {
                let results = slot.task.to_process();
                slot.links
                    .measurements
                    .iter()
                    .for_each(|link| link.copy(results, &mut self.process.state.inputs));
            } else {
                observer.event(now, RunEvent::TaskSkipped { task: n });
            }
        }
        observer.event(now, RunEvent::ProcessBegin { elapsed });
        observer.samples(now, Group::ProcessInputs, &self.process.state.inputs);
        self.process.step(now, elapsed)?;
        let ends = now + self.state.compute.draw();
        self.state.agenda.arm(self.parts.process_end, ends);
        Ok(())
    }

    /// Opens the devices at time 0; releases the plant once all are open. Returns whether they are.
    fn open_devices<O: Observer>(&mut self, observer: &mut O) -> Result<bool, RigError> {
        let now = self.now();
        if now == SimTime::ZERO {
            for n in 0..self.tasks.len() {
                self.state.manager.task_begun(n);
                let progress = self.tasks[n].call(|task| task.open(now, &mut self.plant_host));
                self.apply_progress(n, progress, observer)?;
            }
        }
        let open = (0..self.tasks.len()).all(|n| !self.state.manager.is_busy(n));
        if open {
            self.plant_host.release();
            if now > SimTime::ZERO {
                observer.event(now, RunEvent::Opened);
            }
        }
        Ok(open)
    }

    /// Ends the iteration, and begins the transfers of the tasks that take part in it.
    fn process_end<O: Observer>(&mut self, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        self.state.manager.process_ended();
        observer.event(now, RunEvent::ProcessEnd);
        observer.samples(now, Group::ProcessOutputs, &self.process.state.outputs);
        for n in 0..self.tasks.len() {
            if !self.state.manager.takes_part(n) {
                continue;
            }
            self.state.manager.task_begun(n);
            observer.event(now, RunEvent::TaskBegin { task: n });
            let slot = &mut self.tasks[n];
            for link in &slot.links.commands {
                link.copy(&self.process.state.outputs, &mut slot.from_process);
            }
            let progress = in_part(PartKind::Task, &slot.name, || {
                slot.task
                    .begin(now, &slot.from_process, &mut self.plant_host)
            });
            self.apply_progress(n, progress, observer)?;
        }
        Ok(())
    }

    /// Handles the progress reported by a task.
    fn apply_progress<O: Observer>(
        &mut self,
        task: usize,
        progress: Result<Progress, TaskError>,
        observer: &mut O,
    ) -> Result<(), RigError> {
        let now = self.now();
        let slot = &mut self.tasks[task];
        let first_trace = slot.first_trace;
        slot.task
            .drain_traffic(&mut |trace, bytes| observer.bytes(now, first_trace + trace, bytes));
        let wake_at = match progress {
            Ok(Progress::WakeAt(at)) => Some(at),
            Ok(Progress::Done) => {
                if self.state.manager.is_busy(task) {
                    self.state.manager.task_ended(task);
                    if !self.plant_host.is_held() {
                        observer.event(now, RunEvent::TaskEnd { task });
                    }
                }
                slot.task.idle_wake()
            }
            Err(TaskError::Plant(fault)) => return Err(fault.into()),
            Err(source) => {
                return Err(RigError::Task {
                    task: slot.name.clone(),
                    time: now,
                    source,
                });
            }
        };
        match wake_at {
            Some(wake_at) if wake_at < now => Err(RigError::WakeInThePast {
                task: slot.name.clone(),
                time: now,
                wanted: wake_at,
            }),
            Some(wake_at) => {
                self.state.agenda.arm(slot.part, wake_at);
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn observe<O: Observer>(&mut self, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        self.state
            .agenda
            .arm(self.parts.observation, now + self.observe);
        observer.samples(now, Group::Plant, self.plant_host.observe()?);
        self.plant_host.begin_window();
        if !self.state.diagnostics.is_empty() {
            for slot in self
                .tasks
                .iter()
                .filter(|slot| !slot.diagnostics.is_empty())
            {
                let values = &mut self.state.diagnostics[slot.diagnostics.clone()];
                in_part(PartKind::Task, &slot.name, || {
                    slot.task.read_diagnostics(now, values);
                });
            }
            observer.samples(now, Group::Diagnostics, &self.state.diagnostics);
        }
        Ok(())
    }

    /// Returns whether all devices are open, so that control steps have begun.
    pub fn is_open(&self) -> bool {
        !self.plant_host.is_held()
    }

    /// Returns the time of the last event.
    pub fn now(&self) -> SimTime {
        self.plant_host.state.now
    }

    /// Returns the layout of a group's values as passed to the observer.
    pub fn layout(&self, group: Group) -> &Layout {
        match group {
            Group::Plant => &self.plant_host.signals.outputs,
            Group::ProcessInputs => &self.process.inputs,
            Group::ProcessOutputs => &self.process.outputs,
            Group::Diagnostics => &self.diagnostics,
        }
    }

    /// Returns the names of the byte traces between tasks and devices.
    pub fn traces(&self) -> &[String] {
        &self.traces
    }

    /// Returns the names of the tasks, in order of registration.
    pub fn task_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.tasks.iter().map(|slot| slot.name.as_str())
    }

    /// Returns the name of the task that carries the process's signal `port`.
    pub fn carrier(&self, port: &Port) -> Option<&str> {
        let carries = |slot: &&TaskSlot| slot.task.ports().iter().any(|it| it.connects(port));
        Some(&self.tasks.iter().find(carries)?.name)
    }

    /// Returns the control period.
    pub fn period(&self) -> SimDuration {
        self.period
    }

    /// Returns the process.
    pub fn process(&self) -> &dyn Process {
        &*self.process.process
    }

    /// Returns the plant, for its energy and work. It is at the time at which it was last actuated,
    /// sampled or observed, at or before [`Rig::now`].
    pub fn plant(&self) -> &dyn Plant {
        &*self.plant_host.plant
    }

    /// Returns the plant, to be disturbed from outside between two events. The caller is
    /// responsible for the effect on the run; a replay does not reproduce it.
    pub fn plant_mut(&mut self) -> &mut dyn Plant {
        &mut *self.plant_host.plant
    }
}
