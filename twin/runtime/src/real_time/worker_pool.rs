use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use triple_buffer::{Input, Output, triple_buffer};
use twinrig_kernel::{Direction, HostTime, Layout};

use super::clock::Clock;
use super::driver_session::{ByteDirection, DriverSession, duration};
use super::limits::Limits;
use super::ring::{RingReader, ring, unpack};
use super::scheduler::{Report, ReportKind, Tasks};
use super::worker::{Shared, Worker, order, report};
use crate::{BusHealth, Device, Driver, Phase, RigError, TaskError};

/// Worker threads of all tasks, as seen by the control thread.
pub(super) struct WorkerPool {
    workers: Vec<WorkerHandle>,
    limits: Limits,
    bytes: Vec<u8>,
    /// Number of lost reports of the threads that have ended.
    lost: u64,
}

struct WorkerHandle {
    place: String,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<u64>>,
    from_process: Input<Vec<f64>>,
    results: Output<Vec<f64>>,
    to_process: usize,
    reports: RingReader,
    phase: Phase,
    phase_began: HostTime,
    idle: bool,
    /// Whether its failure has been reported.
    failed: bool,
}

/// Capacity of a worker's report queue \[words of 8 bytes\].
const REPORTS: usize = 1 << 14;
/// Time after its limit at which a thread is abandoned.
const GRACE: Duration = Duration::from_secs(1);

impl WorkerPool {
    /// Starts a thread per driver, which begins to open its devices.
    pub(super) fn start(
        drivers: Vec<(Box<dyn Driver>, Box<dyn Device>)>,
        clock: &Arc<dyn Clock>,
        limits: Limits,
        priority: Option<u8>,
    ) -> Result<Self, RigError> {
        // If a thread cannot be started, dropping the pool closes the others.
        let mut pool = Self {
            workers: Vec::new(),
            limits,
            bytes: Vec::with_capacity(4096),
            lost: 0,
        };
        for (driver, device) in drivers {
            let worker = WorkerHandle::start(driver, device, clock, limits, priority)?;
            pool.workers.push(worker);
        }
        Ok(pool)
    }

    /// Orders all workers to close.
    pub(super) fn close(&mut self, now: HostTime) {
        for worker in &mut self.workers {
            (worker.phase, worker.phase_began, worker.idle) = (Phase::Closing, now, false);
            worker.order(order::CLOSE);
        }
    }

    /// Joins finished threads; returns whether every thread has ended or been abandoned.
    pub(super) fn all_ended(&mut self) -> bool {
        for worker in &mut self.workers {
            let finished = worker.thread.take_if(|thread| thread.is_finished());
            if let Some(Ok(lost)) = finished.map(JoinHandle::join) {
                self.lost += lost;
            }
        }
        self.workers.iter().all(|worker| worker.thread.is_none())
    }

    /// Returns the traffic of the buses whose threads have ended, by task.
    pub(super) fn bus_health(&self) -> Vec<(usize, BusHealth)> {
        let workers = self.workers.iter().enumerate();
        let health =
            workers.filter_map(|(n, worker)| Some((n, worker.shared.health.get()?.clone())));
        health.collect()
    }

    /// Returns the number of lost reports.
    pub(super) fn lost(&self) -> u64 {
        self.lost
    }
}

/// Closes all devices, however the run ended.
impl Drop for WorkerPool {
    fn drop(&mut self) {
        self.workers
            .iter()
            .for_each(|worker| worker.order(order::CLOSE));
    }
}

impl WorkerHandle {
    fn start(
        driver: Box<dyn Driver>,
        device: Box<dyn Device>,
        clock: &Arc<dyn Clock>,
        limits: Limits,
        priority: Option<u8>,
    ) -> Result<Self, RigError> {
        let name = driver.name().to_string();
        let inputs = Layout::of(&driver.ports(), Direction::Input).len();
        let mut results = driver.to_process().to_vec();
        let to_process = results.len();
        results.resize(
            to_process + Layout::of(&driver.diagnostics(), Direction::Output).len(),
            0.0,
        );
        driver.read_diagnostics(&mut results[to_process..]);
        let (from_process, to_worker) = triple_buffer(&vec![0.0; inputs]);
        let (from_worker, results) = triple_buffer(&results);
        let (writer, reports) = ring(REPORTS);
        let shared = Arc::new(Shared::default());
        let place = device.place().to_string();
        let worker = Worker {
            session: DriverSession::new(driver, device, clock.clone()),
            clock: clock.clone(),
            limits,
            priority,
            shared: shared.clone(),
            from_process: to_worker,
            results: from_worker,
            to_process,
            reports: writer,
        };
        let thread = thread::Builder::new().name(format!("task {name}"));
        let thread = thread.spawn(move || worker.run());
        let thread = thread.map_err(|error| RigError::Thread {
            what: name,
            why: error.to_string(),
        })?;
        Ok(Self {
            place,
            shared,
            thread: Some(thread),
            from_process,
            results,
            to_process,
            reports,
            phase: Phase::Opening,
            phase_began: clock.now(),
            idle: false,
            failed: false,
        })
    }

    fn order(&self, order: u8) {
        self.shared.order.store(order, Ordering::Release);
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }

    /// Returns the error of a thread without pending reports that has panicked or exceeded its
    /// limit.
    fn detect_failure(&mut self, now: HostTime, limits: Limits) -> Option<TaskError> {
        let limit = match self.phase {
            Phase::Opening => limits.open,
            Phase::Transfer => limits.transfer,
            // The worker may be in a transfer, or opening, when it is ordered to close.
            Phase::Closing => limits.close,
        };
        let thread = self.thread.as_ref()?;
        let why = if thread.is_finished() {
            // A closing worker may end; one whose last report is pending is checked again later.
            if self.phase == Phase::Closing || self.reports.peek().is_some() {
                return None;
            }
            "it panicked"
        } else if !self.idle && now > self.phase_began + (duration(limit) + GRACE) {
            "it is still running"
        } else {
            return None;
        };
        self.thread = None;
        Some(TaskError::Lost {
            what: self.phase,
            place: self.place.clone(),
            why: why.into(),
        })
    }
}

impl Tasks for WorkerPool {
    fn next_report(&mut self, limit: HostTime) -> Option<Report<'_>> {
        let heads = self.workers.iter_mut().enumerate();
        let oldest = heads
            .filter_map(|(task, worker)| worker.reports.peek().map(|head| (head.at, task)))
            .filter(|(at, _)| *at <= limit)
            .min();
        let Some((at, task)) = oldest else {
            let limits = self.limits;
            let mut workers = self.workers.iter_mut().enumerate();
            return workers.find_map(|(task, worker)| {
                // A worker that has failed may exceed its limit while closing: it is abandoned, but
                // reported only once.
                let error = worker.detect_failure(limit, limits)?;
                if std::mem::replace(&mut worker.failed, true) {
                    return None;
                }
                Some(Report {
                    task,
                    at: limit,
                    kind: ReportKind::Failed(error),
                })
            });
        };
        let worker = &mut self.workers[task];
        let (head, words) = worker.reports.pop()?;
        let kind = match head.kind {
            report::ENDED => {
                worker.idle = true;
                ReportKind::Ended
            }
            report::FAILED => {
                worker.failed = true;
                ReportKind::Failed(worker.shared.failure.get()?.clone())
            }
            kind => {
                unpack(head, words, &mut self.bytes);
                let direction = if kind == report::OUT {
                    ByteDirection::Out
                } else {
                    ByteDirection::In
                };
                ReportKind::Passed(direction, &self.bytes)
            }
        };
        Some(Report { task, at, kind })
    }

    fn results(&mut self, task: usize) -> (&[f64], &[f64]) {
        let worker = &mut self.workers[task];
        worker.results.read().split_at(worker.to_process)
    }

    fn begin(&mut self, task: usize, now: HostTime, from_process: &[f64]) {
        let worker = &mut self.workers[task];
        worker
            .from_process
            .input_buffer_mut()
            .copy_from_slice(from_process);
        worker.from_process.publish();
        (worker.phase, worker.phase_began, worker.idle) = (Phase::Transfer, now, false);
        worker.order(order::BEGIN);
    }
}
