use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, SimTime};
use twinrig_runtime::{BusError, BusHealth, SLOW_CLOCK};

use crate::firmware::TICK;
use crate::smooth::SmoothCounts;

/// Mismatch of the clocks of board and host from which it is an error \[1/1000\]. ASSUMED: six
/// times the largest one of the thesis (767 ppm, table 5.4), a quarter of the 2 % at which serial
/// bytes begin to be misread.
const MISMATCH_MAX: u64 = 5;
/// Greatest part by which points may come faster than their periods say, for the steps to be those
/// of a clock \[1/1000\]: a host may send points of 10 ms every 2 ms. ASSUMED; beyond 2 % of
/// mismatch bytes are misread.
const FASTER_MAX: u64 = 50;
/// Steps that are no mismatch: points that wait in the buffer (8) when a stream begins or ends.
const SLACK: u64 = 8;

/// Check of a board's clock by its own counters: a board whose clock is slow shortens its
/// interpolation periods, one whose clock is fast misses points.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ClockCheck {
    /// Period of each point taken, summed \[ticks\].
    ticks: u64,
    /// Instants of the first and the last point.
    first_and_last: Option<(SimTime, SimTime)>,
    exceeded: Option<SimTime>,
}

impl ClockCheck {
    /// Counts a point with its period \[ticks\].
    pub(crate) fn count_point(&mut self, period: u16, counts: SmoothCounts, at: SimTime) {
        self.ticks += u64::from(period);
        self.first_and_last.get_or_insert((at, at)).1 = at;
        let allowed = SLACK + self.ticks * MISMATCH_MAX / 1_000;
        if self.exceeded.is_none() && counts.filled > allowed + counts.missed {
            self.exceeded = Some(at);
        }
    }

    /// Returns whether points come as often as their periods say.
    fn has_pace(&self) -> bool {
        let time = self.first_and_last.map(|(first, last)| last - first);
        let elapsed = time.map_or(0, |time| time.as_nanos() / TICK.as_nanos().unsigned_abs());
        self.ticks <= elapsed + elapsed * FASTER_MAX / 1_000 + SLACK
    }

    /// Adds missed points, and the steps of a slow clock.
    pub(crate) fn report(&self, board: String, counts: SmoothCounts, health: &mut BusHealth) {
        health.missed_points += counts.missed;
        if let Some(at) = self.exceeded.filter(|_| self.has_pace()) {
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
