//! Saved states of a run. Their memory has a limit: where it is reached, every second one is
//! dropped, so that the start stays in reach, at the cost of longer repetitions.

use twinrig_kernel::{SimDuration, SimTime, Snapshot};

use crate::watch::Watch;

/// Default limit of the memory of the saved states \[bytes\].
pub const SNAPSHOT_BYTES: usize = 64 << 20;

/// Time between two saved states, before any is dropped.
const SPACING: SimDuration = SimDuration::from_millis(100);

/// A saved state.
#[derive(Clone)]
pub(crate) struct Saved {
    pub(crate) at: SimTime,
    pub(crate) rig: Snapshot,
    pub(crate) watch: Watch,
    /// Number of acts of the branch that the rig knows.
    pub(crate) scheduled: usize,
}

/// Extent of the saved states: how far back a run can be sought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    /// Earliest instant.
    pub from: SimTime,
    /// Time between two saved states: at most this much is simulated again.
    pub spacing: SimDuration,
    /// Number of saved states.
    pub count: usize,
    /// Memory that they take, and its limit \[bytes\].
    pub bytes: [usize; 2],
}

/// The saved states of a branch, by time.
pub(crate) struct Snapshots {
    saved: Vec<Saved>,
    spacing: SimDuration,
    /// Memory that a watch takes \[bytes\].
    watch_bytes: usize,
    limit: usize,
}

impl Snapshots {
    pub(crate) fn new(start: Saved, watch_bytes: usize, limit: usize) -> Self {
        Self {
            saved: vec![start],
            spacing: SPACING,
            watch_bytes,
            limit,
        }
    }

    fn bytes(&self) -> usize {
        let rigs = self.saved.iter().map(|saved| saved.rig.0.len());
        let own = self.watch_bytes + size_of::<Saved>();
        rigs.map(|rig| rig + own).sum()
    }

    pub(crate) fn reach(&self) -> Reach {
        Reach {
            from: self.saved[0].at,
            spacing: self.spacing,
            count: self.saved.len(),
            bytes: [self.bytes(), self.limit],
        }
    }

    /// Returns the first instant after `now` at which a state is to be saved.
    pub(crate) fn next(&self, now: SimTime) -> SimTime {
        let spacing = self.spacing.as_nanos();
        let count = now.as_nanos() / spacing + 1;
        SimTime::from_nanos(count.saturating_mul(spacing))
    }

    /// Returns whether a state is to be saved at `at`, and none is at `at` or later.
    pub(crate) fn lacks(&self, at: SimTime) -> bool {
        let is_due = at.as_nanos().is_multiple_of(self.spacing.as_nanos());
        is_due && self.saved.last().is_some_and(|last| last.at < at)
    }

    /// Adds the state at an instant of [`Self::next`] that [is lacking](Self::lacks).
    pub(crate) fn add(&mut self, saved: Saved) {
        self.saved.push(saved);
        while self.bytes() > self.limit && self.saved.len() > 1 {
            self.spacing = self.spacing * 2;
            let spacing = self.spacing.as_nanos();
            self.saved
                .retain(|saved| saved.at.as_nanos().is_multiple_of(spacing));
        }
    }

    /// Returns the latest state at `at` or before.
    pub(crate) fn before(&self, at: SimTime) -> &Saved {
        let later = self.saved.partition_point(|saved| saved.at <= at);
        &self.saved[later.saturating_sub(1)]
    }

    /// Drops the states after `at`.
    pub(crate) fn truncate(&mut self, at: SimTime) {
        let later = self.saved.partition_point(|saved| saved.at <= at);
        self.saved.truncate(later.max(1));
    }
}
