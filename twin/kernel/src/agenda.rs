use serde::{Deserialize, Serialize};

use crate::event_queue::Key;
use crate::{LivelockError, LivelockGuard, Rank, SimTime};

/// Pending wake-ups of a fixed set of parts, at most one per part.
///
/// Arming a part again replaces its pending wake-up. Wake-ups are returned in the order (time, rank
/// of the part, order of arming). More wake-ups at one instant than the limit are an error
/// ([`LivelockGuard`]).
///
/// Made for a few parts: arming takes constant time, and the next wake-up is found by a comparison
/// of all pending ones.
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
    parts: Vec<Part>,
    /// Number of wake-ups armed so far.
    armed: u64,
    guard: LivelockGuard,
    /// Part that was woken last; it is recorded as the origin of the wake-ups armed meanwhile.
    awake: Option<PartId>,
}

/// Number of a part, in order of registration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PartId(usize);

impl PartId {
    /// Number of parts registered before it.
    pub const fn index(self) -> usize {
        self.0
    }
}

/// A wake-up that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wake {
    /// Time of the wake-up.
    pub time: SimTime,
    /// The part that is woken.
    pub part: PartId,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Part {
    name: String,
    rank: Rank,
    /// Pending wake-up; [`Key::NEVER`] without one.
    pending: Key,
    armed_by: Option<PartId>,
}

impl Agenda {
    /// An agenda without parts that allows at most `events_max` wake-ups at one instant.
    pub fn new(events_max: u32) -> Self {
        Self {
            parts: Vec::new(),
            armed: 0,
            guard: LivelockGuard::new(events_max),
            awake: None,
        }
    }

    /// Registers a part. The name appears in error messages; the rank decides ties in time.
    pub fn register(&mut self, name: impl Into<String>, rank: Rank) -> PartId {
        self.parts.push(Part {
            name: name.into(),
            rank,
            pending: Key::NEVER,
            armed_by: None,
        });
        PartId(self.parts.len() - 1)
    }

    /// Schedules the wake-up of `part` at `at`, replacing a pending one.
    pub fn arm(&mut self, part: PartId, at: SimTime) {
        let slot = &mut self.parts[part.0];
        slot.pending = Key::new(at, slot.rank, self.armed);
        slot.armed_by = self.awake;
        self.armed += 1;
    }

    /// Time of the pending wake-up of `part`.
    pub fn pending(&self, part: PartId) -> Option<SimTime> {
        let pending = self.parts[part.0].pending;
        (pending != Key::NEVER).then(|| pending.time())
    }

    /// Time of the next wake-up of any part.
    pub fn next_time(&self) -> Option<SimTime> {
        let (key, _) = self.next();
        (key != Key::NEVER).then(|| key.time())
    }

    /// Removes and returns the next wake-up if its time is `limit` or before.
    ///
    /// # Errors
    /// [`LivelockError`] if the wake-ups at one instant exceed the limit.
    pub fn pop_until(&mut self, limit: SimTime) -> Result<Option<Wake>, LivelockError> {
        let (key, part) = self.next();
        if key == Key::NEVER || key.time() > limit {
            return Ok(None);
        }
        let slot = &mut self.parts[part.0];
        slot.pending = Key::NEVER;
        let by = slot.armed_by.map(PartId::index);
        self.awake = Some(part);
        self.guard
            .event(key.time(), by, part.0, |n| self.parts[n].name.clone())?;
        Ok(Some(Wake {
            time: key.time(),
            part,
        }))
    }

    /// Returns the next pending wake-up; [`Key::NEVER`] if there is none.
    fn next(&self) -> (Key, PartId) {
        let mut next = (Key::NEVER, PartId(0));
        for (n, part) in self.parts.iter().enumerate() {
            if part.pending < next.0 {
                next = (part.pending, PartId(n));
            }
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Reference model: an optional (time, rank, order) per part, searched for the minimum.
    #[derive(Default)]
    struct Model {
        pending: Vec<Option<(u64, u8, usize)>>,
        armed: usize,
    }

    impl Model {
        fn pop(&mut self) -> Option<(u64, usize)> {
            let (least, part) = self
                .pending
                .iter()
                .enumerate()
                .filter_map(|(n, w)| w.map(|w| (w, n)))
                .min()?;
            self.pending[part] = None;
            Some((least.0, part))
        }
    }

    proptest! {
        #[test]
        fn agenda_matches_the_reference_model(
            operations in prop::collection::vec((0_u8..8, 0_usize..5, 0_u64..30), 0..400)
        ) {
            let mut agenda = Agenda::new(10_000);
            let ids: Vec<_> = (0_u8..5).map(|n| agenda.register(n.to_string(), Rank(n / 2))).collect();
            let mut model = Model { pending: vec![None; 5], armed: 0 };
            for (operation, part, time) in operations {
                if operation < 5 {
                    agenda.arm(ids[part], SimTime::from_nanos(time));
                    model.pending[part] = Some((time, u8::try_from(part).unwrap() / 2, model.armed));
                    model.armed += 1;
                } else {
                    let popped = agenda.pop_until(SimTime::MAX).unwrap();
                    prop_assert_eq!(popped.map(|w| (w.time.as_nanos(), w.part.index())), model.pop());
                }
                prop_assert_eq!(
                    agenda.pending(ids[part]).map(SimTime::as_nanos),
                    model.pending[part].map(|(time, ..)| time)
                );
            }
        }
    }

    #[test]
    fn livelock_error_names_parts_that_wake_each_other() {
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
