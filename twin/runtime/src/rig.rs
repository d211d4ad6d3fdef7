use twinrig_kernel::{Layout, PartId, Port, SimDuration, SimTime};

use crate::event_loop::{Event, EventLoop};
use crate::interrupt;
use crate::process_slot::ProcessSlot;
use crate::sensor::{SignalChain, of_task};
use crate::{
    BusHealth, BusSummary, Change, ControlStep, Group, IoTask, Manager, Observer, Plant, Process,
    Progress, RigError, RunEvent, TimeSource,
};

mod assembly;
mod exchange;
mod sensors;
mod snapshot;

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
    /// Tasks, plant and agenda.
    events: EventLoop<Box<dyn IoTask>>,
    manager: Manager,
    /// Time for which the transfers of each task may occupy it by the periods.
    implied_busy: Vec<SimDuration>,
    compute: TimeSource,
    /// Sensors, in the order in which they were added.
    sensors: Vec<SignalChain>,
    period: SimDuration,
    /// End of the scenario; none: the rig runs as long as it is told to.
    end: Option<SimTime>,
    process_end: PartId,
    control_step: PartId,
    /// Error that ended the run, if any.
    failed: Option<RigError>,
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
        self.process
            .schedule(self.now(), at, variable, change, self.period)
    }

    /// Checks whether the process would accept these values of its variables now, given by index
    /// and set in this order. This includes conditions that only the process knows, such as those
    /// on several variables. Nothing is changed.
    ///
    /// # Errors
    /// [`RigError::Change`] with the first refusal, or [`RigError::Snapshot`] if the process cannot
    /// be restored after the check, which then ends the run.
    pub fn check_values(&mut self, values: &[(usize, f64)]) -> Result<(), RigError> {
        let at = self.now();
        match self.process.check_values(values, self.period) {
            Ok(checked) => checked.map_err(|source| RigError::Change { at, source }),
            Err(error) => {
                let error = RigError::from(error);
                self.failed = Some(error.clone());
                Err(error)
            }
        }
    }

    /// Replaces the output `signal` of the process by `values` at the end of every iteration from
    /// the next one on; `None` ends the replacement, and the process's own values are used again.
    /// The process receives the replaced values as its last outputs.
    ///
    /// # Errors
    /// [`RigError::NoSuchOutput`], [`RigError::BadOverride`] for values of another number or values
    /// that are not finite, and [`RigError::OverrideOutOfRange`] for angles of joints beyond
    /// [`twinrig_kernel::signal::COMMAND_ANGLE_MAX`].
    pub fn override_output(
        &mut self,
        signal: &str,
        values: Option<&[f64]>,
    ) -> Result<(), RigError> {
        self.process.override_output(signal, values)
    }

    /// Sets the end of the scenario, which [`Rig::run_until`] does not pass; none: there is no end.
    pub fn set_end(&mut self, end: Option<SimTime>) {
        self.end = end;
    }

    /// Handles every event up to and at `to`. Running in pieces is equivalent to running at once.
    ///
    /// # Errors
    /// [`RigError::PastEnd`] if `to` is later than the end of the scenario; nothing has happened
    /// then. [`RigError`] if a part fails; `observer` has then received everything before the
    /// failure, and the rig returns the same error from every further call.
    /// [`RigError::Interrupted`] if the program is requested to end: the rig can continue from
    /// there.
    pub fn run_until<O: Observer>(
        &mut self,
        to: SimTime,
        observer: &mut O,
    ) -> Result<(), RigError> {
        if let Some(end) = self.end.filter(|end| to > *end) {
            return Err(RigError::PastEnd { to, end });
        }
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
        let handled = self.handle_next(limit, observer);
        if let Err(error) = &handled {
            self.failed = Some(error.clone());
        }
        handled
    }

    fn handle_next<O: Observer>(
        &mut self,
        limit: SimTime,
        observer: &mut O,
    ) -> Result<Option<SimTime>, RigError> {
        let Some(event) = self.events.step(limit, observer)? else {
            return Ok(None);
        };
        match event {
            Event::Observed => {}
            Event::Woken { part, progress } => self.handle_progress(part, progress, observer),
            Event::Own(event) if event == self.control_step => self.control_step(observer)?,
            Event::Own(_) => self.process_end(observer)?,
        }
        Ok(Some(self.now()))
    }

    /// Begins an iteration of the process, unless the last one is still running.
    fn control_step<O: Observer>(&mut self, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        self.events.agenda.arm(self.control_step, now + self.period);
        let is_first = self.events.plant_host.is_held();
        if is_first && !self.open_devices(observer)? {
            return Ok(());
        }
        let elapsed = match self.manager.control_step(now) {
            ControlStep::Begin { elapsed, .. } => elapsed,
            // Reported immediately: a process that never ends never begins again.
            ControlStep::Late { missed } => {
                observer.event(now, RunEvent::Overrun { missed });
                return Ok(());
            }
        };
        self.process.apply_changes(now, now, observer)?;
        for (n, slot) in self.events.parts.iter().enumerate() {
            if self.manager.takes_part(n) {
                self.process.accept_results(n, slot.part.to_process());
                for chain in of_task(&mut self.sensors, n) {
                    chain.deliver(now, &mut self.process.state.inputs);
                }
            } else {
                let implied = self.manager.since_begin(n, now) < self.implied_busy[n];
                observer.event(now, RunEvent::TaskSkipped { task: n, implied });
            }
        }
        observer.event(now, RunEvent::ProcessBegin { elapsed });
        observer.samples(now, Group::ProcessInputs, &self.process.state.inputs);
        self.process.step(now, elapsed)?;
        let duration = self.compute.draw();
        // Only a task that has just opened its device can be due at this instant before the end.
        if duration.is_zero() && !is_first {
            return self.process_end(observer);
        }
        self.events.agenda.arm(self.process_end, now + duration);
        Ok(())
    }

    /// Opens the devices at time 0; releases the plant once all are open. Returns whether they are.
    fn open_devices<O: Observer>(&mut self, observer: &mut O) -> Result<bool, RigError> {
        let now = self.now();
        let tasks = self.events.parts.len();
        if now == SimTime::ZERO {
            for n in 0..tasks {
                self.manager.task_begun(n, now);
                let progress = self
                    .events
                    .call(n, observer, |task, now, plant| task.open(now, plant))?;
                self.handle_progress(n, progress, observer);
            }
        }
        let open = (0..tasks).all(|n| !self.manager.is_busy(n));
        if open {
            self.events.plant_host.release();
            if now > SimTime::ZERO {
                observer.event(now, RunEvent::Opened);
            }
        }
        Ok(open)
    }

    /// Ends the iteration, and begins the transfers of the tasks that take part in it.
    fn process_end<O: Observer>(&mut self, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        self.manager.process_ended();
        observer.event(now, RunEvent::ProcessEnd);
        observer.samples(now, Group::ProcessOutputs, &self.process.state.outputs);
        for n in 0..self.events.parts.len() {
            if !self.manager.takes_part(n) {
                continue;
            }
            self.manager.task_begun(n, now);
            observer.event(now, RunEvent::TaskBegin { task: n });
            let from_process = self.process.task_inputs(n);
            let progress = self.events.call(n, observer, |task, now, plant| {
                task.begin(now, from_process, plant)
            })?;
            self.handle_progress(n, progress, observer);
        }
        Ok(())
    }

    /// Ends the transfer, or opening, of a task that is done.
    fn handle_progress<O: Observer>(&mut self, task: usize, progress: Progress, observer: &mut O) {
        if progress != Progress::Done {
            return;
        }
        let ended = self.manager.is_busy(task);
        if ended {
            self.manager.task_ended(task);
        }
        if self.events.plant_host.is_held() {
            return;
        }
        if ended {
            observer.event(self.now(), RunEvent::TaskEnd { task });
        }
        self.sense(task, ended);
    }

    /// Returns whether all devices are open, so that control steps have begun.
    pub fn is_open(&self) -> bool {
        !self.events.plant_host.is_held()
    }

    /// Returns the time of the last event.
    pub fn now(&self) -> SimTime {
        self.events.now()
    }

    /// Returns the layout of a group's values as passed to the observer.
    pub fn layout(&self, group: Group) -> &Layout {
        match group {
            Group::Plant => &self.events.plant_host.signals.outputs,
            Group::ProcessInputs => &self.process.inputs,
            Group::ProcessOutputs => &self.process.outputs,
            Group::Diagnostics => &self.events.diagnostics,
        }
    }

    /// Returns the names of the byte traces between tasks and devices.
    pub fn traces(&self) -> &[String] {
        &self.events.traces
    }

    /// Returns the names of the tasks, in order of registration.
    pub fn task_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.events.parts.iter().map(|slot| slot.name.as_str())
    }

    /// Returns name and traffic of each bus up to the last event.
    pub fn bus_health(&self) -> Vec<(&str, BusHealth)> {
        let now = self.now();
        let parts = self.events.parts.iter();
        parts
            .filter_map(|slot| Some((slot.name.as_str(), slot.part.bus_health(now)?)))
            .collect()
    }

    /// Returns the buses as a report has them, with their traffic up to the last event.
    pub fn buses(&self) -> Vec<BusSummary> {
        let health = self.bus_health().into_iter();
        health
            .map(|(name, health)| {
                let parts = self.events.parts.iter();
                let parts = parts.filter(|slot| slot.name == name);
                let ports = parts.flat_map(|slot| [slot.part.ports(), slot.part.diagnostics()]);
                BusSummary::new(name, health, ports.flatten())
            })
            .collect()
    }

    /// Returns the name of the task that carries the process's signal `port`.
    pub fn carrier(&self, port: &Port) -> Option<&str> {
        let mut tasks = self.events.parts.iter();
        let carries = |part: &dyn IoTask| part.ports().iter().any(|own| own.connects(port));
        Some(&tasks.find(|slot| carries(&*slot.part))?.name)
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
        &*self.events.plant_host.plant
    }
}
