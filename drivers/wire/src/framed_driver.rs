use serde::{Deserialize, Serialize, de::DeserializeOwned};
use twinrig_kernel::{
    Direction, HostTime, Layout, Port, SimDuration, Snapshot, SnapshotError, Unit,
};
use twinrig_runtime::{Driver, DriverError, Transfer};

use crate::{FrameMatch, Framer, FramerState};

/// What of a driver is its device's own: what to ask and what answers mean. [`FramedDriver`] makes a driver of it.
///
/// The implementor is what was configured and does not change; everything that changes is [`Protocol::State`].
pub trait Protocol: Send {
    /// Everything that changes: all of it is saved and restored.
    type State: Serialize + DeserializeOwned + Send;

    /// How often opening and closing are asked for before they are given up.
    const ATTEMPTS: u32;

    /// What can be seen of it, by name and unit, beside the bytes that belonged to no frame. The values are those of
    /// [`Protocol::read_diagnostics`].
    const DIAGNOSTICS: &'static [(&'static str, Unit)] = &[];

    /// What stands at the front of the bytes that come from the device; see [`Framer`].
    fn match_frame(front: &[u8]) -> FrameMatch;

    /// Before anything has happened.
    fn initial(&self) -> Self::State;

    /// Name, for messages, gauges and recordings: that of its bus in the scenario.
    fn name(&self) -> &str;

    /// Output ports are data that it brings to the process, input ports data that it takes from it.
    fn ports(&self) -> Vec<Port>;

    /// Appends to `request` what is to be sent, if anything, and says how long to wait. None if there is nothing to wait for,
    /// and the errand is over. `from_process` holds the input ports, end to end, in order, for a transfer.
    fn request(
        &self,
        state: &mut Self::State,
        kind: RequestKind,
        from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration>;

    /// Takes a frame, and says what it means for the errand that waits, if one does.
    fn receive(
        &self,
        state: &mut Self::State,
        kind: Option<RequestKind>,
        frame: &[u8],
    ) -> FrameOutcome;

    /// Waiting is over, and nothing came that ended it: counts that, if it counts.
    fn time_out(&self, state: &mut Self::State, kind: RequestKind) {
        let _ = (state, kind);
    }

    /// Why the device could not be opened, with what can be done about it.
    fn refusal(&self, state: &Self::State) -> String;

    /// The output ports, end to end, in order.
    fn to_process<'s>(&self, state: &'s Self::State) -> &'s [f64];

    /// Writes the gauges, in order.
    fn read_diagnostics(&self, state: &Self::State, values: &mut [f64]) {
        let _ = (state, values);
    }
}

/// What a driver is told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RequestKind {
    /// Get the device ready. Asked again if waiting is over, and an error after the last attempt.
    Open,
    /// A transfer. Over when waiting is.
    Transfer,
    /// Leave the device in a safe state. Asked again if waiting is over, and an error after the last attempt. In lockstep a
    /// run ends when its time is over: only at hardware is anything closed.
    Close,
}

/// What a frame means for what is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameOutcome {
    /// Nothing; or all that it was waited for is still to come.
    Nothing,
    /// A part of it: the rest may take that long from now on.
    More(SimDuration),
    /// It is over.
    Over,
}

/// A driver of a device that is spoken to in frames: whatever waits has an end, opening and closing are tried several times,
/// and everything that changes is saved.
///
/// A protocol that is of another kind, with several devices on one line for example, implements [`Driver`] itself.
#[derive(Debug)]
pub struct FramedDriver<P: Protocol> {
    protocol: P,
    framer: Framer,
    pending: Pending,
    state: P::State,
}

/// How far it is with its errand.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Pending {
    /// What is waited for, and until when.
    waiting: Option<(RequestKind, HostTime)>,
    /// How often it has asked.
    asked: u32,
    request: Vec<u8>,
    /// What could not be done: opening or closing.
    failed: Option<RequestKind>,
}

impl<P: Protocol> FramedDriver<P> {
    /// Of a protocol.
    ///
    /// # Panics
    /// If its output ports do not hold as many numbers as [`Protocol::to_process`] gives.
    pub fn new(protocol: P) -> Self {
        let state = protocol.initial();
        let ports = protocol.ports();
        let outputs = Layout::of(&ports, Direction::Output).len();
        let given = protocol.to_process(&state).len();
        assert_eq!(
            given,
            outputs,
            "{} gives {given} numbers, and its output ports hold {outputs}",
            protocol.name()
        );
        Self {
            protocol,
            framer: Framer::new(P::match_frame),
            pending: Pending::default(),
            state,
        }
    }

    fn set_out(&mut self, now: HostTime, kind: RequestKind, from_process: &[f64]) {
        self.pending.asked = 0;
        self.pending.failed = None;
        self.request(now, kind, from_process);
    }

    fn request(&mut self, now: HostTime, kind: RequestKind, from_process: &[f64]) {
        let (state, request) = (&mut self.state, &mut self.pending.request);
        request.clear();
        let patience = self.protocol.request(state, kind, from_process, request);
        self.pending.asked += 1;
        self.pending.waiting = patience.map(|patience| (kind, later(now, patience)));
    }
}

fn later(now: HostTime, by: SimDuration) -> HostTime {
    HostTime::from_nanos(now.as_nanos().saturating_add(by.as_nanos()))
}

impl<P: Protocol> Driver for FramedDriver<P> {
    fn name(&self) -> &str {
        self.protocol.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.protocol.ports()
    }

    fn open(&mut self, now: HostTime) {
        self.set_out(now, RequestKind::Open, &[]);
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        self.set_out(now, RequestKind::Transfer, from_process);
    }

    fn close(&mut self, now: HostTime) {
        self.set_out(now, RequestKind::Close, &[]);
    }

    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        self.framer.push(bytes);
        while let Some(frame) = self.framer.next_frame() {
            let kind = self.pending.waiting.map(|(kind, _)| kind);
            let heard = self.protocol.receive(&mut self.state, kind, frame);
            match (heard, kind) {
                (FrameOutcome::Over, _) => self.pending.waiting = None,
                (FrameOutcome::More(patience), Some(kind)) => {
                    self.pending.waiting = Some((kind, later(now, patience)));
                }
                (FrameOutcome::Nothing, _) | (FrameOutcome::More(_), None) => {}
            }
        }
    }

    fn handle_timeout(&mut self, now: HostTime) {
        let Some((kind, _)) = self.pending.waiting.filter(|&(_, until)| now >= until) else {
            return;
        };
        self.pending.waiting = None;
        self.protocol.time_out(&mut self.state, kind);
        if kind == RequestKind::Transfer {
            return;
        }
        if self.pending.asked < P::ATTEMPTS {
            self.request(now, kind, &[]);
        } else {
            self.pending.failed = Some(kind);
        }
    }

    fn poll_timeout(&self) -> Option<HostTime> {
        self.pending.waiting.map(|(_, until)| until)
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        let any = !self.pending.request.is_empty();
        bytes.append(&mut self.pending.request);
        any
    }

    fn poll_transfer(&mut self) -> Result<Transfer, DriverError> {
        match self.pending.failed {
            None if self.pending.waiting.is_some() => Ok(Transfer::Busy),
            None => Ok(Transfer::Done),
            Some(RequestKind::Close) => {
                let why = format!(
                    "{} was asked {} times to come to rest and did not confirm it: it may still be at work",
                    self.name(),
                    P::ATTEMPTS
                );
                Err(DriverError { why })
            }
            Some(_) => {
                let why = self.protocol.refusal(&self.state);
                Err(DriverError { why })
            }
        }
    }

    fn to_process(&self) -> &[f64] {
        self.protocol.to_process(&self.state)
    }

    fn diagnostics(&self) -> Vec<Port> {
        diagnostics(self.name(), P::DIAGNOSTICS, "garbage")
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        if let [own @ .., garbage] = values {
            self.protocol.read_diagnostics(&self.state, own);
            *garbage = self.framer.skipped() as f64;
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.state, &self.pending, self.framer.state()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let framer: FramerState;
        (self.state, self.pending, framer) = snapshot.read()?;
        self.framer.set_state(framer);
        Ok(())
    }
}

/// One after the other, and the framer's own at last.
pub(crate) fn diagnostics(name: &str, own: &[(&str, Unit)], skipped: &str) -> Vec<Port> {
    own.iter()
        .chain(&[(skipped, Unit::One)])
        .map(|&(diagnostic, unit)| Port::output(format!("{name}/{diagnostic}"), unit, 1))
        .collect()
}
