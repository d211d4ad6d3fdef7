use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, SimTime};
use twinrig_runtime::{BusError, BusHealth, SLOW_CLOCK};

use crate::smooth::SmoothCounts;

/// Mismatch of the clocks of board and host from which it is an error \[1/1000\]. ASSUMED: six
/// times the largest one of the thesis (767 ppm, table 5.4), a quarter of the 2 % at which serial
/// bytes begin to be misread.
const MISMATCH_MAX: u64 = 5;
/// Greatest mismatch that is one of clocks \[1/1000\]: beyond 2 % bytes are misread. More shortened
/// periods are those of points that come faster than they are interpolated. ASSUMED margin.
const MISMATCH_OF_CLOCKS: u64 = 50;
/// Steps that are no mismatch: points that wait in the buffer (8) when a stream begins or ends.
const SLACK: u64 = 8;

/// Check of a board's clock by its own counters: a board whose clock is slow shortens its
/// interpolation periods, one whose clock is fast misses points.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ClockCheck {
    /// Period of each point taken, summed \[ticks\].
    ticks: u64,
    exceeded: Option<SimTime>,
}

impl ClockCheck {
    /// Counts a point with its period \[ticks\].
    pub(crate) fn count_point(&mut self, period: u16, counts: SmoothCounts, at: SimTime) {
        self.ticks += u64::from(period);
        let allowed = SLACK + self.ticks * MISMATCH_MAX / 1_000;
        if self.exceeded.is_none() && counts.filled > allowed + counts.missed {
            self.exceeded = Some(at);
        }
    }

    /// Adds missed points, and the steps of a slow clock.
    pub(crate) fn report(&self, board: String, counts: SmoothCounts, health: &mut BusHealth) {
        health.missed_points += counts.missed;
        let is_of_clocks =
            counts.filled.saturating_sub(counts.missed) <= self.ticks * MISMATCH_OF_CLOCKS / 1_000;
        if let Some(at) = self.exceeded.filter(|_| is_of_clocks) {
            health.errors.push(BusError {
                kind: SLOW_CLOCK,
                device: board,
                count: counts.filled,
                first: HostTime::from_nanos(at.as_nanos()),
                last: HostTime::from_nanos(u64::MAX),
            });
        }
    }
}
