use std::mem;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError, Stream, stream};
use twinrig_runtime::BusHealth;

use crate::arrivals::Octet;
use crate::burst_faults::BurstFaults;
use crate::channel::Channel;
use crate::error::nonzero;
use crate::frame_selection::{FrameSelection, SelectionState};
use crate::noise::Noise;
use crate::{Arrivals, Fault, FaultKind, FaultSchedule, FrameReader, Piece, WireError};

/// Fault injection into the bytes of one direction at one place. The output depends only on the
/// bytes and their times, not on the pieces in which they are passed in.
pub(crate) struct Distortion {
    faults: Vec<Fault>,
    byte_time: SimDuration,
    pub(crate) selection: FrameSelection,
    state: State,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    /// Random draws for bursts and bits.
    stream: Stream,
    noise: Noise,
    /// Completion time of the last input byte.
    last_in: Option<SimTime>,
    /// Completion time of the last output byte.
    last_out: Option<SimTime>,
    /// Faults drawn for the current burst.
    burst_faults: BurstFaults,
    /// Whether the current burst may continue.
    open: bool,
    /// Copy of the current burst.
    copy: Vec<Octet>,
    /// A burst delayed until the next one or until the end of the fault (reordering).
    held: Vec<Octet>,
    held_until: SimTime,
    /// Output bytes that are not taken yet.
    out: Arrivals,
    /// Completion time of the last byte taken.
    taken: Option<SimTime>,
    /// Number of bytes that were altered, delayed, lost or added.
    harmed: u64,
}

impl Distortion {
    /// Applies the faults of the schedule that are `on` this place to one direction. Without
    /// `frames`, a burst counts as a frame.
    pub(crate) fn new(
        on: &str,
        channel: Channel,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
        frames: Option<FrameReader>,
    ) -> Result<Self, WireError> {
        nonzero(on, "byte time", byte_time)?;
        let (faults, selection) = FrameSelection::of(on, channel, schedule, frames)?;
        let name = channel.name;
        let named = |what: &str| stream(schedule.seed, &format!("{on}/{what}/{name}"));
        let noise = Noise::new(&faults, channel.babbles, named("noise"));
        let state = State {
            stream: named("faults"),
            noise,
            last_in: None,
            last_out: None,
            burst_faults: BurstFaults::default(),
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
            selection,
            state,
        })
    }

    /// Accepts the messages of the host that `other`, the direction from the host, has read.
    pub(crate) fn accept_messages(&mut self, other: &mut Self) {
        self.selection.accept(&mut other.selection.messages);
    }

    /// Number of bytes that were altered, delayed, lost or added.
    pub(crate) fn harmed(&self) -> u64 {
        self.state.harmed
    }

    /// Time of the earliest fault that disconnects the line with an error.
    pub(crate) fn failure(&self) -> Option<SimTime> {
        let fails = |fault: &&Fault| matches!(fault.kind, FaultKind::Unplug { fails: true });
        self.faults.iter().filter(fails).map(|fault| fault.at).min()
    }

    /// Accepts input bytes.
    pub(crate) fn pass(&mut self, piece: Piece<'_>) {
        if self.passes_unchanged(piece) {
            let state = &mut self.state;
            state.out.push_piece(piece);
            state.last_in = Some(piece.last());
            state.last_out = Some(piece.last());
            (state.burst_faults, state.open) = (BurstFaults::default(), true);
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

    /// Whether no fault or pending burst affects the piece, so that it passes unchanged.
    fn passes_unchanged(&self, piece: Piece<'_>) -> bool {
        let state = &self.state;
        let last = piece.last();
        let clear = !self
            .faults
            .iter()
            .any(|fault| fault.at <= last && piece.first < fault.until());
        clear
            && !self.selection.reads()
            && state.burst_faults == BurstFaults::default()
            && state.copy.is_empty()
            && state.held.is_empty()
            && state.noise.next_block().is_none_or(|block| block >= last)
            && state.noise.until + self.byte_time <= piece.first
            && state
                .last_out
                .is_none_or(|out| out + self.byte_time <= piece.first)
    }

    fn pass_byte(&mut self, at: SimTime, octet: Octet) {
        // Overlapping input is serialised: it is not one of the faults.
        let at = self.state.last_in.map_or(at, |last| last.max(at));
        self.process_before(at);
        let gap = match self.state.last_in {
            Some(last) => self.byte_time.min(at - last),
            None => self.byte_time,
        };
        if !self.state.open {
            self.begin_burst(at);
        }
        (self.state.last_in, self.state.open) = (Some(at), true);
        self.transfer_byte(at, gap, octet);
        if self.selection.push(at, octet.byte) {
            self.end_burst(at);
        }
    }

    /// Outputs a byte of the current burst with its faults.
    fn transfer_byte(&mut self, at: SimTime, gap: SimDuration, octet: Octet) {
        let unplugged = self.is_unplugged(at);
        let state = &mut self.state;
        if unplugged || state.burst_faults.dropped || at < state.noise.until + self.byte_time {
            state.harmed += 1;
            return;
        }
        let Some(octet) = self.flip(at, octet) else {
            return;
        };
        let state = &mut self.state;
        if state.burst_faults.copied {
            state.copy.push(octet);
        }
        if state.burst_faults.held.is_some() {
            state.harmed += 1;
            state.held.push(octet);
            return;
        }
        state.harmed += u64::from(!state.burst_faults.delay.is_zero());
        let earliest = state.last_out.map_or(at, |last| last + gap);
        let out = (at + state.burst_faults.delay).max(earliest);
        state.out.push_byte(out, self.byte_time, octet);
        state.last_out = Some(out);
    }

    /// Whether the line is disconnected at `at`; each such fault is counted.
    fn is_unplugged(&mut self, at: SimTime) -> bool {
        let mut unplugged = false;
        for (index, fault) in self.faults.iter().enumerate() {
            // A loss of the supply is counted by `count_outages`.
            let (interrupts, counts) = match fault.kind {
                FaultKind::Unplug { .. } => (true, true),
                FaultKind::BrownOut { .. } => (true, false),
                _ => (false, false),
            };
            if interrupts && self.selection.is_active(index, fault, at) {
                unplugged = true;
                if counts {
                    self.selection.count(index);
                }
            }
        }
        unplugged
    }

    /// Adds the effects of the faults.
    pub(crate) fn report_effects(&self, health: &mut BusHealth) {
        health.fault_effects.extend(self.selection.effects());
    }

    /// Counts an effect of the faults of the supply that hold at `at`.
    pub(crate) fn count_outages(&mut self, at: SimTime) {
        for (index, fault) in self.faults.iter().enumerate() {
            if matches!(fault.kind, FaultKind::BrownOut { .. }) && fault.holds(at) {
                self.selection.count(index);
            }
        }
    }

    fn begin_burst(&mut self, at: SimTime) {
        let (state, selection) = (&mut self.state, &mut self.selection);
        let holds = !state.held.is_empty();
        let burst = BurstFaults::draw(&self.faults, selection, &mut state.stream, holds, at);
        state.held_until = burst.held.unwrap_or(state.held_until);
        state.burst_faults = burst;
    }

    /// Flips bits of a byte in the order of transmission: start bit, eight data bits, stop bit.
    /// None if the start bit is flipped: the receiver loses the byte.
    fn flip(&mut self, at: SimTime, octet: Octet) -> Option<Octet> {
        let (mut flipped, mut lost) = (octet, false);
        for (index, fault) in self.faults.iter().enumerate() {
            if let FaultKind::Flip { rate } = fault.kind
                && self.selection.is_active(index, fault, at)
            {
                let before = (flipped, lost);
                let mut flipped_bit = || self.state.stream.unit() < rate;
                lost ^= flipped_bit();
                for bit in 0..8 {
                    flipped.byte ^= u8::from(flipped_bit()) << bit;
                }
                flipped.framing_error ^= flipped_bit();
                if before != (flipped, lost) {
                    self.selection.count(index);
                }
            }
        }
        self.state.harmed += u64::from(lost || flipped != octet);
        (!lost).then_some(flipped)
    }

    /// Silence after the last byte that ends a burst.
    fn pause(&self) -> SimDuration {
        self.byte_time * 2
    }

    /// End time of the current burst.
    fn burst_ends(&self) -> Option<SimTime> {
        let last = self.state.last_in.filter(|_| self.state.open)?;
        Some(last + self.pause())
    }

    /// Processes all events before a byte that is complete at `at`.
    fn process_before(&mut self, at: SimTime) {
        self.process_events(|event| event < at);
    }

    /// Processes all events up to `now`; every byte complete by then has been passed in.
    pub(crate) fn process_until(&mut self, now: SimTime) {
        if self.next_event().is_none_or(|event| event > now) {
            return;
        }
        self.process_events(|event| event <= now);
    }

    fn process_events(&mut self, due: impl Fn(SimTime) -> bool) {
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
                self.selection.end_burst();
                self.end_burst(next);
            } else if release == Some(next) {
                let held = mem::take(&mut self.state.held);
                self.state.held = self.output(next, held);
            } else {
                let after = self.state.last_out.unwrap_or(next);
                let state = &mut self.state;
                let (index, generated) =
                    state
                        .noise
                        .block(&self.faults, self.byte_time, after, &mut state.out);
                if generated > 0 {
                    self.selection.count(index);
                    state.last_out = Some(state.noise.until.max(after));
                    state.harmed += generated;
                }
            }
        }
    }

    /// Time at which the held burst is released unless another burst comes first.
    fn release(&self) -> Option<SimTime> {
        let waits = !self.state.held.is_empty() && !self.state.open;
        waits.then_some(self.state.held_until)
    }

    /// Ends the current burst: outputs its copy and the burst that it swaps places with.
    fn end_burst(&mut self, now: SimTime) {
        self.state.open = false;
        let mut copy = mem::take(&mut self.state.copy);
        let burst_faults = mem::take(&mut self.state.burst_faults);
        if burst_faults.held.is_some() {
            self.state.held.append(&mut copy);
            self.state.copy = copy;
            self.state.held_until = self.state.held_until.max(now);
            return;
        }
        self.state.harmed += copy.len() as u64;
        self.state.copy = self.output(now, copy);
        let held = mem::take(&mut self.state.held);
        self.state.held = self.output(now, held);
    }

    /// Outputs bytes one after another from `now` on; returns the empty buffer.
    fn output(&mut self, now: SimTime, mut bytes: Vec<Octet>) -> Vec<Octet> {
        for octet in bytes.drain(..) {
            let start = self.state.last_out.map_or(now, |last| last.max(now));
            let at = start + self.byte_time;
            self.state.out.push_byte(at, self.byte_time, octet);
            self.state.last_out = Some(at);
        }
        bytes
    }

    /// Time of the next event that needs no further input.
    pub(crate) fn next_event(&self) -> Option<SimTime> {
        let state = &self.state;
        let pending = !state.copy.is_empty() || !state.held.is_empty();
        let ends = self.burst_ends().filter(|_| pending);
        [ends, self.release(), state.noise.next_block()]
            .into_iter()
            .flatten()
            .min()
    }

    /// Completion time of the next output byte: of contiguous bytes, only the first and the last.
    pub(crate) fn next_byte(&self) -> Option<SimTime> {
        let piece = self.state.out.pieces().next()?;
        let contiguous = self
            .state
            .taken
            .is_some_and(|taken| taken + piece.spacing == piece.first);
        Some(if contiguous {
            piece.last()
        } else {
            piece.first
        })
    }

    /// Completion time of the `count`-th output byte from here.
    pub(crate) fn byte(&self, count: usize) -> Option<SimTime> {
        self.state.out.at(count.saturating_sub(1))
    }

    /// Takes the output bytes complete by `now`.
    pub(crate) fn take(&mut self, now: SimTime, taken: impl FnMut(Piece<'_>)) {
        let count = self.state.out.complete(now);
        if count > 0 {
            self.state.taken = self.state.out.at(count - 1);
            self.state.out.take(count, taken);
        }
    }

    /// Takes all output bytes, including announced ones.
    pub(crate) fn take_all(&mut self, taken: impl FnMut(Piece<'_>)) {
        let count = self.state.out.len();
        self.state.out.take(count, taken);
    }

    /// Takes the first run of the output bytes, including announced ones.
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
        Snapshot::of(&(&self.state, self.selection.save()))
    }

    pub(crate) fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (state, selection): (State, SelectionState) = snapshot.read()?;
        self.state = state;
        self.selection.restore(selection);
        Ok(())
    }
}
