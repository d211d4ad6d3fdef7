use serde::{Deserialize, Serialize};
use twinrig_kernel::HostTime;

use crate::codes::FRAME_MAX;
use crate::packet::Address;

/// The boards whose answer to a request that was given up may still come, each with the instant until when.
///
/// A board is in it once, and only until then: of a frame's boards there are [`FRAME_MAX`] at most.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct LateAnswers(Vec<(Address, HostTime)>);

impl Default for LateAnswers {
    fn default() -> Self {
        Self(Vec::with_capacity(2 * FRAME_MAX))
    }
}

impl LateAnswers {
    /// At `now`, a request to that board is given up; its answer may come before `until`.
    pub(crate) fn add(&mut self, now: HostTime, from: Address, until: HostTime) {
        let until = self.until(from).map_or(until, |before| before.max(until));
        self.0
            .retain(|(board, until)| *board != from && *until > now);
        self.0.push((from, until));
    }

    /// From when on a request to that board brings no older answer.
    pub(crate) fn until(&self, to: Address) -> Option<HostTime> {
        let of_board = self.0.iter().find(|(board, _)| *board == to);
        of_board.map(|(_, until)| *until)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(nanos: u64) -> HostTime {
        HostTime::from_nanos(nanos)
    }

    #[test]
    fn the_latest_of_a_board_counts_and_those_that_are_over_are_forgotten() {
        let board = |id| Address::new(1, id).unwrap();
        let mut late = LateAnswers::default();
        late.add(at(0), board(1), at(50));
        late.add(at(10), board(1), at(40));
        assert_eq!(late.until(board(1)), Some(at(50)));
        for n in 0..1_000 {
            late.add(at(100 * n), board(2 + (n % 7) as u8), at(100 * n + 250));
            assert!(late.0.len() <= 3, "{late:?}");
        }
        assert_eq!(late.until(board(1)), None);
    }
}
