use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;
use twinrig_runtime::{DriverPhase, FaultDirection, FaultEffect, PhaseClock};

use crate::channel::Channel;
use crate::{Fault, FaultSchedule, FrameReader, Framer, FramerState, WireError};

/// Greatest number of messages of the host that are announced ahead of an answer: far more than
/// fit into the transmit buffer of a converter.
const MESSAGES_MAX: usize = 1024;

/// Choice of the faults at one place that harm the current burst of one direction, with their
/// effects.
pub(crate) struct FrameSelection {
    /// Number of each fault in the schedule.
    numbers: Vec<usize>,
    /// Code of the message behind which each fault counts frames.
    after: Vec<Option<u8>>,
    /// Whether a fault at the place chooses frames, so that each byte is to be read.
    reads: bool,
    reader: Option<FrameReader>,
    /// Whether the frames of this direction include messages of the host.
    from_host: bool,
    framer: Option<Framer>,
    /// Messages that are not passed to the other direction yet.
    pub(crate) messages: Vec<(SimTime, u8)>,
    state: SelectionState,
}

/// Changing state, to be saved and restored.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct SelectionState {
    framer: FramerState,
    phase: PhaseClock,
    /// Code of the last message of the host.
    last: Option<u8>,
    /// Messages of the other direction, with the times at which they are complete.
    pending: VecDeque<(SimTime, u8)>,
    /// State of each fault.
    faults: Vec<FaultState>,
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct FaultState {
    /// Number of frames that were counted.
    counted: u64,
    /// Whether the current frame counts.
    counts: bool,
    /// Whether the fault harms the current burst.
    chosen: bool,
    /// Number of times that it took effect.
    harmed: u64,
}

impl FrameSelection {
    /// Returns the faults of the schedule that are `on` this place in one direction, and their
    /// selection.
    pub(crate) fn of(
        on: &str,
        channel: Channel,
        schedule: &FaultSchedule,
        reader: Option<FrameReader>,
    ) -> Result<(Vec<Fault>, Self), WireError> {
        let here = schedule.faults.iter().enumerate();
        let here: Vec<(usize, &Fault)> = here
            .filter(|(_, fault)| channel.reaches(on, fault))
            .collect();
        here.iter().try_for_each(|(_, fault)| fault.check())?;
        let reads = here.iter().any(|(_, fault)| fault.select.frames.is_some());
        let acts = |fault: &Fault| {
            let direction = fault.select.direction;
            direction.is_none_or(|direction| direction == channel.direction)
        };
        let (numbers, faults): (Vec<usize>, Vec<Fault>) = here
            .into_iter()
            .filter(|(_, fault)| acts(fault))
            .map(|(number, fault)| (number, fault.clone()))
            .unzip();
        let selection = Self {
            reads,
            from_host: channel.direction == FaultDirection::Out,
            ..Self::new(&faults, numbers, reader)?
        };
        Ok((faults, selection))
    }

    /// Prepares the selection for `faults`, which have these numbers in the schedule.
    fn new(
        faults: &[Fault],
        numbers: Vec<usize>,
        reader: Option<FrameReader>,
    ) -> Result<Self, WireError> {
        let after = |fault: &Fault| {
            let frames = fault.select.frames.as_ref();
            let Some(kind) = frames.and_then(|frames| frames.after.as_ref()) else {
                return Ok(None);
            };
            let kinds = reader.map_or(&[][..], |reader| reader.kinds);
            let code = reader.and_then(|reader| reader.code_of(kind));
            code.map(Some).ok_or_else(|| WireError::Message {
                on: fault.on.clone(),
                found: kind.clone(),
                known: names(kinds),
            })
        };
        let state = SelectionState {
            faults: vec![FaultState::default(); faults.len()],
            ..SelectionState::default()
        };
        Ok(Self {
            numbers,
            after: faults.iter().map(after).collect::<Result<_, _>>()?,
            reads: false,
            reader,
            from_host: false,
            framer: reader.map(|reader| Framer::new(reader.match_frame)),
            messages: Vec::new(),
            state,
        })
    }

    /// Whether each byte is to be read.
    pub(crate) fn reads(&self) -> bool {
        self.reads
    }

    /// Records that a phase of the driver begins.
    pub(crate) fn begin_phase(&mut self, now: SimTime, phase: DriverPhase) {
        self.state.phase.begin(now, phase);
    }

    /// Whether a fault harms a byte of the current burst that is complete at `at`.
    pub(crate) fn is_active(&self, index: usize, fault: &Fault, at: SimTime) -> bool {
        match fault.select.frames {
            Some(_) => self.state.faults[index].chosen,
            None => self.is_within(fault, at),
        }
    }

    /// Whether the instant is in the window and the phase of a fault.
    fn is_within(&self, fault: &Fault, at: SimTime) -> bool {
        let phase = fault.select.phase;
        fault.holds(at) && phase.is_none_or(|phase| phase == self.state.phase.at(at))
    }

    /// Counts an effect of a fault.
    pub(crate) fn count(&mut self, index: usize) {
        self.state.faults[index].harmed += 1;
    }

    /// Begins a burst whose first byte is complete at `at`.
    pub(crate) fn begin_burst(&mut self, faults: &[Fault], at: SimTime) {
        while let Some(&(_, code)) = self.state.pending.front().filter(|it| it.0 < at) {
            self.state.last = Some(code);
            self.state.pending.pop_front();
        }
        for (index, fault) in faults.iter().enumerate() {
            let Some(frames) = &fault.select.frames else {
                continue;
            };
            let after = self.after[index];
            let counts = self.is_within(fault, at) && (after.is_none() || after == self.state.last);
            let state = &mut self.state.faults[index];
            state.counts = counts;
            state.chosen = counts && frames.count.includes(state.counted + 1);
        }
    }

    /// Ends a burst by a pause; it is a frame where the frames of the protocol are not known.
    pub(crate) fn end_burst(&mut self) {
        if self.framer.is_none() {
            self.end_frame();
        }
    }

    fn end_frame(&mut self) {
        for state in &mut self.state.faults {
            state.counted += u64::from(std::mem::take(&mut state.counts));
        }
    }

    /// Reads a byte that is complete at `at`; returns whether it ends a frame.
    pub(crate) fn push(&mut self, at: SimTime, byte: u8) -> bool {
        let (Some(framer), Some(reader)) = (&mut self.framer, &self.reader) else {
            return false;
        };
        if !self.reads {
            return false;
        }
        framer.push(&[byte]);
        let mut ended = false;
        while let Some(frame) = framer.next_frame() {
            ended = true;
            if self.from_host
                && let Some(code) = reader.message(frame)
            {
                self.state.last = Some(code);
                self.messages.push((at, code));
            }
        }
        if ended {
            self.end_frame();
        }
        ended
    }

    /// Accepts the messages of the other direction.
    pub(crate) fn accept(&mut self, messages: &mut Vec<(SimTime, u8)>) {
        if self.after.iter().all(Option::is_none) {
            messages.clear();
            return;
        }
        let pending = &mut self.state.pending;
        pending.extend(messages.drain(..));
        let surplus = pending.len().saturating_sub(MESSAGES_MAX);
        pending.drain(..surplus);
    }

    /// Returns the effects of the faults.
    pub(crate) fn effects(&self) -> impl Iterator<Item = FaultEffect> {
        let states = self.numbers.iter().zip(&self.state.faults);
        states.map(|(&fault, state)| FaultEffect {
            fault,
            harmed: state.harmed,
        })
    }

    pub(crate) fn save(&self) -> SelectionState {
        let mut state = self.state.clone();
        if let Some(framer) = &self.framer {
            state.framer.clone_from(framer.state());
        }
        state
    }

    pub(crate) fn restore(&mut self, mut state: SelectionState) {
        // A snapshot of another part must not make a later call panic.
        state
            .faults
            .resize_with(self.numbers.len(), FaultState::default);
        if let Some(framer) = &mut self.framer {
            framer.set_state(std::mem::take(&mut state.framer));
        }
        self.state = state;
    }
}

fn names(kinds: &[(&str, u8)]) -> String {
    let names: Vec<&str> = kinds.iter().map(|(name, _)| *name).collect();
    if names.is_empty() {
        return "none, the frames on this wire have no kinds".to_owned();
    }
    names.join(", ")
}
