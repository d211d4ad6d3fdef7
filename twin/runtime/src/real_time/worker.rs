use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::Duration;

use triple_buffer::{Input, Output};
use twinrig_kernel::HostTime;

use super::clock::Clock;
use super::driver_session::{DriverSession, Heading, SessionEnd, SessionObserver};
use super::limits::Limits;
use super::privileges::raise;
use super::ring::RingWriter;
use crate::{PartKind, TaskError, caught, in_part};

/// What the control thread wants of a worker. The last order counts.
pub(super) mod order {
    pub(in super::super) const NONE: u8 = 0;
    pub(in super::super) const BEGIN: u8 = 1;
    /// Is never taken back.
    pub(in super::super) const CLOSE: u8 = 2;
}

/// What a worker reports.
pub(super) mod report {
    pub(in super::super) const OUT: u8 = 0;
    pub(in super::super) const IN: u8 = 1;
    pub(in super::super) const ENDED: u8 = 2;
    pub(in super::super) const FAILED: u8 = 3;
}

/// What control thread and worker have in common.
#[derive(Default)]
pub(super) struct Shared {
    pub(super) order: AtomicU8,
    pub(super) failure: OnceLock<TaskError>,
}

/// One task on its own thread: opens, then runs a transfer whenever it is told to, then closes.
pub(super) struct Worker {
    pub(super) exchange: DriverSession,
    pub(super) clock: Arc<dyn Clock>,
    pub(super) limits: Limits,
    pub(super) priority: Option<u8>,
    pub(super) shared: Arc<Shared>,
    pub(super) from_process: Output<Vec<f64>>,
    /// What the driver brings to the process, then its gauges.
    pub(super) brought: Input<Vec<f64>>,
    /// How many of those are for the process.
    pub(super) to_process: usize,
    pub(super) reports: RingWriter,
}

/// What a worker's exchange reports to.
struct ReportQueue<'a> {
    shared: &'a Shared,
    reports: &'a mut RingWriter,
}

impl SessionObserver for ReportQueue<'_> {
    fn passed(&mut self, at: HostTime, way: Heading, bytes: &[u8]) {
        let kind = match way {
            Heading::Out => report::OUT,
            Heading::In => report::IN,
        };
        self.reports.bytes(kind, 0, at, bytes);
    }

    fn is_called_off(&self) -> bool {
        self.shared.order.load(Ordering::Relaxed) == order::CLOSE
    }
}

/// How long a driver is left alone that wants to be attended to at an instant that is past, over and over.
const REST: Duration = Duration::from_millis(1);

/// A panic of the driver `name` is how its task failed.
fn guarded(name: &str, run: impl FnOnce() -> Result<(), TaskError>) -> Result<(), TaskError> {
    let ran = caught(|| in_part(PartKind::Driver, name, run));
    ran.unwrap_or_else(|panic| Err(panic.into()))
}

impl Worker {
    /// The whole life of the task. Gives back how many reports were lost.
    pub(super) fn live(mut self) -> u64 {
        raise(self.priority);
        // Whatever happened: the devices are to be left in a safe state. A driver that panicked is asked for that, too: what
        // it does then is better than motors that nobody stops.
        let name = self.exchange.driver.name().to_owned();
        let lived = guarded(&name, || self.open_and_serve());
        let failed = lived.is_err();
        self.note(lived);
        let limit = self.limits.close;
        let mut queue = ReportQueue {
            shared: &self.shared,
            reports: &mut self.reports,
        };
        let exchange = &mut self.exchange;
        let closed = guarded(&name, || exchange.close(limit, &mut queue).map(|_| ()));
        if failed {
            // The first failure is the one to be told.
            return self.reports.lost();
        }
        self.note(closed);
        self.reports.lost()
    }

    fn note(&mut self, result: Result<(), TaskError>) {
        if let Err(error) = result {
            let _ = self.shared.failure.set(error);
            self.reports.mark(report::FAILED, 0, self.clock.now());
        }
    }

    fn open_and_serve(&mut self) -> Result<(), TaskError> {
        let limit = self.limits.open;
        let mut queue = ReportQueue {
            shared: &self.shared,
            reports: &mut self.reports,
        };
        let mut ending = self.exchange.open(limit, &mut queue)?;
        loop {
            match ending {
                SessionEnd::Done(at) => self.publish(at),
                SessionEnd::CalledOff => return Ok(()),
            }
            let Some(next) = self.wait()? else {
                return Ok(());
            };
            ending = next;
        }
    }

    /// Waits for an order; runs a transfer if it is one to begin.
    fn wait(&mut self) -> Result<Option<SessionEnd>, TaskError> {
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
                    let ending = self.exchange.transfer(from_process, limit, &mut queue)?;
                    return Ok(Some(ending));
                }
                Err(order::CLOSE) => return Ok(None),
                Err(_) => {}
            }
            match self.exchange.attend(limit, &mut queue)? {
                None => thread::park(),
                Some(at) => {
                    let patience = at.since(self.clock.now());
                    thread::park_timeout(if patience.is_zero() { REST } else { patience });
                }
            }
        }
    }

    /// Puts what the transfer has brought where the control thread finds it, and says so.
    fn publish(&mut self, at: HostTime) {
        let brought = self.brought.input_buffer_mut();
        let (to_process, diagnostics) = brought.split_at_mut(self.to_process);
        to_process.copy_from_slice(self.exchange.driver.to_process());
        self.exchange.driver.read_diagnostics(diagnostics);
        self.brought.publish();
        self.reports.mark(report::ENDED, 0, at);
    }
}
