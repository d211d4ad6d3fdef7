use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::Duration;

use triple_buffer::{Input, Output};
use twinrig_kernel::HostTime;

use super::clock::Clock;
use super::driver_session::{ByteDirection, DriverSession, SessionObserver};
use super::limits::Limits;
use super::ring::RingWriter;
use super::system::raise_priority;
use crate::{BusHealth, PartKind, TaskError, catch_panic, in_part};

/// Orders of the control thread to a worker. A later order overrides an earlier one.
pub(super) mod order {
    pub(in super::super) const NONE: u8 = 0;
    pub(in super::super) const BEGIN: u8 = 1;
    /// Final: not overridden.
    pub(in super::super) const CLOSE: u8 = 2;
}

/// Reports of a worker.
pub(super) mod report {
    pub(in super::super) const OUT: u8 = 0;
    pub(in super::super) const IN: u8 = 1;
    pub(in super::super) const ENDED: u8 = 2;
    pub(in super::super) const FAILED: u8 = 3;
}

/// State shared by control thread and worker.
#[derive(Default)]
pub(super) struct Shared {
    pub(super) order: AtomicU8,
    pub(super) failure: OnceLock<TaskError>,
    /// Traffic of the bus up to the order to close.
    pub(super) health: OnceLock<BusHealth>,
}

/// A task on its own thread: opens, then runs a transfer per order, then closes.
pub(super) struct Worker {
    pub(super) session: DriverSession,
    pub(super) clock: Arc<dyn Clock>,
    pub(super) limits: Limits,
    pub(super) priority: Option<u8>,
    pub(super) shared: Arc<Shared>,
    pub(super) from_process: Output<Vec<f64>>,
    /// Results for the process, followed by the diagnostics.
    pub(super) results: Input<Vec<f64>>,
    /// Number of results for the process.
    pub(super) to_process: usize,
    pub(super) reports: RingWriter,
}

/// Session callbacks that write to the worker's report queue.
struct ReportQueue<'a> {
    shared: &'a Shared,
    reports: &'a mut RingWriter,
}

impl SessionObserver for ReportQueue<'_> {
    fn on_bytes(&mut self, at: HostTime, direction: ByteDirection, bytes: &[u8]) {
        let kind = match direction {
            ByteDirection::Out => report::OUT,
            ByteDirection::In => report::IN,
        };
        self.reports.push_bytes(kind, 0, at, bytes);
    }

    fn is_cancelled(&self) -> bool {
        self.shared.order.load(Ordering::Relaxed) == order::CLOSE
    }
}

/// Pause between calls to a driver whose timeout stays in the past.
const RETRY_PAUSE: Duration = Duration::from_millis(1);

/// Converts a panic of the driver `name` into a failure of its task.
fn catch_driver_panic(
    name: &str,
    run: impl FnOnce() -> Result<(), TaskError>,
) -> Result<(), TaskError> {
    let result = catch_panic(|| in_part(PartKind::Driver, name, run));
    result.unwrap_or_else(|panic| Err(panic.into()))
}

impl Worker {
    /// Runs all phases of the task. Returns the number of lost reports.
    pub(super) fn run(mut self) -> u64 {
        raise_priority(self.priority);
        // The devices must be left in a safe state after any failure. A driver that panicked is
        // closed, too: the alternative is motors that keep running.
        let name = self.session.driver.name().to_owned();
        let served = catch_driver_panic(&name, || self.open_and_serve());
        let failed = served.is_err();
        self.report_failure(served);
        // A driver that panicked may panic again.
        let now = self.clock.now();
        if let Ok(Some(health)) = catch_panic(|| self.session.driver.bus_health(now)) {
            let _ = self.shared.health.set(health);
        }
        let limit = self.limits.close;
        let mut queue = ReportQueue {
            shared: &self.shared,
            reports: &mut self.reports,
        };
        let session = &mut self.session;
        let closed = catch_driver_panic(&name, || session.close(limit, &mut queue).map(|_| ()));
        if failed {
            // Only the first failure is reported.
            return self.reports.lost();
        }
        self.report_failure(closed);
        self.reports.lost()
    }

    fn report_failure(&mut self, result: Result<(), TaskError>) {
        if let Err(error) = result {
            let _ = self.shared.failure.set(error);
            self.reports.push_mark(report::FAILED, 0, self.clock.now());
        }
    }

    fn open_and_serve(&mut self) -> Result<(), TaskError> {
        let limit = self.limits.open;
        let mut queue = ReportQueue {
            shared: &self.shared,
            reports: &mut self.reports,
        };
        let mut end = self.session.open(limit, &mut queue)?;
        while let Some(at) = end {
            self.publish(at);
            end = self.wait()?;
        }
        Ok(())
    }

    /// Waits for an order and runs a transfer on [`order::BEGIN`]. Returns the time of its end;
    /// none if it is cancelled, and on [`order::CLOSE`].
    fn wait(&mut self) -> Result<Option<HostTime>, TaskError> {
        let limit = self.limits.transfer;
        let mut queue = ReportQueue {
            shared: &self.shared,
            reports: &mut self.reports,
        };
        loop {
            let begin = self.shared.order.compare_exchange(
                order::BEGIN,
                order::NONE,
                Ordering::Acquire,
                Ordering::Acquire,
            );
            match begin {
                Ok(_) => {
                    let from_process = self.from_process.read();
                    return self.session.transfer(from_process, limit, &mut queue);
                }
                Err(order::CLOSE) => return Ok(None),
                Err(_) => {}
            }
            match self.session.handle_idle_timeout(limit, &mut queue)? {
                None => thread::park(),
                Some(at) => {
                    let timeout = at.since(self.clock.now());
                    thread::park_timeout(if timeout.is_zero() {
                        RETRY_PAUSE
                    } else {
                        timeout
                    });
                }
            }
        }
    }

    /// Publishes the results of the transfer to the control thread, and reports its end.
    fn publish(&mut self, at: HostTime) {
        let results = self.results.input_buffer_mut();
        let (to_process, diagnostics) = results.split_at_mut(self.to_process);
        to_process.copy_from_slice(self.session.driver.to_process());
        self.session.driver.read_diagnostics(diagnostics);
        self.results.publish();
        self.reports.push_mark(report::ENDED, 0, at);
    }
}
