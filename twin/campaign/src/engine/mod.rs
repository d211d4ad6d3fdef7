//! Engines: independent tasks of a job, on the threads of this program or on workers elsewhere.
//!
//! A [`Job`] has bytes that all its tasks share, small bytes for each task, and a result of each,
//! also bytes. An [`Engine`] does the tasks in any order and passes every result to an observer, so
//! that results are independent of engine, order and number of workers if the tasks are. It knows
//! no sweep; a search can have its costs computed by the same workers.
//!
//! [`LocalEngine`] has threads. The engine of a cluster is in the Python package, and sends the
//! bytes to its workers; a [`Job`] can also do a task in this process. The shared bytes of a sweep
//! have the contents of all files, so that a worker reads none, and begin with the hash of the
//! program, which a worker compares with its own.

mod local;

use std::fmt;
use std::num::NonZeroUsize;

use thiserror::Error;

pub use local::LocalEngine;

/// Independent tasks with common data.
pub trait Job: Sync {
    /// Returns the data of all tasks, which every worker outside this process gets once. They begin
    /// with everything that a worker needs to refuse a job of another build.
    fn shared(&self) -> Vec<u8>;

    /// Returns the data of a task.
    fn task(&self, index: usize) -> Vec<u8>;

    /// Does a task in this process; returns its result, or none after an interrupt.
    fn run(&self, index: usize) -> Option<Vec<u8>>;
}

/// Settings of an engine.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EngineOptions {
    /// Greatest number of tasks at the same time; none: the engine's own.
    pub jobs: Option<NonZeroUsize>,
    /// Cluster, for engines that use one: `auto` or `HOST:PORT`.
    pub address: Option<String>,
}

/// Event of an engine for its observer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EngineEvent {
    /// A task has ended, in its own way.
    Done {
        /// Index of the task.
        task: usize,
        /// Its result, or the panic that ended it.
        result: Result<Vec<u8>, String>,
    },
    /// A task has no result, as its workers did not survive it: not a property of the task alone.
    Lost {
        /// Index of the task.
        task: usize,
        /// Reason.
        reason: String,
    },
    /// From time to time: the workers.
    Status(EngineStatus),
}

/// Workers of an engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EngineStatus {
    /// Tasks that can be done at the same time.
    pub workers: usize,
    /// Machines of a cluster; none for threads of this process.
    pub machines: Option<usize>,
    /// Tasks that were begun again, as a worker was lost.
    pub repeated: usize,
    /// Longest time for which a cluster without slots is still awaited \[s\]; none: it has some.
    pub waits_s: Option<u64>,
}

/// `2 threads`, `8 slots of 3 machines`, `waits for a slot, at most 290 s`.
impl fmt::Display for EngineStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counted = |count: usize, word: &str| match count {
            1 => format!("1 {word}"),
            _ => format!("{count} {word}s"),
        };
        if let Some(left_s) = self.waits_s {
            return write!(f, "waits for a slot, at most {left_s} s");
        }
        match self.machines {
            None => f.write_str(&counted(self.workers, "thread")),
            Some(machines) => {
                let (slots, machines) =
                    (counted(self.workers, "slot"), counted(machines, "machine"));
                write!(f, "{slots} of {machines}")?;
                match self.repeated {
                    0 => Ok(()),
                    repeated => write!(f, ", {repeated} begun again"),
                }
            }
        }
    }
}

/// Error that ends the work of an engine. Results up to then have reached the observer.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EngineError {
    /// A thread cannot be started.
    #[error("cannot start {threads} threads: {source}\n  = help: choose fewer by --jobs")]
    Threads {
        /// Requested number of threads.
        threads: usize,
        /// Reason.
        source: std::io::Error,
    },
    /// An option that the engine does not have.
    #[error("the engine `{engine}` has no {option}\n  = help: {help}")]
    Option {
        /// Name of the engine.
        engine: &'static str,
        /// The option.
        option: &'static str,
        /// Remedy.
        help: &'static str,
    },
    /// The workers cannot be reached, are lost or refuse the job.
    #[error("{engine}: {message}\n  = help: {help}")]
    Workers {
        /// Name of the engine.
        engine: &'static str,
        /// Reason.
        message: String,
        /// Remedy.
        help: String,
    },
}

/// Does the tasks of jobs.
pub trait Engine: Send + Sync {
    /// Returns the name, as on the command line.
    fn name(&self) -> &'static str;

    /// Does `tasks` of a job, each once. `observer` is called on this thread, with every result in
    /// the order in which the tasks end, and with the status at least every second; it returns
    /// whether the work continues.
    ///
    /// # Errors
    /// [`EngineError`] if there are no workers, or none are left.
    fn run(
        &self,
        job: &dyn Job,
        tasks: &[usize],
        options: &EngineOptions,
        observer: &mut dyn FnMut(EngineEvent) -> bool,
    ) -> Result<EngineStatus, EngineError>;
}
