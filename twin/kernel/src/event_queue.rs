use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::SimTime;

/// Priority of an event among those at the same instant; the lowest is first.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Rank(pub u8);

/// Pending events in the order (time, rank, sequence): at one instant by ascending rank, within a
/// rank in the order of insertion.
///
/// ```
/// use twinrig_kernel::{EventQueue, Rank, SimTime};
///
/// let mut queue = EventQueue::new();
/// let noon = SimTime::from_nanos(12);
/// queue.push(noon, Rank(1), "lunch");
/// queue.push(noon, Rank(0), "bell");
/// queue.push(SimTime::ZERO, Rank(9), "wake");
/// let order: Vec<_> = std::iter::from_fn(|| queue.pop()).map(|due| due.event).collect();
/// assert_eq!(order, ["wake", "bell", "lunch"]);
/// ```
///
/// Made for tens of events: they are kept sorted, so that a pop takes constant time and a push
/// moves the events that are due earlier. A push allocates only when the queue exceeds its largest
/// length so far.
#[derive(Clone, Debug, PartialEq)]
pub struct EventQueue<E> {
    /// In descending order: the next event is the last entry.
    entries: Vec<Entry<E>>,
    next_sequence: u64,
}

/// An event taken from the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scheduled<E> {
    /// Time of the event.
    pub time: SimTime,
    /// Rank of the event at that instant.
    pub rank: Rank,
    /// Number of events pushed before it.
    pub sequence: u64,
    /// The event itself.
    pub event: E,
}

/// Bits of the sequence number; the rank occupies the 8 above. At 10⁹ events per second they last
/// two years.
const SEQUENCE_BITS: u32 = 56;

/// Time, rank and sequence packed into one integer, so that one comparison orders all three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Key(u128);

impl Key {
    /// After all events.
    pub(crate) const NEVER: Self = Self(u128::MAX);

    pub(crate) fn new(time: SimTime, rank: Rank, sequence: u64) -> Self {
        assert!(
            sequence < 1 << SEQUENCE_BITS,
            "more than 2⁵⁶ events were pushed"
        );
        let low = u64::from(rank.0) << SEQUENCE_BITS | sequence;
        Self(u128::from(time.as_nanos()) << 64 | u128::from(low))
    }

    pub(crate) fn time(self) -> SimTime {
        SimTime::from_nanos((self.0 >> 64) as u64)
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "the fields are taken apart"
    )]
    fn rank(self) -> Rank {
        Rank((self.0 >> SEQUENCE_BITS) as u8)
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "the fields are taken apart"
    )]
    fn sequence(self) -> u64 {
        self.0 as u64 & ((1 << SEQUENCE_BITS) - 1)
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Entry<E> {
    key: Key,
    event: E,
}

impl<E> EventQueue<E> {
    /// Creates an empty queue.
    pub fn new() -> Self {
        Self::with_capacity(0)
    }

    /// Creates an empty queue with room for `capacity` events.
    pub fn with_capacity(capacity: usize) -> Self {
        Self {
            entries: Vec::with_capacity(capacity),
            next_sequence: 0,
        }
    }

    /// Schedules an event.
    pub fn push(&mut self, time: SimTime, rank: Rank, event: E) {
        let key = Key::new(time, rank, self.next_sequence);
        self.next_sequence += 1;
        let index = self.entries.partition_point(|entry| entry.key > key);
        self.entries.insert(index, Entry { key, event });
    }

    /// Removes and returns the next event.
    pub fn pop(&mut self) -> Option<Scheduled<E>> {
        self.entries.pop().map(|Entry { key, event }| Scheduled {
            time: key.time(),
            rank: key.rank(),
            sequence: key.sequence(),
            event,
        })
    }

    /// Removes and returns the next event if its time is `limit` or before.
    pub fn pop_until(&mut self, limit: SimTime) -> Option<Scheduled<E>> {
        if self.peek_time()? <= limit {
            self.pop()
        } else {
            None
        }
    }

    /// Time of the next event.
    pub fn peek_time(&self) -> Option<SimTime> {
        self.entries.last().map(|entry| entry.key.time())
    }

    /// Number of pending events.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether no event is pending.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

impl<E> Default for EventQueue<E> {
    fn default() -> Self {
        Self::new()
    }
}

// Serialised in the order of the events.
impl<E: Serialize> Serialize for EventQueue<E> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let entries: Vec<_> = self.entries.iter().rev().collect();
        (self.next_sequence, entries).serialize(serializer)
    }
}

impl<'de, E: Deserialize<'de>> Deserialize<'de> for EventQueue<E> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (next_sequence, mut entries) = <(u64, Vec<Entry<E>>)>::deserialize(deserializer)?;
        // A snapshot from outside may have any order.
        entries.sort_unstable_by_key(|entry| std::cmp::Reverse(entry.key));
        Ok(Self {
            entries,
            next_sequence,
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Snapshot;

    proptest! {
        #[test]
        fn events_are_ordered_by_time_rank_and_insertion(
            pushed in prop::collection::vec((0_u64..20, 0_u8..4), 0..200)
        ) {
            let mut queue = EventQueue::new();
            for (n, &(time, rank)) in pushed.iter().enumerate() {
                queue.push(SimTime::from_nanos(time), Rank(rank), n);
            }
            let mut expected: Vec<_> = pushed.iter().enumerate().map(|(n, &(time, rank))| (time, rank, n)).collect();
            expected.sort_unstable();
            let popped: Vec<_> = std::iter::from_fn(|| queue.pop())
                .map(|due| {
                    assert_eq!(due.sequence, due.event as u64);
                    (due.time.as_nanos(), due.rank.0, due.event)
                })
                .collect();
            prop_assert_eq!(popped, expected);
        }

        #[test]
        fn restored_queue_continues_identically(
            before in prop::collection::vec((0_u64..50, 0_u8..3), 0..60),
            pops in 0_usize..40,
            after in prop::collection::vec((0_u64..50, 0_u8..3), 0..20),
        ) {
            let mut queue = EventQueue::new();
            for (n, &(time, rank)) in before.iter().enumerate() {
                queue.push(SimTime::from_nanos(time), Rank(rank), n);
            }
            for _ in 0..pops {
                queue.pop();
            }
            let snapshot = Snapshot::of(&queue);
            let mut restored: EventQueue<usize> = snapshot.read().unwrap();
            prop_assert_eq!(&restored, &queue);
            prop_assert_eq!(Snapshot::of(&restored), snapshot);
            for (n, &(time, rank)) in after.iter().enumerate() {
                queue.push(SimTime::from_nanos(time), Rank(rank), 1000 + n);
                restored.push(SimTime::from_nanos(time), Rank(rank), 1000 + n);
            }
            loop {
                let (a, b) = (queue.pop(), restored.pop());
                prop_assert_eq!(a, b);
                if a.is_none() {
                    break;
                }
            }
        }
    }

    #[test]
    fn extreme_times_and_ranks_fit_the_key() {
        let key = Key::new(SimTime::MAX, Rank(255), (1 << SEQUENCE_BITS) - 1);
        assert_eq!(
            (key.time(), key.rank(), key.sequence()),
            (SimTime::MAX, Rank(255), (1 << SEQUENCE_BITS) - 1)
        );
        assert!(Key::new(SimTime::ZERO, Rank(1), 0) > Key::new(SimTime::ZERO, Rank(0), 7));
    }
}
