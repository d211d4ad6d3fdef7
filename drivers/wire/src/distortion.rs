use std::mem;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError, Stream, stream};

use crate::arrivals::Octet;
use crate::error::nonzero;
use crate::noise::Noise;
use crate::{Arrivals, Fault, FaultKind, FaultSchedule, Piece, WireError};

/// What faults do to the bytes that pass a place in one direction. What comes out depends on the bytes and their
/// times alone, not on the portions in which they are handed in.
pub(crate) struct Distortion {
    faults: Vec<Fault>,
    byte_time: SimDuration,
    state: State,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    /// For bursts and bits.
    stream: Stream,
    noise: Noise,
    /// When the last byte came in.
    last_in: Option<SimTime>,
    /// When the last one came out.
    last_out: Option<SimTime>,
    /// What happens to the burst under way.
    fate: Fate,
    /// Whether it may go on.
    open: bool,
    /// Copy of the burst under way.
    copy: Vec<Octet>,
    /// A burst that waits for the next one, or for the end of the fault.
    held: Vec<Octet>,
    held_until: SimTime,
    /// What has come out and was not taken.
    out: Arrivals,
    /// When the last byte that was taken was complete.
    taken: Option<SimTime>,
    /// Bytes that did not pass as they were.
    harmed: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Fate {
    dropped: bool,
    delay: SimDuration,
    copied: bool,
    held: bool,
}

impl Distortion {
    /// Those faults of the schedule that are `on` a place, for the direction `way`.
    pub(crate) fn new(
        on: &str,
        way: &str,
        babbles: bool,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
    ) -> Result<Self, WireError> {
        nonzero(on, "byte time", byte_time)?;
        let here = schedule.faults.iter().filter(|fault| fault.on == on);
        let faults: Vec<Fault> = here.cloned().collect();
        faults.iter().try_for_each(Fault::check)?;
        let named = |what: &str| stream(schedule.seed, &format!("{on}/{what}/{way}"));
        let noise = Noise::new(&faults, babbles, named("noise"));
        let state = State {
            stream: named("faults"),
            noise,
            last_in: None,
            last_out: None,
            fate: Fate::default(),
            open: false,
            copy: Vec::new(),
            held: Vec::new(),
            held_until: SimTime::ZERO,
            out: Arrivals::default(),
            taken: None,
            harmed: 0,
        };
        Ok(Self {
            faults,
            byte_time,
            state,
        })
    }

    /// Bytes that did not pass as they were.
    pub(crate) fn harmed(&self) -> u64 {
        self.state.harmed
    }

    /// When the line fails, if it does not already.
    pub(crate) fn failure(&self) -> Option<SimTime> {
        let fails = |fault: &&Fault| matches!(fault.kind, FaultKind::Unplug { fails: true });
        self.faults.iter().filter(fails).map(|fault| fault.at).min()
    }

    /// Bytes come in.
    pub(crate) fn pass(&mut self, piece: Piece<'_>) {
        if self.passes_unharmed(piece) {
            let state = &mut self.state;
            state.out.push_piece(piece);
            state.last_in = Some(piece.last());
            state.last_out = Some(piece.last());
            (state.fate, state.open) = (Fate::default(), true);
            return;
        }
        let framing_error = piece.framing_error;
        for (n, &byte) in piece.bytes.iter().enumerate() {
            let octet = Octet {
                byte,
                framing_error,
            };
            self.pass_byte(piece.at(n), octet);
        }
    }

    /// Whether there is nothing to do but to hand the piece on.
    fn passes_unharmed(&self, piece: Piece<'_>) -> bool {
        let state = &self.state;
        let last = piece.last();
        let clear = !self
            .faults
            .iter()
            .any(|fault| fault.at <= last && piece.first < fault.until());
        clear
            && state.fate == Fate::default()
            && state.copy.is_empty()
            && state.held.is_empty()
            && state.noise.next_block().is_none_or(|block| block >= last)
            && state.noise.until + self.byte_time <= piece.first
            && state
                .last_out
                .is_none_or(|out| out + self.byte_time <= piece.first)
    }

    fn pass_byte(&mut self, at: SimTime, octet: Octet) {
        // A sender that does not wait for itself is none of the faults.
        let at = self.state.last_in.map_or(at, |last| last.max(at));
        self.before(at);
        let gap = match self.state.last_in {
            Some(last) => self.byte_time.min(at - last),
            None => self.byte_time,
        };
        if !self.state.open {
            self.begin_burst(at);
        }
        let state = &mut self.state;
        (state.last_in, state.open) = (Some(at), true);
        let shut =
            |fault: &Fault| matches!(fault.kind, FaultKind::Unplug { .. }) && fault.holds(at);
        if state.fate.dropped
            || at < state.noise.until + self.byte_time
            || self.faults.iter().any(shut)
        {
            state.harmed += 1;
            return;
        }
        let Some(octet) = self.flip(at, octet) else {
            return;
        };
        let state = &mut self.state;
        if state.fate.copied {
            state.copy.push(octet);
        }
        if state.fate.held {
            state.harmed += 1;
            state.held.push(octet);
            return;
        }
        state.harmed += u64::from(!state.fate.delay.is_zero());
        let earliest = state.last_out.map_or(at, |last| last + gap);
        let out = (at + state.fate.delay).max(earliest);
        state.out.push_byte(out, self.byte_time, octet);
        state.last_out = Some(out);
    }

    /// Draws what happens to the burst that begins with the byte complete at `at`.
    fn begin_burst(&mut self, at: SimTime) {
        let state = &mut self.state;
        state.fate = Fate::default();
        for fault in self.faults.iter().filter(|fault| fault.holds(at)) {
            match fault.kind {
                FaultKind::Drop { probability } => {
                    state.fate.dropped |= state.stream.unit() < probability;
                }
                FaultKind::Delay { by } => state.fate.delay += by,
                FaultKind::Duplicate { probability } => {
                    state.fate.copied |= state.stream.unit() < probability;
                }
                // One at a time: the next burst is what it changes places with.
                FaultKind::Reorder { probability }
                    if state.stream.unit() < probability && state.held.is_empty() =>
                {
                    state.fate.held = true;
                    state.held_until = fault.until();
                }
                _ => {}
            }
        }
    }

    /// Turns bits round: the start bit, eight data bits and the stop bit, in the order in which they pass. None if the receiver
    /// does not see the start bit, so that the byte is lost.
    fn flip(&mut self, at: SimTime, octet: Octet) -> Option<Octet> {
        let (mut flipped, mut unseen) = (octet, false);
        for fault in self.faults.iter().filter(|fault| fault.holds(at)) {
            if let FaultKind::Flip { rate } = fault.kind {
                let mut turned = || self.state.stream.unit() < rate;
                unseen ^= turned();
                for bit in 0..8 {
                    flipped.byte ^= u8::from(turned()) << bit;
                }
                flipped.framing_error ^= turned();
            }
        }
        self.state.harmed += u64::from(unseen || flipped != octet);
        (!unseen).then_some(flipped)
    }

    /// How long after its last byte a burst is over.
    fn pause(&self) -> SimDuration {
        self.byte_time * 2
    }

    /// When the burst under way is over.
    fn burst_ends(&self) -> Option<SimTime> {
        let last = self.state.last_in.filter(|_| self.state.open)?;
        Some(last + self.pause())
    }

    /// Everything that happens before a byte that is complete at `at`.
    fn before(&mut self, at: SimTime) {
        self.happen(|event| event < at);
    }

    /// Lets everything happen that does by `now`; every byte complete by then has come in.
    pub(crate) fn settle(&mut self, now: SimTime) {
        if self.next_event().is_none_or(|event| event > now) {
            return;
        }
        self.happen(|event| event <= now);
    }

    fn happen(&mut self, due: impl Fn(SimTime) -> bool) {
        loop {
            let (ends, release, block) = (
                self.burst_ends(),
                self.release(),
                self.state.noise.next_block(),
            );
            let next = [ends, release, block].into_iter().flatten().min();
            let Some(next) = next.filter(|next| due(*next)) else {
                return;
            };
            if ends == Some(next) {
                self.end_burst(next);
            } else if release == Some(next) {
                let held = mem::take(&mut self.state.held);
                self.state.held = self.put(next, held);
            } else {
                let after = self.state.last_out.unwrap_or(next);
                let state = &mut self.state;
                let made = state
                    .noise
                    .block(&self.faults, self.byte_time, after, &mut state.out);
                if made > 0 {
                    state.last_out = Some(state.noise.until.max(after));
                    state.harmed += made;
                }
            }
        }
    }

    /// When the burst that waits does so no longer.
    fn release(&self) -> Option<SimTime> {
        let waits = !self.state.held.is_empty() && !self.state.open;
        waits.then_some(self.state.held_until)
    }

    /// The burst under way is over: its copy follows, and so does the one that it has changed places with.
    fn end_burst(&mut self, now: SimTime) {
        self.state.open = false;
        let mut copy = mem::take(&mut self.state.copy);
        let fate = mem::take(&mut self.state.fate);
        if fate.held {
            self.state.held.append(&mut copy);
            self.state.copy = copy;
            self.state.held_until = self.state.held_until.max(now);
            return;
        }
        self.state.harmed += copy.len() as u64;
        self.state.copy = self.put(now, copy);
        let held = mem::take(&mut self.state.held);
        self.state.held = self.put(now, held);
    }

    /// Lets bytes come out from `now` on, one after the other; gives the empty buffer back.
    fn put(&mut self, now: SimTime, mut bytes: Vec<Octet>) -> Vec<Octet> {
        for octet in bytes.drain(..) {
            let start = self.state.last_out.map_or(now, |last| last.max(now));
            let at = start + self.byte_time;
            self.state.out.push_byte(at, self.byte_time, octet);
            self.state.last_out = Some(at);
        }
        bytes
    }

    /// When something happens next by itself.
    pub(crate) fn next_event(&self) -> Option<SimTime> {
        let state = &self.state;
        let follows = !state.copy.is_empty() || !state.held.is_empty();
        let ends = self.burst_ends().filter(|_| follows);
        [ends, self.release(), state.noise.next_block()]
            .into_iter()
            .flatten()
            .min()
    }

    /// When the next byte that has come out is complete: of those that follow one another, the first and the last.
    pub(crate) fn next_byte(&self) -> Option<SimTime> {
        let piece = self.state.out.pieces().next()?;
        let goes_on = self
            .state
            .taken
            .is_some_and(|taken| taken + piece.spacing == piece.first);
        Some(if goes_on { piece.last() } else { piece.first })
    }

    /// When so many bytes more that have come out are complete.
    pub(crate) fn byte(&self, count: usize) -> Option<SimTime> {
        self.state.out.at(count.saturating_sub(1))
    }

    /// Takes what has come out by `now`.
    pub(crate) fn take(&mut self, now: SimTime, taken: impl FnMut(Piece<'_>)) {
        let count = self.state.out.complete(now);
        if count > 0 {
            self.state.taken = self.state.out.at(count - 1);
            self.state.out.take(count, taken);
        }
    }

    /// Takes everything that has come out, announced bytes included.
    pub(crate) fn take_all(&mut self, taken: impl FnMut(Piece<'_>)) {
        let count = self.state.out.len();
        self.state.out.take(count, taken);
    }

    /// Takes the first stretch of what has come out, announced bytes included.
    pub(crate) fn take_piece(&mut self, taken: impl FnMut(Piece<'_>)) {
        let count = self
            .state
            .out
            .pieces()
            .next()
            .map_or(0, |piece| piece.bytes.len());
        self.state.out.take(count, taken);
    }

    pub(crate) fn save(&self) -> Snapshot {
        Snapshot::of(&self.state)
    }

    pub(crate) fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.state = snapshot.read()?;
        Ok(())
    }
}
