//! Processes forked from one that has used native threads.

use std::sync::atomic::{AtomicU64, Ordering};

use pyo3::prelude::*;

/// Number of forks between the first process and this one.
static GENERATION: AtomicU64 = AtomicU64::new(0);

/// Notes that this process is a fork; `os.register_at_fork` calls it in the child.
#[pyfunction]
pub(crate) fn forked() {
    GENERATION.fetch_add(1, Ordering::Relaxed);
}

/// Generation of a process, kept by everything that a fork does not inherit: threads, open files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Generation(u64);

impl Generation {
    /// Returns the generation of this process.
    pub(crate) fn current() -> Self {
        Self(GENERATION.load(Ordering::Relaxed))
    }

    /// Whether this process is a fork of the one in which `self` was current.
    pub(crate) fn is_past(self) -> bool {
        self != Self::current()
    }
}
