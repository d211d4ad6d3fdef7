//! Threads that run the points of a sweep.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::Duration;

use thiserror::Error;
use twinrig_runtime::{catch_panic, interrupt};

use super::row::SweepRow;

/// Greatest time between two calls of the observer.
const UPDATE: Duration = Duration::from_millis(100);

/// A thread that cannot be started.
#[derive(Debug, Error)]
#[error("cannot start {threads} threads: {source}\n  = help: choose fewer by --jobs")]
pub struct WorkerError {
    /// Requested number of threads.
    pub threads: usize,
    /// Reason.
    pub source: std::io::Error,
}

/// Calls `run` once for each of the `points`, on `jobs` threads, each run on one. The threads are
/// in the scope of the interrupt token of this thread, and begin no further point after an
/// interrupt. `run` returns none for a run that was interrupted; a panic in it is a row with an
/// error.
///
/// `finished` is called on this thread: with each row in the order in which the runs end, and
/// without one now and then. It returns whether the sweep continues.
///
/// # Errors
/// [`WorkerError`] if a thread cannot be started.
pub fn run_points(
    points: &[usize],
    jobs: NonZeroUsize,
    run: &(dyn Fn(usize) -> Option<SweepRow> + Sync),
    finished: &mut dyn FnMut(Option<(usize, SweepRow)>) -> bool,
) -> Result<(), WorkerError> {
    let threads = jobs.get().min(points.len());
    let token = interrupt::current();
    let (next, ended) = (AtomicUsize::new(0), AtomicBool::new(false));
    let work = || {
        while !ended.load(Ordering::Relaxed) && !interrupt::is_requested() {
            let &point = points.get(next.fetch_add(1, Ordering::Relaxed))?;
            let row = catch_panic(|| run(point));
            let row = row.unwrap_or_else(|panic| Some(SweepRow::of_error(panic.to_string())));
            if let Some(row) = row {
                return Some((point, row));
            }
        }
        None
    };
    let (sender, receiver) = channel();
    #[expect(
        clippy::disallowed_methods,
        reason = "each thread does whole runs, which share nothing"
    )]
    std::thread::scope(|scope| {
        for number in 1..=threads {
            let (sender, token) = (sender.clone(), &token);
            let worker = move || {
                interrupt::in_scope(token.as_ref(), || {
                    while let Some(row) = work() {
                        // The receiver outlives the threads.
                        let _ = sender.send(row);
                    }
                });
            };
            let started = Builder::new().name(format!("sweep {number}"));
            if let Err(source) = started.spawn_scoped(scope, worker) {
                ended.store(true, Ordering::Relaxed);
                return Err(WorkerError { threads, source });
            }
        }
        drop(sender);
        loop {
            let row = match receiver.recv_timeout(UPDATE) {
                Ok(row) => Some(row),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            };
            if !finished(row) {
                ended.store(true, Ordering::Relaxed);
            }
        }
    })
}
