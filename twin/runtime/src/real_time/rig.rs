use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use twinrig_kernel::{HostTime, Layout, SimDuration, SimTime};

use super::clock::{Clock, MonotonicClock, later};
use super::conductor::{Conductor, TaskFace};
use super::crew::Crew;
use super::exchange::duration;
use super::journal::{JournalReader, JournalWriter, journal};
use super::limits::Limits;
use super::privileges::{Privileges, raise};
use super::report::RealTimeReport;
use crate::{
    Change, Device, Driver, Group, Observer, PanicReport, Process, RigError, Schedule, caught,
};

/// A process and drivers at real devices, wired by name and run in real time: the executor of the scheduling
/// rule ([`crate::Manager`]) on threads.
///
/// The drivers open their devices, all at once, each on a thread of its own; then the process runs on the
/// control thread, at every control step of a grid that begins when all are open, and each driver runs a
/// transfer whenever it is told to. At the end the drivers close, whatever happened.
///
/// The observer sees what it sees of the lockstep rig ([`crate::Rig`]), in the same order, but for the
/// plant. Times are those of the machine since control step 0, at which everything is stamped that happened
/// before; the process is told the times of the grid, and changes are made by them. So a run without overruns
/// computes the same as one in lockstep, and puts the same bytes on the wire.
pub struct RealTimeRig {
    conductor: Conductor,
    drivers: Vec<(Box<dyn Driver>, Box<dyn Device>)>,
    plant: Layout,
    /// What the run may take of time and of the system.
    pub options: RealTimeOptions,
}

/// What a real-time run may take of time and of the system.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RealTimeOptions {
    /// How long drivers may take.
    pub limits: Limits,
    /// Priorities and memory.
    pub privileges: Privileges,
    /// Room for what the observer has not seen yet \[bytes\].
    pub queue_bytes: usize,
}

/// Four megabytes: seconds of a run at 1 kHz.
impl Default for RealTimeOptions {
    fn default() -> Self {
        Self {
            limits: Limits::default(),
            privileges: Privileges::default(),
            queue_bytes: 4 << 20,
        }
    }
}

/// How a run in real time ended, if nothing failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Its time was over.
    Duration,
    /// It was asked to.
    Stopped,
    /// The other side hung up.
    HungUp,
}

/// How often the observer's side looks whether there is anything new, and opening and closing are over.
pub(super) const GLANCE: Duration = Duration::from_millis(1);
/// How soon a sleeping control thread notices that it is asked to stop.
const STOP_SOON: Duration = Duration::from_millis(50);

impl RealTimeRig {
    /// Wires the parts by name. `schedule` says period and observation grid; its modelled times and its seed
    /// have no meaning here.
    ///
    /// # Errors
    /// [`RigError::Wiring`] if a signal does not connect, [`RigError::BadPeriod`] if the schedule cannot be.
    pub fn new(
        schedule: &Schedule,
        process: Box<dyn Process>,
        drivers: Vec<(Box<dyn Driver>, Box<dyn Device>)>,
    ) -> Result<Self, RigError> {
        let faces = drivers
            .iter()
            .map(|(driver, _)| TaskFace {
                name: driver.name().into(),
                ports: driver.ports(),
                gauges: driver.gauges(),
            })
            .collect();
        Ok(Self {
            conductor: Conductor::new(schedule, process, faces)?,
            drivers,
            plant: Layout::default(),
            options: RealTimeOptions::default(),
        })
    }

    /// Sets a process variable before the first iteration whose control step is at `at` or later, as
    /// [`crate::Rig::schedule`] does. Time 0 is control step 0.
    ///
    /// # Errors
    /// [`RigError::NoSuchVariable`], or [`RigError::Change`] if the value is out of range whatever happens.
    pub fn schedule(
        &mut self,
        at: SimTime,
        variable: &str,
        change: Change,
    ) -> Result<(), RigError> {
        let slot = &mut self.conductor.slot;
        slot.schedule(SimTime::ZERO, at, variable, change)
    }

    /// How the values of a group lie in what the observer sees. There is no plant.
    pub fn layout(&self, group: Group) -> &Layout {
        match group {
            Group::Plant => &self.plant,
            Group::ProcessInputs => &self.conductor.slot.inputs,
            Group::ProcessOutputs => &self.conductor.slot.outputs,
            Group::Gauges => &self.conductor.gauges,
        }
    }

    /// The names of the lanes on which drivers exchange bytes with their devices.
    pub fn lanes(&self) -> &[String] {
        &self.conductor.lanes
    }

    /// The names of the drivers, in order.
    pub fn task_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.conductor.tasks.iter().map(|task| task.name.as_str())
    }

    /// The control period.
    pub fn period(&self) -> SimDuration {
        self.conductor.period
    }

    /// The process.
    pub fn process(&self) -> &dyn Process {
        &*self.conductor.slot.process
    }

    /// Opens, runs every control step up to and at `duration` (without end, if there is none) or until `stop`
    /// is set, waits for the transfers that are under way, and closes. `observer` stays on the calling thread,
    /// which keeps its priority and may take its time.
    ///
    /// A panic of the process, of a driver or of `observer` is an error that names it; the drivers have closed by then.
    pub fn run<O: Observer>(
        self,
        duration: Option<SimDuration>,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> (Result<Ended, RigError>, RealTimeReport) {
        let (writer, mut reader) = journal(self.options.queue_bytes / size_of::<u64>());
        let asked = Arc::new(AtomicBool::new(false));
        let control = Control {
            conductor: self.conductor,
            clock: Arc::new(MonotonicClock::start()),
            journal: writer,
            stop: asked.clone(),
            duration,
            options: self.options,
        };
        let drivers = self.drivers;
        let thread = thread::Builder::new().name("control".into());
        let thread = match thread.spawn(move || caught(|| control.run(drivers))) {
            Ok(thread) => thread,
            Err(error) => {
                let error = RigError::Thread {
                    what: "control".into(),
                    why: error.to_string(),
                };
                return (Err(error), RealTimeReport::default());
            }
        };
        let observed = caught(|| {
            look_on(&mut reader, observer, || {
                asked.store(stop.load(Ordering::Relaxed), Ordering::Relaxed);
            });
        });
        if observed.is_err() {
            asked.store(true, Ordering::Relaxed);
        }
        let (ended, mut report) = joined(thread);
        report.lost += reader.lost();
        (observed.map_err(RigError::from).and(ended), report)
    }
}

/// How a run ended, and a report on it.
type Outcome<R> = (Result<Ended, RigError>, R);

/// What a thread has to say in the end; a panic of it is an error.
pub(super) fn joined<R: Default>(
    thread: JoinHandle<Result<Outcome<R>, PanicReport>>,
) -> Outcome<R> {
    // Without a report the thread panicked while it dropped what it had.
    let ended = thread.join().unwrap_or_else(|_| {
        Err(PanicReport {
            part: None,
            message: "a thread ended without a result".to_owned(),
            place: None,
        })
    });
    ended.unwrap_or_else(|panic| (Err(panic.into()), R::default()))
}

/// Tells the observer everything until nothing more will come.
pub(super) fn look_on<O: Observer>(
    reader: &mut JournalReader,
    observer: &mut O,
    mut glance: impl FnMut(),
) {
    loop {
        glance();
        let last = reader.is_abandoned();
        if reader.drain(observer) {
            continue;
        }
        if last {
            return;
        }
        thread::sleep(GLANCE);
    }
}

/// What runs on the control thread.
struct Control {
    conductor: Conductor,
    clock: Arc<dyn Clock>,
    journal: JournalWriter,
    stop: Arc<AtomicBool>,
    duration: Option<SimDuration>,
    options: RealTimeOptions,
}

impl Control {
    fn run(
        mut self,
        drivers: Vec<(Box<dyn Driver>, Box<dyn Device>)>,
    ) -> (Result<Ended, RigError>, RealTimeReport) {
        raise(self.options.privileges.control_priority);
        let priority = self.options.privileges.task_priority;
        let crew = Crew::start(drivers, &self.clock, self.options.limits, priority);
        let mut crew = match crew {
            Ok(crew) => crew,
            Err(error) => return (Err(error), self.conductor.report),
        };
        let ran = caught(|| {
            let ended = self.open(&mut crew)?;
            ended.map_or_else(|| self.cycle(&mut crew), Ok)
        });
        let closed = self.close(&mut crew);
        self.conductor.report.lost += crew.lost();
        let ended = ran.unwrap_or_else(|panic| Err(panic.into()));
        let ended = ended.and_then(|ended| closed.map(|()| ended));
        (ended, self.conductor.report)
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn pause(&self) -> HostTime {
        self.clock.sleep_until(later(self.clock.now(), GLANCE));
        self.clock.now()
    }

    /// Waits until all drivers are open; says how the run ended if it did before.
    fn open(&mut self, crew: &mut Crew) -> Result<Option<Ended>, RigError> {
        let began = self.clock.now();
        self.conductor.opening();
        loop {
            let now = self.clock.now();
            self.conductor.hear(now, crew, &mut self.journal)?;
            if self.conductor.all_idle() {
                let took = now.since(began).as_nanos();
                self.conductor.report.opening =
                    SimDuration::from_nanos(u64::try_from(took).unwrap_or(u64::MAX));
                // The first control step is slept up to, as all the others.
                self.conductor
                    .begin_at(later(now, duration(self.conductor.period)));
                return Ok(None);
            }
            if self.is_stopped() {
                return Ok(Some(Ended::Stopped));
            }
            self.pause();
        }
    }

    /// The control steps.
    fn cycle(&mut self, crew: &mut Crew) -> Result<Ended, RigError> {
        let last = self.duration.map(|duration| SimTime::ZERO + duration);
        let mut step = 0;
        loop {
            let (scheduled, at) = self.conductor.due(step);
            if last.is_some_and(|last| scheduled > last) {
                break;
            }
            loop {
                if self.is_stopped() {
                    return Ok(Ended::Stopped);
                }
                let now = self.clock.now();
                let soon = later(now, STOP_SOON);
                self.clock.sleep_until(at.min(soon));
                if at <= soon {
                    break;
                }
            }
            let (conductor, journal) = (&mut self.conductor, &mut self.journal);
            step = conductor.control_step(step, &*self.clock, crew, journal)?;
        }
        // What was begun is finished; every transfer has its limit, and the crew sees to it.
        while !self.conductor.all_idle() && !self.is_stopped() {
            let now = self.pause();
            self.conductor.hear(now, crew, &mut self.journal)?;
        }
        Ok(Ended::Duration)
    }

    /// Closes all drivers, and hears what they have to say for the last time.
    fn close(&mut self, crew: &mut Crew) -> Result<(), RigError> {
        let began = self.clock.now();
        crew.close(began);
        let mut result = Ok(());
        loop {
            let gone = crew.all_gone();
            let now = self.clock.now();
            let heard = self.conductor.hear(now, crew, &mut self.journal);
            let failed = heard.is_err();
            result = result.and(heard);
            if gone && !failed {
                return result;
            }
            self.pause();
        }
    }
}
