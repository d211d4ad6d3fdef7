//! Threads that advance rigs.

use std::sync::Mutex;

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use twinrig::runtime::interrupt;

use crate::fork::Generation;

/// Threads that are started once and advance the rigs of many calls.
#[pyclass(name = "Workers", module = "twinrig._native", frozen, subclass)]
pub(crate) struct PyWorkers {
    /// None: the caller's thread does all work.
    pool: Option<ThreadPool>,
    generation: Generation,
}

#[pymethods]
impl PyWorkers {
    /// Starts `threads` - 1 threads; the caller's is a further one.
    #[new]
    fn new(threads: usize) -> PyResult<Self> {
        let started = match threads {
            0 => {
                return Err(PyValueError::new_err("threads: expected at least 1, not 0"));
            }
            1 => None,
            _ => {
                let named = |index| format!("step-{index}");
                let builder = ThreadPoolBuilder::new().thread_name(named);
                let pool = builder.num_threads(threads - 1).build();
                let refused = |error| PyOSError::new_err(format!("{threads} threads: {error}"));
                Some(pool.map_err(refused)?)
            }
        };
        Ok(Self {
            pool: started,
            generation: Generation::current(),
        })
    }
}

impl PyWorkers {
    /// Calls `work` with each item, on all threads; the items are independent of each other.
    pub(crate) fn each<T: Send>(&self, items: &mut [T], work: impl Fn(&mut T) + Sync) {
        // A fork has not inherited the threads.
        let pool = self.pool.as_ref().filter(|_| !self.generation.is_past());
        let helpers = pool.map_or(0, ThreadPool::current_num_threads);
        let helpers = helpers.min(items.len().saturating_sub(1));
        let queue = Mutex::new(items.iter_mut());
        let next = || queue.lock().ok()?.next();
        let token = interrupt::current();
        let drain = || {
            interrupt::in_scope(token.as_ref(), || {
                while let Some(item) = next() {
                    work(item);
                }
            });
        };
        match pool {
            Some(pool) if helpers > 0 => pool.in_place_scope(|scope| {
                for _ in 0..helpers {
                    scope.spawn(|_| drain());
                }
                drain();
            }),
            _ => drain(),
        }
    }
}
