use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::SimTime;

/// Limit on the number of events at one instant. Beyond `limit` events the error lists the parts
/// that woke each other. Parts are numbered by the caller; names are requested only for the error.
///
/// ```
/// use twinrig_kernel::{LivelockGuard, SimTime};
///
/// let mut guard = LivelockGuard::new(100);
/// let (mut part, mut other) = (0, 1);
/// let error = loop {
///     let name = |n: usize| ["bus", "board"][n].to_string();
///     if let Err(error) = guard.event(SimTime::ZERO, Some(other), part, name) {
///         break error;
///     }
///     std::mem::swap(&mut part, &mut other);
/// };
/// assert_eq!(error.edges[0].to_string(), "board woke bus 26 times");
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LivelockGuard {
    limit: u32,
    instant: SimTime,
    events: u32,
    edges: Vec<(Option<usize>, usize, u32)>,
}

/// Simulated time stopped advancing.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("more than {limit} events at {time}: {}", describe(edges))]
pub struct LivelockError {
    /// Instant at which the limit was exceeded.
    pub time: SimTime,
    /// Maximum number of events at one instant.
    pub limit: u32,
    /// Wake-up relations among the second half of the events, most frequent first.
    pub edges: Vec<WakeEdge>,
}

/// Wake-up relation of two parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WakeEdge {
    /// Part that armed the wake-up; `None` if it was armed from outside any part.
    pub by: Option<String>,
    /// Part that was woken.
    pub woke: String,
    /// Number of wake-ups.
    pub count: u32,
}

impl std::fmt::Display for WakeEdge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let by = self.by.as_deref().unwrap_or("the outside");
        match &self.by {
            Some(by) if *by == self.woke => write!(f, "{by} woke itself {} times", self.count),
            _ => write!(f, "{by} woke {} {} times", self.woke, self.count),
        }
    }
}

fn describe(edges: &[WakeEdge]) -> String {
    edges
        .iter()
        .enumerate()
        .fold(String::new(), |mut text, (n, edge)| {
            let _ = write!(text, "{}{edge}", if n == 0 { "" } else { ", " });
            text
        })
}

impl LivelockGuard {
    /// A guard that allows `limit` events at one instant.
    pub fn new(limit: u32) -> Self {
        Self {
            limit,
            instant: SimTime::ZERO,
            events: 0,
            edges: Vec::new(),
        }
    }

    /// Counts an event at `now`, at which part `by` woke part `woke`.
    ///
    /// # Errors
    /// [`LivelockError`] if the instant exceeds the limit; `name` maps part numbers to names.
    pub fn event(
        &mut self,
        now: SimTime,
        by: Option<usize>,
        woke: usize,
        name: impl Fn(usize) -> String,
    ) -> Result<(), LivelockError> {
        if now != self.instant || self.events == 0 {
            self.instant = now;
            self.events = 0;
            self.edges.clear();
        }
        self.events += 1;
        // The first half is not recorded: in the second half only the parts of the cycle are
        // active.
        if self.events > self.limit / 2 {
            self.count_edge(by, woke);
        }
        if self.events <= self.limit {
            Ok(())
        } else {
            Err(self.error(name))
        }
    }

    fn count_edge(&mut self, by: Option<usize>, woke: usize) {
        match self
            .edges
            .iter_mut()
            .find(|(b, w, _)| (*b, *w) == (by, woke))
        {
            Some((_, _, count)) => *count += 1,
            None => self.edges.push((by, woke, 1)),
        }
    }

    fn error(&self, name: impl Fn(usize) -> String) -> LivelockError {
        let mut edges = self.edges.clone();
        edges.sort_by_key(|&(by, woke, count)| (std::cmp::Reverse(count), by, woke));
        LivelockError {
            time: self.instant,
            limit: self.limit,
            edges: edges
                .into_iter()
                .map(|(by, woke, count)| WakeEdge {
                    by: by.map(&name),
                    woke: name(woke),
                    count,
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_unlimited_while_time_advances() {
        let mut guard = LivelockGuard::new(3);
        for n in 0..1000 {
            guard
                .event(SimTime::from_nanos(n / 3), None, 0, |_| unreachable!())
                .unwrap();
        }
    }

    #[test]
    fn error_lists_wake_up_relations_by_frequency() {
        let mut guard = LivelockGuard::new(10);
        let name = |n: usize| ["clock", "talker"][n].to_string();
        let mut last = Ok(());
        for n in 0..11 {
            let by = if n == 7 { (None, 0) } else { (Some(1), 1) };
            last = guard.event(SimTime::from_nanos(5), by.0, by.1, name);
            assert_eq!(last.is_err(), n == 10);
        }
        assert_eq!(
            last.unwrap_err().to_string(),
            "more than 10 events at 5 ns: talker woke itself 5 times, the outside woke clock 1 times"
        );
    }
}
