use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use super::observer_queue::{
    ObserverQueueReader, ObserverQueueWriter, POLL_INTERVAL, observer_queue,
};
use super::report::EndReason;
use crate::{Observer, PanicReport, RigError, catch_panic};

/// Result of a run, and its report.
pub(super) type Outcome<R> = (Result<EndReason, RigError>, R);

/// Runs `run` on a thread `name` and passes its records to `observer`, which is called on the
/// calling thread and may block. `run` receives a flag that is set when `stop` is set or `observer`
/// has panicked. Returns also the number of records lost because the queue was full.
///
/// A panic of `run` or of `observer` is an error.
pub(super) fn observe_thread<O: Observer, R: Default + Send + 'static>(
    name: &str,
    queue_bytes: usize,
    observer: &mut O,
    stop: &AtomicBool,
    run: impl FnOnce(ObserverQueueWriter, Arc<AtomicBool>) -> Outcome<R> + Send + 'static,
) -> (Outcome<R>, u64) {
    let (writer, mut reader) = observer_queue(queue_bytes / size_of::<u64>());
    let stop_requested = Arc::new(AtomicBool::new(false));
    let stop_flag = stop_requested.clone();
    let thread = thread::Builder::new().name(name.into());
    let thread = match thread.spawn(move || catch_panic(|| run(writer, stop_flag))) {
        Ok(thread) => thread,
        Err(error) => {
            let error = RigError::Thread {
                what: name.into(),
                why: error.to_string(),
            };
            return ((Err(error), R::default()), 0);
        }
    };
    let observed = catch_panic(|| {
        forward_records(&mut reader, observer, || {
            stop_requested.store(stop.load(Ordering::Relaxed), Ordering::Relaxed);
        });
    });
    if observed.is_err() {
        stop_requested.store(true, Ordering::Relaxed);
    }
    let (ended, report) = join_result(thread);
    let ended = observed.map_err(RigError::from).and(ended);
    ((ended, report), reader.lost())
}

/// Joins a thread; a panic of it is an error.
fn join_result<R: Default>(thread: JoinHandle<Result<Outcome<R>, PanicReport>>) -> Outcome<R> {
    // Without a result the thread panicked while dropping its values.
    let ended = thread.join().unwrap_or_else(|_| {
        Err(PanicReport {
            part: None,
            message: "a thread ended without a result".to_owned(),
            place: None,
        })
    });
    ended.unwrap_or_else(|panic| (Err(panic.into()), R::default()))
}

/// Passes all records to the observer until the writing end is dropped and the queue is empty.
fn forward_records<O: Observer>(
    reader: &mut ObserverQueueReader,
    observer: &mut O,
    mut poll: impl FnMut(),
) {
    loop {
        poll();
        let last = reader.is_abandoned();
        if reader.drain(observer) {
            continue;
        }
        if last {
            return;
        }
        thread::sleep(POLL_INTERVAL);
    }
}
