//! How long a study may take, and each of its parts.

use crate::stopwatch::{Deadline, Stopwatch};

/// A part may take so many times its even share of what is left: most take less.
const GENEROSITY: f64 = 4.0;
/// No part gets less than this \[s\]: enough for what is quick, and little enough for hundreds of parts after time is up.
const LEAST_S: f64 = 0.02;

/// The time of a study, shared out among its parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    total_s: f64,
    watch: Stopwatch,
    parts: usize,
    begun: usize,
}

/// What a part may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Share {
    /// \[s\]
    pub(crate) seconds: f64,
    pub(crate) deadline: Deadline,
}

impl Share {
    /// One of `parts` even parts of it, from now on.
    pub(crate) fn part(self, parts: usize) -> Self {
        let seconds = self.seconds / parts.max(1) as f64;
        Self {
            seconds,
            deadline: Deadline::within(seconds),
        }
    }
}

impl Budget {
    pub(crate) fn new(total_s: f64, parts: usize) -> Self {
        Self {
            total_s,
            watch: Stopwatch::start(),
            parts,
            begun: 0,
        }
    }

    /// The share of the next part.
    pub(crate) fn next(&mut self) -> Share {
        let left = self.parts.saturating_sub(self.begun).max(1);
        self.begun += 1;
        let rest = (self.total_s - self.watch.elapsed_s()).max(0.0);
        let seconds = (GENEROSITY * rest / left as f64).min(rest).max(LEAST_S);
        Share {
            seconds,
            deadline: Deadline::within(seconds),
        }
    }

    /// How many parts have begun, and of how many.
    pub(crate) fn progress(&self) -> (usize, usize) {
        (self.begun, self.parts)
    }
}
