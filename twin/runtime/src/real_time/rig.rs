use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use twinrig_kernel::{HostTime, Layout, SimDuration, SimTime};

use super::clock::Clock;
use super::driver_session::duration;
use super::limits::Limits;
use super::monotonic_clock::MonotonicClock;
use super::observed_thread::{Outcome, observe_thread};
use super::observer_queue::{ObserverQueueWriter, POLL_INTERVAL};
use super::privileges::Privileges;
use super::report::{EndReason, RealTimeReport};
use super::scheduler::{RealTimeScheduler, TaskInterface};
use super::steering::{Steering, steering};
use super::system::{self, raise_priority};
use super::worker_pool::WorkerPool;
use crate::{Change, Device, Driver, Group, Observer, Process, RigError, Schedule, catch_panic};

/// A process and drivers on real devices, wired by name and run in real time: the threaded executor
/// of the scheduling rule ([`crate::Manager`]).
///
/// The drivers open their devices concurrently, each on its own thread; then the process runs on
/// the control thread, at every control step of a grid that begins when all are open, and each
/// driver runs a transfer on order. At the end the drivers close, also after a failure.
///
/// The observer receives the same records in the same order as from the lockstep rig
/// ([`crate::Rig`]), except for the plant: of its signals there are those that the drivers measure,
/// as of their last transfers, at the begin of each iteration. Times are clock times since control
/// step 0; earlier records have time 0. The process receives times of the grid, and changes are
/// scheduled by them. A run without overruns therefore computes the same as one in lockstep, and
/// transmits the same bytes.
pub struct RealTimeRig {
    scheduler: RealTimeScheduler,
    drivers: Vec<(Box<dyn Driver>, Box<dyn Device>)>,
    /// Limits and privileges of the run.
    pub options: RealTimeOptions,
}

/// Options of a real-time run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RealTimeOptions {
    /// Time limits of the drivers.
    pub limits: Limits,
    /// Thread priorities and memory locking.
    pub privileges: Privileges,
    /// Capacity of the observer queue \[bytes\].
    pub queue_bytes: usize,
}

/// Default limits and privileges; a queue of 4 MiB, several seconds at 1 kHz.
impl Default for RealTimeOptions {
    fn default() -> Self {
        Self {
            limits: Limits::default(),
            privileges: Privileges::default(),
            queue_bytes: 4 << 20,
        }
    }
}

/// Longest delay after which a sleeping control thread detects a stop request.
const STOP_LATENCY: Duration = Duration::from_millis(50);

impl RealTimeRig {
    /// Wires the parts by name. Only period and observation grid of `schedule` are used, not its
    /// modelled times and its seed.
    ///
    /// # Errors
    /// [`RigError::Wiring`] if a signal does not connect, [`RigError::BadPeriod`] if the schedule
    /// is invalid, [`RigError::NeedsLinux`] on other systems.
    pub fn new(
        schedule: &Schedule,
        process: Box<dyn Process>,
        drivers: Vec<(Box<dyn Driver>, Box<dyn Device>)>,
    ) -> Result<Self, RigError> {
        system::check()?;
        let interfaces = drivers
            .iter()
            .map(|(driver, _)| TaskInterface {
                name: driver.name().into(),
                ports: driver.ports(),
                diagnostics: driver.diagnostics(),
                period: driver.period(),
            })
            .collect();
        Ok(Self {
            scheduler: RealTimeScheduler::new(schedule, process, interfaces)?,
            drivers,
            options: RealTimeOptions::default(),
        })
    }

    /// Schedules the change of a process variable before the first iteration whose control step is
    /// at `at` or as [`crate::Rig::schedule`] does. Time 0 is control step 0.
    ///
    /// # Errors
    /// [`RigError::NoSuchVariable`], or [`RigError::Change`] if the value is always out of range.
    pub fn schedule(
        &mut self,
        at: SimTime,
        variable: &str,
        change: Change,
    ) -> Result<(), RigError> {
        let period = self.scheduler.period;
        let slot = &mut self.scheduler.slot;
        slot.schedule(SimTime::ZERO, at, variable, change, period)
    }

    /// Returns the sending end of changes made while the run goes on, in place of an earlier one.
    pub fn steering(&mut self) -> Steering {
        let (steering, steered) = steering(self.process().variables().len());
        self.scheduler.steered = Some(steered);
        steering
    }

    /// Returns the layout of a group's values as passed to the observer. Those of the plant are the
    /// measurements of the drivers.
    pub fn layout(&self, group: Group) -> &Layout {
        match group {
            Group::Plant => &self.scheduler.measurements,
            Group::ProcessInputs => &self.scheduler.slot.inputs,
            Group::ProcessOutputs => &self.scheduler.slot.outputs,
            Group::Diagnostics => &self.scheduler.diagnostics,
        }
    }

    /// Returns the names of the byte traces between drivers and devices.
    pub fn traces(&self) -> &[String] {
        &self.scheduler.traces
    }

    /// Returns the names of the drivers, in order.
    pub fn task_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.scheduler.tasks.iter().map(|task| task.name.as_str())
    }

    /// Returns the control period.
    pub fn period(&self) -> SimDuration {
        self.scheduler.period
    }

    /// Returns the process.
    pub fn process(&self) -> &dyn Process {
        &*self.scheduler.slot.process
    }

    /// Opens, runs every control step up to and at `duration` (unlimited if none) or until `stop`
    /// is set, waits for transfers in progress, and closes. `observer` is called on the calling
    /// thread, which keeps its priority and may block.
    ///
    /// A panic of the process, of a driver or of `observer` is an error that names it; the drivers
    /// have been closed by then.
    pub fn run<O: Observer>(
        self,
        duration: Option<SimDuration>,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> (Result<EndReason, RigError>, RealTimeReport) {
        let (drivers, scheduler, options) = (self.drivers, self.scheduler, self.options);
        let queue_bytes = options.queue_bytes;
        let run = move |observer_queue, stop| {
            let control = Control {
                scheduler,
                clock: Arc::new(MonotonicClock::start()),
                observer_queue,
                stop,
                duration,
                options,
            };
            control.run(drivers)
        };
        let ((ended, mut report), lost) =
            observe_thread("control", queue_bytes, observer, stop, run);
        report.lost += lost;
        (ended, report)
    }
}

/// State of the control thread.
struct Control {
    scheduler: RealTimeScheduler,
    clock: Arc<dyn Clock>,
    observer_queue: ObserverQueueWriter,
    stop: Arc<AtomicBool>,
    duration: Option<SimDuration>,
    options: RealTimeOptions,
}

impl Control {
    fn run(mut self, drivers: Vec<(Box<dyn Driver>, Box<dyn Device>)>) -> Outcome<RealTimeReport> {
        raise_priority(self.options.privileges.control_priority);
        let priority = self.options.privileges.task_priority;
        let pool = WorkerPool::start(drivers, &self.clock, self.options.limits, priority);
        let mut pool = match pool {
            Ok(pool) => pool,
            Err(error) => return (Err(error), self.scheduler.report),
        };
        let result = catch_panic(|| {
            let ended = self.open(&mut pool)?;
            ended.map_or_else(|| self.cycle(&mut pool), Ok)
        });
        let closed = self.close(&mut pool);
        self.scheduler.report.lost += pool.lost();
        for (task, health) in pool.bus_health() {
            self.scheduler.add_bus(task, health);
        }
        let ended = result.unwrap_or_else(|panic| Err(panic.into()));
        let ended = ended.and_then(|ended| closed.map(|()| ended));
        (ended, self.scheduler.report)
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn sleep_interval(&self) -> HostTime {
        self.clock.sleep_until(self.clock.now() + POLL_INTERVAL);
        self.clock.now()
    }

    /// Waits until all drivers are open; returns the end of the run if it was stopped before.
    fn open(&mut self, pool: &mut WorkerPool) -> Result<Option<EndReason>, RigError> {
        let began = self.clock.now();
        self.scheduler.begin_opening();
        loop {
            let now = self.clock.now();
            self.scheduler
                .handle_reports(now, pool, &mut self.observer_queue)?;
            if self.scheduler.all_idle() {
                let took = now.since(began).as_nanos();
                self.scheduler.report.opening =
                    SimDuration::from_nanos(u64::try_from(took).unwrap_or(u64::MAX));
                // The control thread sleeps until the first control step, as for all others.
                self.scheduler
                    .begin_at(now + duration(self.scheduler.period));
                return Ok(None);
            }
            if self.is_stopped() {
                return Ok(Some(EndReason::Stopped));
            }
            self.sleep_interval();
        }
    }

    /// Runs the control steps.
    fn cycle(&mut self, pool: &mut WorkerPool) -> Result<EndReason, RigError> {
        let last = self.duration.map(|duration| SimTime::ZERO + duration);
        let mut step = 0;
        loop {
            let (scheduled, at) = self.scheduler.due(step);
            if last.is_some_and(|last| scheduled > last) {
                break;
            }
            loop {
                if self.is_stopped() {
                    return Ok(EndReason::Stopped);
                }
                let now = self.clock.now();
                let limit = now + STOP_LATENCY;
                self.clock.sleep_until(at.min(limit));
                if at <= limit {
                    break;
                }
            }
            let (scheduler, observer_queue) = (&mut self.scheduler, &mut self.observer_queue);
            step = scheduler.control_step(step, &*self.clock, pool, observer_queue)?;
        }
        // Transfers in progress are completed; the worker pool enforces their limits.
        while !self.scheduler.all_idle() && !self.is_stopped() {
            let now = self.sleep_interval();
            self.scheduler
                .handle_reports(now, pool, &mut self.observer_queue)?;
        }
        Ok(EndReason::Duration)
    }

    /// Closes all drivers and processes their last reports.
    fn close(&mut self, pool: &mut WorkerPool) -> Result<(), RigError> {
        let began = self.clock.now();
        pool.close(began);
        let mut result = Ok(());
        loop {
            let all_ended = pool.all_ended();
            let now = self.clock.now();
            let handled = self
                .scheduler
                .handle_reports(now, pool, &mut self.observer_queue);
            let failed = handled.is_err();
            result = result.and(handled);
            if all_ended && !failed {
                return result;
            }
            self.sleep_interval();
        }
    }
}
