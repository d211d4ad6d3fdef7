//! Threads of this process that do the tasks of a job.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::{Builder, available_parallelism};
use std::time::Duration;

use twinrig_document::probe;
use twinrig_runtime::{catch_panic, interrupt};

use super::{Engine, EngineError, EngineEvent, EngineOptions, EngineStatus, Job};

/// Stack of a thread \[bytes\], as the main thread has: without optimisation, runs of the full
/// plant need more than the usual 2 MB.
const STACK: usize = 8 << 20;
/// Greatest time between two calls of the observer.
const UPDATE: Duration = Duration::from_millis(100);

/// Does each task on one of several threads, by default one for each processor. The threads are in
/// the scope of the interrupt token and of the probe of the caller, and begin no further task after
/// an interrupt.
#[derive(Clone, Copy, Debug, Default)]
pub struct LocalEngine;

impl LocalEngine {
    /// Its name.
    pub const NAME: &'static str = "local";
}

impl Engine for LocalEngine {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn run(
        &self,
        job: &dyn Job,
        tasks: &[usize],
        options: &EngineOptions,
        observer: &mut dyn FnMut(EngineEvent) -> bool,
    ) -> Result<EngineStatus, EngineError> {
        if options.address.is_some() {
            return Err(EngineError::Option {
                engine: Self::NAME,
                option: "address",
                help: "leave it out, or choose the engine of the cluster",
            });
        }
        let processors = || available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let status = EngineStatus {
            workers: options.jobs.unwrap_or_else(processors).get(),
            ..EngineStatus::default()
        };
        let threads = status.workers.min(tasks.len());
        let mut observe =
            |event: Option<EngineEvent>| observer(event.unwrap_or(EngineEvent::Status(status)));
        on_threads(job, tasks, threads, &mut observe)?;
        Ok(status)
    }
}

/// Calls `observe` with each result, and without one now and then.
fn on_threads(
    job: &dyn Job,
    tasks: &[usize],
    threads: usize,
    observe: &mut dyn FnMut(Option<EngineEvent>) -> bool,
) -> Result<(), EngineError> {
    let (token, probe) = (interrupt::current(), probe::current());
    let (next, ended) = (AtomicUsize::new(0), AtomicBool::new(false));
    let work = || {
        while !ended.load(Ordering::Relaxed) && !interrupt::is_requested() {
            let &task = tasks.get(next.fetch_add(1, Ordering::Relaxed))?;
            let result = match catch_panic(|| job.run(task)) {
                Ok(Some(result)) => Ok(result),
                Ok(None) => continue,
                Err(panic) => Err(panic.to_string()),
            };
            return Some(EngineEvent::Done { task, result });
        }
        None
    };
    let (sender, receiver) = channel();
    #[expect(
        clippy::disallowed_methods,
        reason = "each thread does whole tasks, which share nothing"
    )]
    std::thread::scope(|scope| {
        for number in 1..=threads {
            let (sender, token, probe) = (sender.clone(), &token, probe.clone());
            let worker = move || {
                let work = || {
                    while let Some(event) = work() {
                        // The receiver outlives the threads.
                        let _ = sender.send(event);
                    }
                };
                interrupt::in_scope(token.as_ref(), || probe::within(probe, work));
            };
            let thread = Builder::new().name(format!("task {number}"));
            let started = thread.stack_size(STACK);
            if let Err(source) = started.spawn_scoped(scope, worker) {
                ended.store(true, Ordering::Relaxed);
                return Err(EngineError::Threads { threads, source });
            }
        }
        drop(sender);
        loop {
            let event = match receiver.recv_timeout(UPDATE) {
                Ok(event) => Some(event),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            };
            if !observe(event) {
                ended.store(true, Ordering::Relaxed);
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use twinrig_document::probe::Probe;

    use super::*;

    /// A task says whether it is in the scope of a probe.
    struct InProbe;

    impl Job for InProbe {
        fn shared(&self) -> Vec<u8> {
            Vec::new()
        }

        fn task(&self, _: usize) -> Vec<u8> {
            Vec::new()
        }

        fn run(&self, _: usize) -> Option<Vec<u8>> {
            Some(vec![u8::from(probe::current().is_some())])
        }
    }

    /// Returns the results of tasks on two threads.
    fn results() -> Vec<Result<Vec<u8>, String>> {
        let options = EngineOptions {
            jobs: NonZeroUsize::new(2),
            ..EngineOptions::default()
        };
        let mut results = Vec::new();
        let ended = LocalEngine.run(&InProbe, &[0, 1, 2], &options, &mut |event| {
            if let EngineEvent::Done { result, .. } = event {
                results.push(result);
            }
            true
        });
        assert!(ended.is_ok());
        results
    }

    /// A task that needs the usual stack of a thread for one variable.
    struct Deep;

    impl Job for Deep {
        fn shared(&self) -> Vec<u8> {
            Vec::new()
        }

        fn task(&self, _: usize) -> Vec<u8> {
            Vec::new()
        }

        #[expect(clippy::large_stack_arrays, reason = "the stack is tested")]
        fn run(&self, _: usize) -> Option<Vec<u8>> {
            let frame = [1_u8; STACK / 4];
            Some(vec![std::hint::black_box(&frame)[0]])
        }
    }

    /// Without it, the program is aborted.
    #[test]
    fn tasks_have_the_stack_of_a_main_thread() {
        let mut done = 0;
        let options = EngineOptions::default();
        let ended = LocalEngine.run(&Deep, &[0, 1], &options, &mut |event| {
            done += usize::from(matches!(event, EngineEvent::Done { result: Ok(_), .. }));
            true
        });
        assert!(ended.is_ok() && done == 2);
    }

    #[test]
    fn tasks_are_in_the_scope_of_the_probe_of_the_caller() {
        assert_eq!(results(), vec![Ok(vec![0]); 3]);
        let within = probe::within(Some(Probe::new()), results);
        assert_eq!(within, vec![Ok(vec![1]); 3]);
    }
}
