use serde::{Deserialize, Serialize};

use crate::event_queue::{EventQueue, Key};
use crate::{LivelockError, LivelockGuard, Rank, SimTime};

/// The wake-ups of a fixed set of parts, at most one pending for each.
///
/// A part that is armed again forgets its earlier wake-up. That costs nothing while it moves later, as
/// time-outs do that are pushed back with every byte: the entry in the queue stays where it is, and is
/// put back to the right place when it comes to the front.
///
/// Wake-ups come in the order (time, rank of the part, order of arming). An instant that never ends is
/// an error ([`LivelockGuard`]).
///
/// ```
/// use twinrig_kernel::{Agenda, Rank, SimTime};
///
/// let mut agenda = Agenda::new(1000);
/// let bus = agenda.register("bus", Rank(0));
/// let clock = agenda.register("clock", Rank(1));
/// agenda.arm(clock, SimTime::from_nanos(10));
/// agenda.arm(bus, SimTime::from_nanos(3));
/// agenda.arm(bus, SimTime::from_nanos(10));
///
/// let due = agenda.pop_until(SimTime::MAX)?.unwrap();
/// assert_eq!((due.part, due.time), (bus, SimTime::from_nanos(10)));
/// # Ok::<(), twinrig_kernel::LivelockError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Agenda {
    queue: EventQueue<PartId>,
    parts: Vec<Part>,
    guard: LivelockGuard,
    /// The part woken last: whatever is armed now is armed by it.
    awake: Option<PartId>,
}

/// Number of a part, in order of registration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PartId(usize);

impl PartId {
    /// How many parts were registered before it.
    pub const fn index(self) -> usize {
        self.0
    }
}

/// A wake-up that has come due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wake {
    /// When.
    pub time: SimTime,
    /// Who.
    pub part: PartId,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Part {
    name: String,
    rank: Rank,
    /// When the part is to be woken, if at all.
    wanted: Option<Key>,
    /// The entry in the queue that answers for the part: at `wanted` or before. Any other is stale.
    queued: Option<Key>,
    armed_by: Option<PartId>,
}

impl Agenda {
    /// An agenda without parts that allows `events_max` wake-ups at one instant.
    pub fn new(events_max: u32) -> Self {
        Self {
            queue: EventQueue::new(),
            parts: Vec::new(),
            guard: LivelockGuard::new(events_max),
            awake: None,
        }
    }

    /// Adds a part; its name is for error messages, its rank decides ties in time.
    pub fn register(&mut self, name: impl Into<String>, rank: Rank) -> PartId {
        self.parts.push(Part {
            name: name.into(),
            rank,
            wanted: None,
            queued: None,
            armed_by: None,
        });
        PartId(self.parts.len() - 1)
    }

    /// Wakes `part` at `at`, and no more at any time it was armed for before.
    pub fn arm(&mut self, part: PartId, at: SimTime) {
        let key = self.queue.issue_key(at, self.parts[part.0].rank);
        let slot = &mut self.parts[part.0];
        slot.wanted = Some(key);
        slot.armed_by = self.awake;
        if slot.queued.is_none_or(|queued| key < queued) {
            slot.queued = Some(key);
            self.queue.insert(key, part);
            self.drop_stale();
        }
    }

    /// Forgets the pending wake-up of `part`, if there is one.
    pub fn cancel(&mut self, part: PartId) {
        self.parts[part.0].wanted = None;
    }

    /// When `part` is to be woken.
    pub fn pending(&self, part: PartId) -> Option<SimTime> {
        self.parts[part.0].wanted.map(Key::time)
    }

    /// When the next part is to be woken.
    pub fn next_time(&mut self) -> Option<SimTime> {
        self.settle();
        self.queue.peek_time()
    }

    /// Wakes the next part, if its time is `limit` or before.
    ///
    /// # Errors
    /// [`LivelockError`] if too many wake-ups fall on one instant.
    pub fn pop_until(&mut self, limit: SimTime) -> Result<Option<Wake>, LivelockError> {
        self.settle();
        if self.queue.peek_time().is_none_or(|time| time > limit) {
            return Ok(None);
        }
        let Some((key, part)) = self.queue.pop_entry() else {
            return Ok(None);
        };
        let slot = &mut self.parts[part.0];
        (slot.wanted, slot.queued) = (None, None);
        let by = slot.armed_by.map(PartId::index);
        self.awake = Some(part);
        self.guard
            .event(key.time(), by, part.0, |n| self.parts[n].name.clone())?;
        Ok(Some(Wake {
            time: key.time(),
            part,
        }))
    }

    /// Brings an entry to the front that is not stale.
    fn settle(&mut self) {
        while let Some((key, &part)) = self.queue.peek_entry() {
            let slot = &mut self.parts[part.0];
            let answers = slot.queued == Some(key);
            if answers && slot.wanted == Some(key) {
                return;
            }
            self.queue.pop_entry();
            if answers {
                slot.queued = slot.wanted;
                if let Some(wanted) = slot.wanted {
                    self.queue.insert(wanted, part);
                }
            }
        }
    }

    /// Keeps the queue within a constant times the number of parts, whatever they arm and forget.
    fn drop_stale(&mut self) {
        if self.queue.len() > 2 * self.parts.len() + 16 {
            self.queue
                .retain(|key, part| self.parts[part.0].queued == Some(key));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The plain model: one optional (time, rank, order) a part, searched for the least.
    #[derive(Default)]
    struct Model {
        wanted: Vec<Option<(u64, u8, usize)>>,
        armed: usize,
    }

    impl Model {
        fn pop(&mut self) -> Option<(u64, usize)> {
            let (least, part) = self
                .wanted
                .iter()
                .enumerate()
                .filter_map(|(n, w)| w.map(|w| (w, n)))
                .min()?;
            self.wanted[part] = None;
            Some((least.0, part))
        }
    }

    proptest! {
        #[test]
        fn an_agenda_is_one_optional_wake_up_a_part(
            acts in prop::collection::vec((0_u8..8, 0_usize..5, 0_u64..30), 0..400)
        ) {
            let mut agenda = Agenda::new(10_000);
            let ids: Vec<_> = (0_u8..5).map(|n| agenda.register(n.to_string(), Rank(n / 2))).collect();
            let mut model = Model { wanted: vec![None; 5], armed: 0 };
            for (act, part, time) in acts {
                match act {
                    0..=4 => {
                        agenda.arm(ids[part], SimTime::from_nanos(time));
                        model.wanted[part] = Some((time, u8::try_from(part).unwrap() / 2, model.armed));
                        model.armed += 1;
                    }
                    5 => {
                        agenda.cancel(ids[part]);
                        model.wanted[part] = None;
                    }
                    _ => {
                        let popped = agenda.pop_until(SimTime::MAX).unwrap();
                        prop_assert_eq!(popped.map(|w| (w.time.as_nanos(), w.part.index())), model.pop());
                    }
                }
                prop_assert!(agenda.queue.len() <= 2 * 5 + 17);
                prop_assert_eq!(
                    agenda.pending(ids[part]).map(SimTime::as_nanos),
                    model.wanted[part].map(|(time, ..)| time)
                );
            }
        }
    }

    #[test]
    fn pushing_a_time_out_back_leaves_the_queue_alone() {
        let mut agenda = Agenda::new(10);
        let bus = agenda.register("bus", Rank(0));
        for time in 1..=1000 {
            agenda.arm(bus, SimTime::from_nanos(time));
        }
        assert_eq!(agenda.queue.len(), 1);
        assert_eq!(agenda.next_time(), Some(SimTime::from_nanos(1000)));
    }

    #[test]
    fn two_parts_that_wake_each_other_for_ever_are_named() {
        let mut agenda = Agenda::new(40);
        let bus = agenda.register("bus", Rank(0));
        let board = agenda.register("board", Rank(0));
        agenda.arm(bus, SimTime::ZERO);
        let error = loop {
            match agenda.pop_until(SimTime::MAX) {
                Ok(Some(wake)) => agenda.arm(if wake.part == bus { board } else { bus }, wake.time),
                Ok(None) => unreachable!(),
                Err(error) => break error,
            }
        };
        let text = error.to_string();
        assert!(
            text.contains("bus woke board") && text.contains("board woke bus"),
            "{text}"
        );
    }
}
