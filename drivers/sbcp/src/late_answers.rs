use serde::{Deserialize, Serialize};
use twinrig_kernel::HostTime;

use crate::codes::FRAME_MAX;
use crate::packet::Address;

/// Boards whose answer to an abandoned request may still arrive, each with the latest time.
///
/// A board is contained once and only until that time, so there are at most [`FRAME_MAX`] boards of
/// a frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct LateAnswers(Vec<(Address, HostTime)>);

impl Default for LateAnswers {
    fn default() -> Self {
        Self(Vec::with_capacity(2 * FRAME_MAX))
    }
}

impl LateAnswers {
    /// Adds a request to `from` abandoned at `now`, whose answer may arrive before `until`.
    pub(crate) fn add(&mut self, now: HostTime, from: Address, until: HostTime) {
        let until = self.until(from).map_or(until, |before| before.max(until));
        self.0
            .retain(|(board, until)| *board != from && *until > now);
        self.0.push((from, until));
    }

    /// Returns the time from which a request to `to` cannot receive an older answer.
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
    fn latest_deadline_of_a_board_applies_and_expired_ones_are_removed() {
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
