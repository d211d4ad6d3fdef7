//! Greatest value in a window of time.

use std::collections::VecDeque;

use twinrig_kernel::SimTime;

/// The comparisons that may be the one of greatest margin in a window whose ends move forward:
/// margins fall from the first to the last of them (Lemire's monotonic wedge), so every sample is
/// added and removed once.
#[derive(Clone, Debug)]
pub(super) struct SlidingMax(VecDeque<Candidate>);

/// A value at a time, with its margin.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    at: SimTime,
    value: f64,
    margin: f64,
}

impl SlidingMax {
    pub fn with_capacity(capacity: usize) -> Self {
        SlidingMax(VecDeque::with_capacity(capacity))
    }

    /// Adds a value at the later end of the window.
    #[inline]
    pub fn add(&mut self, at: SimTime, value: f64, margin: f64) {
        while self.0.back().is_some_and(|last| last.margin <= margin) {
            self.0.pop_back();
        }
        self.0.push_back(Candidate { at, value, margin });
    }

    /// Returns the greatest margin; none in an empty window.
    pub fn greatest(&self) -> Option<f64> {
        self.0.front().map(|first| first.margin)
    }

    /// Moves the earlier end of the window to `start`, which is in it, and returns the value of the
    /// greatest margin; none in an empty window.
    #[inline]
    pub fn from(&mut self, start: SimTime) -> Option<f64> {
        while self.0.front().is_some_and(|first| first.at < start) {
            self.0.pop_front();
        }
        self.0.front().map(|first| first.value)
    }
}
