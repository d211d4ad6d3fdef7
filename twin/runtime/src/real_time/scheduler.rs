use std::ops::Range;

use twinrig_kernel::{CycleJitter, Direction, HostTime, Layout, Port, SimDuration, SimTime};

use super::clock::Clock;
use super::driver_session::{ByteDirection, duration};
use super::report::{RealTimeReport, TaskReport};
use super::steering::Steered;
use crate::interrupt::LongLoop;
use crate::process_slot::ProcessSlot;
use crate::schedule::{check_observation_period, implied_busy};
use crate::traced_wire::{OWN_TRACES, byte_traces};
use crate::wiring::{Link, append_ports, diagnostics_layout};
use crate::{
    BusHealth, BusSummary, ControlStep, Group, Manager, Observer, Process, RigError, RunEvent,
    Schedule, TaskError,
};

/// Tasks of the scheduler: on threads, or simulated in a test.
pub(super) trait Tasks {
    /// Removes and returns the oldest report of any task that is stamped `limit` or before.
    fn next_report(&mut self, limit: HostTime) -> Option<Report<'_>>;

    /// Returns the results of the task's last transfer for the process, and its diagnostics. The
    /// results are valid only while the task is idle.
    fn results(&mut self, task: usize) -> (&[f64], &[f64]);

    /// Begins a transfer of an idle task.
    fn begin(&mut self, task: usize, now: HostTime, from_process: &[f64]);
}

/// Report of a task.
pub(super) struct Report<'a> {
    pub(super) task: usize,
    pub(super) at: HostTime,
    pub(super) kind: ReportKind<'a>,
}

pub(super) enum ReportKind<'a> {
    Passed(ByteDirection, &'a [u8]),
    Ended,
    Failed(TaskError),
}

/// Scheduling rule in real time: the counterpart of the lockstep rig with a clock in place of the
/// agenda. Independent of threads.
pub(super) struct RealTimeScheduler {
    pub(super) slot: ProcessSlot,
    pub(super) tasks: Vec<TaskPart>,
    pub(super) diagnostics: Layout,
    /// Layout of the measurements of all tasks.
    pub(super) measurements: Layout,
    pub(super) traces: Vec<String>,
    pub(super) period: SimDuration,
    manager: Manager,
    observe: SimDuration,
    next_observation: SimTime,
    values: Vec<f64>,
    /// Measurements as of the last transfer of each task.
    measured: Vec<f64>,
    /// Time of control step 0; earlier records are stamped time 0.
    origin: Option<HostTime>,
    /// Stamp of the last record; stamps do not decrease.
    last_stamp: SimTime,
    /// Changes made while the run goes on, if any are.
    pub(super) steered: Option<Steered>,
    /// Jitter of the actual beginnings of the iterations.
    jitter: CycleJitter,
    pub(super) report: RealTimeReport,
}

/// A task and its range of the values of all tasks.
pub(super) struct TaskPart {
    pub(super) name: String,
    diagnostics: Range<usize>,
    /// From the results of the task to the measurements of all tasks.
    measurements: Vec<Link>,
    /// Measurements and diagnostics.
    provided: Vec<Port>,
    /// Time for which transfers may occupy it by the periods.
    implied_busy: SimDuration,
    begun: HostTime,
}

/// Name and ports of a driver.
pub(super) struct TaskInterface {
    pub(super) name: String,
    pub(super) ports: Vec<Port>,
    pub(super) diagnostics: Vec<Port>,
    pub(super) period: Option<SimDuration>,
}

impl RealTimeScheduler {
    /// Wires the parts by name.
    pub(super) fn new(
        schedule: &Schedule,
        process: Box<dyn Process>,
        tasks: Vec<TaskInterface>,
    ) -> Result<Self, RigError> {
        let period = schedule.period()?;
        check_observation_period(schedule.observe)?;
        let (mut parts, mut named) = (Vec::new(), Vec::new());
        let (mut diagnostics, mut traces) = (Vec::new(), Vec::new());
        let mut measurements = Vec::new();
        for task in tasks {
            traces.extend(byte_traces(&task.name, &[]));
            parts.push(TaskPart {
                name: task.name.clone(),
                provided: [task.ports.clone(), task.diagnostics.clone()].concat(),
                implied_busy: implied_busy(task.period, period),
                diagnostics: append_ports(&mut diagnostics, task.diagnostics),
                measurements: append_measurements(&mut measurements, &task.ports),
                begun: HostTime::default(),
            });
            named.push((task.name, task.ports));
        }
        let slot = ProcessSlot::new(process, &named)?;
        let diagnostics = diagnostics_layout(&diagnostics)?;
        let measurements = Layout::of(&measurements, Direction::Output);
        let report = RealTimeReport {
            tasks: parts
                .iter()
                .map(|part| TaskReport::of(&part.name))
                .collect(),
            ..RealTimeReport::default()
        };
        Ok(Self {
            slot,
            manager: Manager::new(parts.len()),
            tasks: parts,
            values: vec![0.0; diagnostics.len()],
            diagnostics,
            measured: vec![0.0; measurements.len()],
            measurements,
            traces,
            period,
            observe: schedule.observe,
            next_observation: SimTime::ZERO,
            origin: None,
            last_stamp: SimTime::ZERO,
            steered: None,
            jitter: CycleJitter::new(period),
            report,
        })
    }

    /// Marks all tasks as busy with opening.
    pub(super) fn begin_opening(&mut self) {
        (0..self.tasks.len()).for_each(|n| self.manager.task_begun(n, SimTime::ZERO));
    }

    /// Adds the traffic of a task's bus to the report.
    pub(super) fn add_bus(&mut self, task: usize, health: BusHealth) {
        // Without a control step all instants are those of the opening.
        let health = health.since(self.origin.unwrap_or(HostTime::from_nanos(u64::MAX)));
        let TaskPart { name, provided, .. } = &self.tasks[task];
        let bus = BusSummary::new(name, health, provided.iter().cloned());
        self.report.buses.push(bus);
    }

    /// Returns whether all tasks are idle.
    pub(super) fn all_idle(&self) -> bool {
        (0..self.tasks.len()).all(|n| !self.manager.is_busy(n))
    }

    /// Sets the time of control step 0.
    pub(super) fn begin_at(&mut self, origin: HostTime) {
        self.origin = Some(origin);
    }

    /// Returns the time of a control step in the run and on the clock.
    pub(super) fn due(&self, step: u64) -> (SimTime, HostTime) {
        let since = SimDuration::from_nanos(self.period.as_nanos().saturating_mul(step));
        let at = self.origin.unwrap_or_default() + duration(since);
        (SimTime::ZERO + since, at)
    }

    /// Converts to the time of the run, not earlier than the last stamp.
    fn stamp(&mut self, at: HostTime) -> SimTime {
        let since = self
            .origin
            .map_or(0, |origin| at.as_nanos().saturating_sub(origin.as_nanos()));
        self.last_stamp = self.last_stamp.max(SimTime::from_nanos(since));
        self.last_stamp
    }

    /// Processes the reports of the tasks up to `limit`, in order of time.
    pub(super) fn handle_reports<T: Tasks, O: Observer>(
        &mut self,
        limit: HostTime,
        tasks: &mut T,
        observer: &mut O,
    ) -> Result<(), RigError> {
        while let Some(Report { task, at, kind }) = tasks.next_report(limit) {
            let now = self.stamp(at);
            match kind {
                ReportKind::Passed(direction, bytes) => {
                    let trace = task * OWN_TRACES + usize::from(direction == ByteDirection::In);
                    observer.bytes(now, trace, bytes);
                }
                ReportKind::Ended => {
                    // After the end of the run there is no transfer to end.
                    if self.manager.is_busy(task) {
                        self.manager.task_ended(task);
                        if self.origin.is_some() {
                            observer.event(now, RunEvent::TaskEnd { task });
                            let took = at.since(self.tasks[task].begun);
                            self.report.tasks[task].took.count(took);
                        }
                    }
                }
                ReportKind::Failed(source) => {
                    return Err(RigError::Task {
                        task: self.tasks[task].name.clone(),
                        time: now,
                        source,
                    });
                }
            }
        }
        Ok(())
    }

    /// Runs control step `step`, or the last due one if it was overslept: one iteration of the
    /// process, and the following transfers. Returns the number of the next control step that is
    /// not yet late.
    pub(super) fn control_step<C: Clock + ?Sized, T: Tasks, O: Observer>(
        &mut self,
        step: u64,
        clock: &C,
        tasks: &mut T,
        observer: &mut O,
    ) -> Result<u64, RigError> {
        let woke = clock.now();
        self.report.lateness.count(woke.since(self.due(step).1));
        let step = self.skip_overslept(step, woke, tasks, observer)?;
        self.handle_reports(woke, tasks, observer)?;
        self.begin(step, woke, tasks, observer)?;

        let ended = clock.now();
        self.report.computing.count(ended.since(woke));
        let next = self.count_overruns(step + 1, ended, tasks, observer)?;
        self.handle_reports(ended, tasks, observer)?;
        self.end(ended, tasks, observer);
        self.observe_diagnostics(ended, tasks, observer);
        Ok(next)
    }

    /// Skips the control steps missed by a late wake-up.
    fn skip_overslept<T: Tasks, O: Observer>(
        &mut self,
        mut step: u64,
        woke: HostTime,
        tasks: &mut T,
        observer: &mut O,
    ) -> Result<u64, RigError> {
        let mut missed = 0;
        let mut turns = LongLoop::default();
        while self.due(step + 1).1 <= woke && !turns.is_interrupted() {
            let at = self.due(step).1;
            self.handle_reports(at, tasks, observer)?;
            missed += 1;
            self.report.overslept += 1;
            let now = self.stamp(at);
            observer.event(now, RunEvent::Overrun { missed });
            step += 1;
        }
        Ok(step)
    }

    /// Runs an iteration on the results of the idle tasks.
    fn begin<T: Tasks, O: Observer>(
        &mut self,
        step: u64,
        woke: HostTime,
        tasks: &mut T,
        observer: &mut O,
    ) -> Result<(), RigError> {
        let (scheduled, _) = self.due(step);
        let now = self.stamp(woke);
        // Grid time, not clock time: without overruns every run computes the same.
        let ControlStep::Begin { elapsed, .. } = self.manager.control_step(scheduled) else {
            return Ok(());
        };
        if let Some(jitter) = self.jitter.begin(now) {
            self.report.jitter.count(duration(jitter));
        }
        self.report.iterations += 1;
        self.slot.apply_changes(scheduled, now, observer)?;
        if let Some(steered) = &mut self.steered {
            steered.apply(&mut self.slot, self.period, now, observer);
        }
        for n in 0..self.tasks.len() {
            if self.manager.takes_part(n) {
                let (results, _) = tasks.results(n);
                self.slot.accept_results(n, results);
                for link in &self.tasks[n].measurements {
                    link.copy(results, &mut self.measured);
                }
            } else {
                let implied = self.manager.since_begin(n, now) < self.tasks[n].implied_busy;
                self.report.tasks[n].skipped += u64::from(!implied);
                observer.event(now, RunEvent::TaskSkipped { task: n, implied });
            }
        }
        observer.event(now, RunEvent::ProcessBegin { elapsed });
        observer.samples(now, Group::ProcessInputs, &self.slot.state.inputs);
        if !self.measured.is_empty() {
            observer.samples(now, Group::Plant, &self.measured);
        }
        self.slot.step(now, elapsed)
    }

    /// Counts the control steps missed during the iteration.
    fn count_overruns<T: Tasks, O: Observer>(
        &mut self,
        mut step: u64,
        ended: HostTime,
        tasks: &mut T,
        observer: &mut O,
    ) -> Result<u64, RigError> {
        // An iteration of exactly one period is not late.
        let mut turns = LongLoop::default();
        while self.due(step).1 < ended && !turns.is_interrupted() {
            let (scheduled, at) = self.due(step);
            self.handle_reports(at, tasks, observer)?;
            if let ControlStep::Late { missed } = self.manager.control_step(scheduled) {
                self.report.overruns += 1;
                let now = self.stamp(at);
                observer.event(now, RunEvent::Overrun { missed });
            }
            step += 1;
        }
        Ok(step)
    }

    /// Ends the iteration, and begins the transfers of the tasks that take part in it.
    fn end<T: Tasks, O: Observer>(&mut self, ended: HostTime, tasks: &mut T, observer: &mut O) {
        let now = self.stamp(ended);
        self.manager.process_ended();
        observer.event(now, RunEvent::ProcessEnd);
        observer.samples(now, Group::ProcessOutputs, &self.slot.state.outputs);
        for (n, part) in self.tasks.iter_mut().enumerate() {
            if !self.manager.takes_part(n) {
                continue;
            }
            self.manager.task_begun(n, now);
            observer.event(now, RunEvent::TaskBegin { task: n });
            part.begun = ended;
            tasks.begin(n, ended, self.slot.task_inputs(n));
        }
    }

    /// Passes the diagnostics to the observer, if an observation is due.
    fn observe_diagnostics<T: Tasks, O: Observer>(
        &mut self,
        at: HostTime,
        tasks: &mut T,
        observer: &mut O,
    ) {
        let now = self.stamp(at);
        if self.values.is_empty() || now < self.next_observation {
            return;
        }
        let observations = (now - SimTime::ZERO).as_nanos() / self.observe.as_nanos() + 1;
        self.next_observation =
            SimTime::from_nanos(self.observe.as_nanos().saturating_mul(observations));
        for (n, part) in self.tasks.iter().enumerate() {
            if !part.diagnostics.is_empty() {
                let (_, diagnostics) = tasks.results(n);
                self.values[part.diagnostics.clone()].copy_from_slice(diagnostics);
            }
        }
        observer.samples(now, Group::Diagnostics, &self.values);
    }
}

/// Appends the outputs of a task to those of all tasks; returns the links to them from the results
/// of the task. Of outputs with the same name, that of the first task counts.
fn append_measurements(all: &mut Vec<Port>, ports: &[Port]) -> Vec<Link> {
    let mut links = Vec::new();
    for field in Layout::of(ports, Direction::Output).fields() {
        if all.iter().any(|other| other.name == field.port.name) {
            continue;
        }
        let to = append_ports(all, vec![field.port.clone()]);
        let from = field.range();
        Link { from, to }.append_to(&mut links);
    }
    links
}
