use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::SimTime;

/// Refuses to let time stand still: more than `limit` events at one instant are an error that names
/// who woke whom. Parts are the caller's own numbers; their names are asked for only if it comes to that.
///
/// ```
/// use twinrig_kernel::{LivelockGuard, SimTime};
///
/// let mut guard = LivelockGuard::new(100);
/// let (mut part, mut other) = (0, 1);
/// let error = loop {
///     if let Err(error) = guard.event(SimTime::ZERO, Some(other), part, |n| ["bus", "board"][n].into()) {
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

/// Time stood still.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("more than {limit} events at {time}: {}", describe(edges))]
pub struct LivelockError {
    /// The instant that would not end.
    pub time: SimTime,
    /// How many events one instant may have.
    pub limit: u32,
    /// Who woke whom in the second half of them, most often first.
    pub edges: Vec<WakeEdge>,
}

/// One part waking another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WakeEdge {
    /// Who woke; nobody if the wake-up was armed from outside.
    pub by: Option<String>,
    /// Who was woken.
    pub woke: String,
    /// How often.
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

    /// Counts an event at `now`: `by` woke `woke`.
    ///
    /// # Errors
    /// [`LivelockError`] if the instant has had its fill; `name` gives the parts their names.
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
        // The first half is not worth looking at: by the second, whoever goes round in circles does so alone.
        if self.events > self.limit / 2 {
            self.note(by, woke);
        }
        if self.events <= self.limit {
            Ok(())
        } else {
            Err(self.error(name))
        }
    }

    fn note(&mut self, by: Option<usize>, woke: usize) {
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
    fn many_events_are_fine_while_time_moves() {
        let mut guard = LivelockGuard::new(3);
        for n in 0..1000 {
            guard
                .event(SimTime::from_nanos(n / 3), None, 0, |_| unreachable!())
                .unwrap();
        }
    }

    #[test]
    fn the_culprits_are_named_and_the_bystander_comes_last() {
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
