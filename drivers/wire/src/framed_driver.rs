use serde::{Deserialize, Serialize, de::DeserializeOwned};
use twinrig_kernel::{Direction, HostTime, Layout, Port, SimDuration, Snapshot, SnapshotError};
use twinrig_runtime::{BusHealth, Driver, DriverError};

use crate::{
    Diagnostics, FrameCounts, FramedMessage, Framer, FramerState, Pacing, TrafficError, TrafficLog,
};

/// Device-specific part of a driver: the requests and the interpretation of the answers.
/// [`FramedDriver`] turns it into a driver.
///
/// The implementor holds the configuration, which does not change; all changing state is in
/// [`Protocol::State`].
pub trait Protocol: Send {
    /// Changing state: all of it is saved and restored.
    type State: Serialize + DeserializeOwned + Send;

    /// Messages of the device.
    type Message: FramedMessage;

    /// Number of attempts at opening and closing before an error is reported.
    const ATTEMPTS: u32 = 3;

    /// Returns the initial state.
    fn initial(&self) -> Self::State;

    /// Name, for messages, diagnostics and recordings: that of the bus in the scenario.
    fn name(&self) -> &str;

    /// Returns the ports: outputs are data to the process, inputs data from it.
    fn ports(&self) -> Vec<Port>;

    /// Appends the bytes to be sent to `request` and returns the time-out of the answer. None if no
    /// answer is expected: the request is complete. For a transfer, `from_process` holds the input
    /// ports, end to end, in order.
    fn request(
        &self,
        state: &mut Self::State,
        kind: RequestKind,
        from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration>;

    /// Handles a message and returns its effect on the pending request, if one is pending. Frames
    /// with invalid content are ignored.
    fn handle_message(
        &self,
        state: &mut Self::State,
        kind: Option<RequestKind>,
        message: Self::Message,
    ) -> FrameOutcome;

    /// Handles a time-out of the pending request, for example by counting it.
    fn time_out(&self, state: &mut Self::State, kind: RequestKind) {
        let _ = (state, kind);
    }

    /// Returns the reason why the device could not be opened, with a remedy.
    fn open_failure(&self, state: &Self::State) -> String;

    /// Returns the output ports, end to end, in order.
    fn to_process<'s>(&self, state: &'s Self::State) -> &'s [f64];

    /// Word for the device in reports: `servo board`.
    const DEVICE: &'static str = "device";

    /// Returns when frames of the device are expected; None where it is not known, so that its
    /// silence is not judged.
    fn pacing(&self) -> Option<Pacing> {
        None
    }

    /// Returns the counts since the creation of the state, for the health of the bus.
    fn counts(&self, state: &Self::State) -> FrameCounts {
        let _ = state;
        FrameCounts::default()
    }

    /// Reports the diagnostics, besides the count of bytes outside frames.
    fn report(&self, state: &Self::State, diagnostics: &mut Diagnostics<'_>) {
        let _ = (state, diagnostics);
    }
}

/// Kind of a request to a driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RequestKind {
    /// Prepares the device. Repeated after a time-out; an error after the last attempt.
    Open,
    /// Transfers data. Complete at the latest at its time-out.
    Transfer,
    /// Brings the device into a safe state. Repeated after a time-out; an error after the last
    /// attempt. In lockstep a run ends with its duration: devices are closed on hardware only.
    Close,
}

/// Effect of a frame on the pending request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameOutcome {
    /// The request is not complete, and its time-out does not change. Also if no request is
    /// pending.
    Incomplete,
    /// A part of the answer; the rest is expected within this time from now.
    More(SimDuration),
    /// The request is complete.
    Complete,
}

impl FrameOutcome {
    /// Returns `Complete` if `condition` holds, otherwise `Incomplete`.
    pub const fn complete_if(condition: bool) -> Self {
        if condition {
            Self::Complete
        } else {
            Self::Incomplete
        }
    }
}

/// Driver of a device with a framed protocol: every wait has a time-out, opening and closing are
/// repeated up to [`Protocol::ATTEMPTS`] times, and all changing state is saved.
///
/// A protocol of another kind, for example with several devices on one line, implements [`Driver`]
/// itself.
#[derive(Debug)]
pub struct FramedDriver<P: Protocol> {
    protocol: P,
    framer: Framer,
    pending: Pending,
    traffic: TrafficLog,
    state: P::State,
}

/// Number of the only device of the bus.
const DEVICE: u16 = 0;

/// Progress of the current request.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Pending {
    /// Kind and time-out of the pending request.
    waiting: Option<(RequestKind, HostTime)>,
    /// Number of attempts so far.
    attempts: u32,
    request: Vec<u8>,
    /// Kind of the request that failed: opening or closing.
    failed: Option<RequestKind>,
}

impl<P: Protocol> FramedDriver<P> {
    /// Makes a driver of a protocol.
    ///
    /// # Panics
    /// If the length of [`Protocol::to_process`] differs from that of the output ports.
    pub fn new(protocol: P) -> Self {
        let state = protocol.initial();
        let ports = protocol.ports();
        let outputs = Layout::of(&ports, Direction::Output).len();
        let values = protocol.to_process(&state).len();
        assert_eq!(
            values,
            outputs,
            "{}: to_process returns {values} numbers, but the output ports hold {outputs}",
            protocol.name()
        );
        Self {
            protocol,
            framer: Framer::new(P::Message::match_frame),
            pending: Pending::default(),
            traffic: TrafficLog::default(),
            state,
        }
    }

    /// Returns the changing state of the protocol, for a driver around this one.
    pub fn state(&self) -> &P::State {
        &self.state
    }

    /// Returns the protocol and its changing state, for a driver around this one: for example one
    /// that passes on the times of arrivals, or every message.
    pub fn protocol_mut(&mut self) -> (&P, &mut P::State) {
        (&self.protocol, &mut self.state)
    }

    fn begin_request(&mut self, now: HostTime, kind: RequestKind, from_process: &[f64]) {
        self.pending.attempts = 0;
        self.pending.failed = None;
        self.request(now, kind, from_process);
    }

    fn request(&mut self, now: HostTime, kind: RequestKind, from_process: &[f64]) {
        let (state, request) = (&mut self.state, &mut self.pending.request);
        request.clear();
        let timeout = self.protocol.request(state, kind, from_process, request);
        self.pending.attempts += 1;
        self.pending.waiting = timeout.map(|timeout| (kind, now + timeout));
        if !request.is_empty() {
            let answered = matches!(self.protocol.pacing(), Some(Pacing::Requests(_)));
            self.traffic.request(answered.then_some(DEVICE), now);
        }
    }

    /// Records what a message or a time-out has changed in the counts; returns whether there was an
    /// error.
    fn record(&mut self, now: HostTime, before: &FrameCounts) -> bool {
        let counts = self.protocol.counts(&self.state);
        match (counts.accepted - before.accepted, self.protocol.pacing()) {
            (0, _) => {}
            (new, Some(Pacing::Frames(_))) => self.traffic.frames(DEVICE, new, now),
            (_, _) => self.traffic.answer(DEVICE, now),
        }
        let mut any = false;
        for (kind, count) in counts.errors.into_iter().flatten() {
            let same = |error: &&(TrafficError, u64)| error.0 == kind;
            let earlier = before.errors.iter().flatten().find(same);
            let new = count - earlier.map_or(0, |(_, count)| *count);
            self.traffic.error(kind, Some(DEVICE), new, now);
            any |= new > 0;
        }
        any
    }

    /// Begins to judge silence at the end of the opening.
    fn opened(&mut self, now: HostTime) {
        self.traffic.forget_silences();
        if let Some(Pacing::Frames(_)) = self.protocol.pacing() {
            self.traffic.expect_frames(DEVICE, now);
        }
    }

    fn report(&self, diagnostics: &mut Diagnostics<'_>) {
        self.protocol.report(&self.state, diagnostics);
        diagnostics.count("garbage", self.framer.skipped());
    }
}

impl<P: Protocol> Driver for FramedDriver<P> {
    fn name(&self) -> &str {
        self.protocol.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.protocol.ports()
    }

    fn open(&mut self, now: HostTime) {
        self.begin_request(now, RequestKind::Open, &[]);
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        self.begin_request(now, RequestKind::Transfer, from_process);
    }

    fn close(&mut self, now: HostTime) {
        self.traffic.forget_silences();
        self.begin_request(now, RequestKind::Close, &[]);
    }

    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        let skipped = self.framer.skipped();
        self.framer.push(bytes);
        while let Some(frame) = self.framer.next_frame() {
            let Ok(message) = P::Message::decode(frame) else {
                let kind = TrafficError::Implausible;
                self.traffic.error(kind, Some(DEVICE), 1, now);
                continue;
            };
            let kind = self.pending.waiting.map(|(kind, _)| kind);
            let before = self.protocol.counts(&self.state);
            let outcome = self.protocol.handle_message(&mut self.state, kind, message);
            self.record(now, &before);
            match (outcome, kind) {
                (FrameOutcome::Complete, kind) => {
                    self.pending.waiting = None;
                    if kind == Some(RequestKind::Open) {
                        self.opened(now);
                    }
                }
                (FrameOutcome::More(timeout), Some(kind)) => {
                    self.pending.waiting = Some((kind, now + timeout));
                }
                (FrameOutcome::Incomplete, _) | (FrameOutcome::More(_), None) => {}
            }
        }
        let garbled = u64::from(self.framer.skipped() > skipped);
        self.traffic
            .error(TrafficError::Garbled, None, garbled, now);
    }

    fn handle_timeout(&mut self, now: HostTime) {
        let Some((kind, _)) = self.pending.waiting.filter(|&(_, until)| now >= until) else {
            return;
        };
        self.pending.waiting = None;
        let before = self.protocol.counts(&self.state);
        self.protocol.time_out(&mut self.state, kind);
        let counted = self.record(now, &before);
        if kind != RequestKind::Transfer && !counted {
            let error = TrafficError::NoAnswer;
            self.traffic.error(error, Some(DEVICE), 1, now);
        }
        if kind == RequestKind::Transfer {
            return;
        }
        if self.pending.attempts < P::ATTEMPTS {
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

    fn is_busy(&self) -> Result<bool, DriverError> {
        match self.pending.failed {
            None => Ok(self.pending.waiting.is_some()),
            Some(RequestKind::Close) => {
                let why = format!(
                    "{} did not confirm any of {} shutdown requests: the device may still be active",
                    self.name(),
                    P::ATTEMPTS
                );
                Err(DriverError { why })
            }
            Some(_) => {
                let why = self.protocol.open_failure(&self.state);
                let why = match self.framer.unframed() {
                    0 => why,
                    bytes => format!(
                        "{why}; {bytes} bytes arrived that are no frame: wrong baud rate, or \
                         another protocol"
                    ),
                };
                Err(DriverError { why })
            }
        }
    }

    fn to_process(&self) -> &[f64] {
        self.protocol.to_process(&self.state)
    }

    fn diagnostics(&self) -> Vec<Port> {
        Diagnostics::ports(self.name(), |diagnostics| self.report(diagnostics))
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        Diagnostics::read(values, |diagnostics| self.report(diagnostics));
    }

    fn period(&self) -> Option<SimDuration> {
        let pacing = self.protocol.pacing()?;
        let (Pacing::Requests(period) | Pacing::Frames(period)) = pacing;
        Some(period)
    }

    fn bus_health(&self, now: HostTime) -> Option<BusHealth> {
        let period = self.period();
        let name = |_| format!("{} of {}", P::DEVICE, self.name());
        Some(self.traffic.health(now, period, name))
    }

    fn save(&self) -> Snapshot {
        let Self {
            state,
            pending,
            traffic,
            framer,
            ..
        } = self;
        Snapshot::of(&(state, pending, framer.state(), traffic))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let framer: FramerState;
        (self.state, self.pending, framer, self.traffic) = snapshot.read()?;
        self.framer.set_state(framer);
        Ok(())
    }
}
