use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::HostTime;

use crate::packet::Address;

/// Maximum delay behind a time-out at which an answer is still attributed to its request. ASSUMED:
/// half of the time after which the boards drop their motors.
pub(crate) const LATENESS_MAX: Duration = Duration::from_millis(10);

/// Maximum number of requests remembered: those of [`LATENESS_MAX`] to a full frame of boards.
const REQUESTS_MAX: usize = 128;

/// A request from the oldest unanswered one on.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Asked {
    to: Address,
    written: HostTime,
    due: HostTime,
    /// Instant at which an answer was accepted for it.
    taken: Option<HostTime>,
}

/// Requests whose answers may be mixed up, by board: from an abandoned one on.
///
/// A board answers each request at most once and in order, so answers belong to requests in order,
/// unless one was lost. As long as an answer is missing, the next one is *doubtful*: it is that of
/// the abandoned request if the board, or the way to it, is late, and that of its own if the
/// missing one was lost. One more answer than requests are open tells the first case.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Attribution {
    asked: Vec<Asked>,
    /// A late answer was found.
    late: bool,
}

/// A late answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Late {
    /// Its delay behind the time-out.
    pub(crate) lateness: Duration,
    /// It had been accepted as the answer to a later request.
    pub(crate) taken: bool,
}

impl Attribution {
    /// Adds a request, written at `written` with its time-out at `due`, that was abandoned.
    pub(crate) fn abandon(&mut self, to: Address, written: HostTime, due: HostTime) {
        self.asked.retain(|asked| due < asked.due + LATENESS_MAX);
        if self.asked.len() < REQUESTS_MAX {
            self.asked.push(Asked {
                to,
                written,
                due,
                taken: None,
            });
        }
    }

    /// Returns whether an answer of `from`, received at `now` while the request written at
    /// `written` with time-out `due` is open, may be that of an abandoned request, on a bus on
    /// which answers were late before; notes that it was accepted.
    pub(crate) fn accept(
        &mut self,
        from: Address,
        written: HostTime,
        due: HostTime,
        now: HostTime,
    ) -> bool {
        if self.asked.is_empty() {
            return false;
        }
        self.forget_expired(from, now);
        let doubtful = self.asked.iter().any(|asked| asked.to == from);
        if doubtful && self.asked.len() < REQUESTS_MAX {
            self.asked.push(Asked {
                to: from,
                written,
                due,
                taken: Some(now),
            });
        }
        doubtful && self.late
    }

    /// Forgets the requests to a board if no abandoned one among them can still be answered.
    fn forget_expired(&mut self, of: Address, now: HostTime) {
        let open = |asked: &Asked| asked.taken.is_none() && now < asked.due + LATENESS_MAX;
        let any = self.asked.iter().any(|asked| asked.to == of && open(asked));
        if !any {
            self.asked.retain(|asked| asked.to != of);
        }
    }

    /// Attributes an answer of `from` that no open request asked for. Passes on every answer that
    /// is late by that; returns whether there is one.
    pub(crate) fn attribute(
        &mut self,
        from: Address,
        now: HostTime,
        late: &mut dyn FnMut(Late),
    ) -> bool {
        self.forget_expired(from, now);
        let of_board = self.asked.iter().filter(|asked| asked.to == from);
        let mut arrivals: Vec<HostTime> = of_board.filter_map(|asked| asked.taken).collect();
        let before = arrivals.len();
        arrivals.push(now);
        let requests = self.asked.iter().filter(|asked| asked.to == from);
        let pairs: Vec<(HostTime, HostTime)> =
            requests.map(|asked| asked.due).zip(arrivals).collect();
        for (n, (due, arrived)) in pairs.iter().enumerate() {
            let lateness = arrived.as_nanos().saturating_sub(due.as_nanos());
            let lateness = Duration::from_nanos(lateness);
            self.late = true;
            let taken = n < before;
            late(Late { lateness, taken });
        }
        // The first ones are answered; answers accepted for later ones were those of the first.
        let mut answered = pairs.len();
        self.asked.retain_mut(|asked| {
            if asked.to != from {
                return true;
            }
            asked.taken = None;
            let keep = answered == 0;
            answered = answered.saturating_sub(1);
            keep
        });
        !pairs.is_empty()
    }

    /// Returns whether an answer to an abandoned request may still arrive at `now`.
    pub(crate) fn is_open(&self, now: HostTime) -> bool {
        let open = |asked: &Asked| asked.taken.is_none() && now < asked.due + LATENESS_MAX;
        self.asked.iter().any(open)
    }
}
