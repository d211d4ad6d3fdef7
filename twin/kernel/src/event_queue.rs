use std::cmp::Reverse;
use std::collections::BinaryHeap;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::SimTime;

/// Which of several events at one instant comes first: the lower rank.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Rank(pub u8);

/// Events to come, in the order (time, rank, sequence): at one instant the lower rank goes first, and
/// within a rank what was pushed first. Nothing is left to chance or to the heap's own order.
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
/// Push and pop cost a few tens of nanoseconds and allocate only when the queue outgrows what it has
/// ever held.
#[derive(Clone, Debug)]
pub struct EventQueue<E> {
    heap: BinaryHeap<Reverse<Entry<E>>>,
    next_sequence: u64,
}

/// An event that has come due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scheduled<E> {
    /// When.
    pub time: SimTime,
    /// Its rank at that instant.
    pub rank: Rank,
    /// How many events had been pushed before it.
    pub sequence: u64,
    /// What.
    pub event: E,
}

/// Bits of the sequence number; the rank has the 8 above. At 10⁹ events a second they last two years.
const SEQUENCE_BITS: u32 = 56;

/// Time, rank and sequence packed so that one comparison of integers orders all three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Key(u128);

impl Key {
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

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Entry<E> {
    key: Key,
    event: E,
}

// Keys are unique, so that comparing them alone is a total order whatever the events are.
impl<E> PartialEq for Entry<E> {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}
impl<E> Eq for Entry<E> {}
impl<E> PartialOrd for Entry<E> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl<E> Ord for Entry<E> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key.cmp(&other.key)
    }
}

impl<E> EventQueue<E> {
    /// An empty queue.
    pub fn new() -> Self {
        Self::with_capacity(0)
    }

    /// An empty queue that holds `capacity` events before it allocates again.
    pub fn with_capacity(capacity: usize) -> Self {
        Self {
            heap: BinaryHeap::with_capacity(capacity),
            next_sequence: 0,
        }
    }

    /// Schedules an event.
    pub fn push(&mut self, time: SimTime, rank: Rank, event: E) {
        let key = self.issue_key(time, rank);
        self.insert(key, event);
    }

    /// Takes the next event.
    pub fn pop(&mut self) -> Option<Scheduled<E>> {
        self.pop_entry().map(|(key, event)| Scheduled {
            time: key.time(),
            rank: key.rank(),
            sequence: key.sequence(),
            event,
        })
    }

    /// Takes the next event if it is due at `limit` or before.
    pub fn pop_until(&mut self, limit: SimTime) -> Option<Scheduled<E>> {
        if self.peek_time()? <= limit {
            self.pop()
        } else {
            None
        }
    }

    /// When the next event is due.
    pub fn peek_time(&self) -> Option<SimTime> {
        self.heap.peek().map(|Reverse(entry)| entry.key.time())
    }

    /// Number of events to come.
    pub fn len(&self) -> usize {
        self.heap.len()
    }

    /// Whether nothing is to come.
    pub fn is_empty(&self) -> bool {
        self.heap.is_empty()
    }

    /// The place in the order of an event that is inserted now or later.
    pub(crate) fn issue_key(&mut self, time: SimTime, rank: Rank) -> Key {
        let key = Key::new(time, rank, self.next_sequence);
        self.next_sequence += 1;
        key
    }

    pub(crate) fn insert(&mut self, key: Key, event: E) {
        self.heap.push(Reverse(Entry { key, event }));
    }

    pub(crate) fn pop_entry(&mut self) -> Option<(Key, E)> {
        self.heap
            .pop()
            .map(|Reverse(entry)| (entry.key, entry.event))
    }

    pub(crate) fn peek_entry(&self) -> Option<(Key, &E)> {
        self.heap
            .peek()
            .map(|Reverse(entry)| (entry.key, &entry.event))
    }

    pub(crate) fn retain(&mut self, mut keep: impl FnMut(Key, &E) -> bool) {
        self.heap
            .retain(|Reverse(entry)| keep(entry.key, &entry.event));
    }
}

impl<E> Default for EventQueue<E> {
    fn default() -> Self {
        Self::new()
    }
}

/// Two queues are equal if they will behave alike, whatever the heap looks like inside.
impl<E: PartialEq> PartialEq for EventQueue<E> {
    fn eq(&self, other: &Self) -> bool {
        let (ours, theirs) = (sorted(&self.heap), sorted(&other.heap));
        self.next_sequence == other.next_sequence
            && ours.len() == theirs.len()
            && ours
                .iter()
                .zip(theirs)
                .all(|(a, b)| a.key == b.key && a.event == b.event)
    }
}

fn sorted<E>(heap: &BinaryHeap<Reverse<Entry<E>>>) -> Vec<&Entry<E>> {
    let mut entries: Vec<_> = heap.iter().map(|Reverse(entry)| entry).collect();
    entries.sort_unstable();
    entries
}

// Saved in the order of the events: queues that behave alike have the same bytes.
impl<E: Serialize> Serialize for EventQueue<E> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.next_sequence, sorted(&self.heap)).serialize(serializer)
    }
}

impl<'de, E: Deserialize<'de>> Deserialize<'de> for EventQueue<E> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (next_sequence, entries) = <(u64, Vec<Entry<E>>)>::deserialize(deserializer)?;
        Ok(Self {
            heap: entries.into_iter().map(Reverse).collect(),
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
        fn events_leave_by_time_then_rank_then_order_of_arrival(
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
        fn a_restored_queue_goes_on_alike(
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
    fn the_extremes_of_time_and_rank_fit_the_key() {
        let key = Key::new(SimTime::MAX, Rank(255), (1 << SEQUENCE_BITS) - 1);
        assert_eq!(
            (key.time(), key.rank(), key.sequence()),
            (SimTime::MAX, Rank(255), (1 << SEQUENCE_BITS) - 1)
        );
        assert!(Key::new(SimTime::ZERO, Rank(1), 0) > Key::new(SimTime::ZERO, Rank(0), 7));
    }
}
