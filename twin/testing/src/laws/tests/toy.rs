//! A custom driver and its board: the board answers each request with a measured value, and
//! follows the command in it.
//!
//! A request is `A5`, address, number, command; an answer `5A`, address, number, value; each ends
//! with its CRC. Command and value are thousandths, high byte first.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Driver, DriverError, PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{Diagnostics, Emulation, FrameError, FrameMatch, FramedMessage, FramedNode};
use twinrig_wire::{TxQueue, crc16};

use super::Flaw;

/// Address of the board.
pub const ADDRESS: u8 = 7;
/// Length of all frames \[bytes\].
const LENGTH: usize = 7;
const REQUEST: u8 = 0xa5;
const ANSWER: u8 = 0x5a;
const TIME_OUT: SimDuration = SimDuration::from_millis(3);
const ATTEMPTS: u32 = 3;
/// Time from the end of a request to its answer.
const REACTION: SimDuration = SimDuration::from_micros(150);

/// Returns the frame of a header, an address, a number and a value.
pub fn frame(header: u8, address: u8, number: u8, value: i16) -> Vec<u8> {
    let [high, low] = value.to_be_bytes();
    let mut frame = vec![header, address, number, high, low];
    frame.extend(crc16(&frame).to_le_bytes());
    frame
}

/// Returns answers of another board, of all numbers.
pub fn foreign_answers() -> Vec<Vec<u8>> {
    let answer = |number| frame(ANSWER, ADDRESS + 1, number, 1234);
    (0..32).map(answer).collect()
}

/// Driver of the board.
pub struct ToyDriver {
    flaw: Option<Flaw>,
    state: State,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct State {
    received: Vec<u8>,
    request: Vec<u8>,
    phase: Phase,
    /// Time-out of the pending request.
    until: Option<HostTime>,
    attempts: u32,
    number: u8,
    command: i16,
    value: [f64; 1],
    answered: bool,
    accepted: u64,
    missing: u64,
    discarded: u64,
    /// Bytes have been found outside frames.
    out_of_step: bool,
    frames: Vec<Vec<u8>>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
enum Phase {
    #[default]
    Idle,
    Opening,
    Transfer,
    Closing,
    Failed,
}

impl ToyDriver {
    /// Creates the driver, with a planted flaw.
    pub fn new(flaw: Option<Flaw>) -> Self {
        Self {
            flaw,
            state: State::default(),
        }
    }

    fn has(&self, flaw: Flaw) -> bool {
        self.flaw == Some(flaw)
    }

    fn start(&mut self, now: HostTime, phase: Phase) {
        self.state.phase = phase;
        self.state.attempts = 0;
        self.request(now);
    }

    fn request(&mut self, now: HostTime) {
        let until = (!self.has(Flaw::NoTimeOut)).then(|| now + TIME_OUT);
        let state = &mut self.state;
        state.number = state.number.wrapping_add(1);
        state.answered = false;
        state.attempts += 1;
        state.until = until;
        state.request = frame(REQUEST, ADDRESS, state.number, state.command);
    }

    /// Returns the next frame with a valid checksum.
    fn next_frame(&mut self) -> Option<Vec<u8>> {
        let checks = !self.has(Flaw::IgnoresChecksum);
        let counts = !self.has(Flaw::DoesNotCountDamage);
        let state = &mut self.state;
        while let Some(&first) = state.received.first() {
            let candidate = state.received.get(..LENGTH);
            if first == ANSWER && candidate.is_none() {
                return None;
            }
            let is_intact = |frame: &[u8]| {
                let (content, checksum) = frame.split_at(LENGTH - 2);
                !checks || crc16(content).to_le_bytes() == *checksum
            };
            if first == ANSWER && candidate.is_some_and(is_intact) {
                return Some(state.received.drain(..LENGTH).collect());
            }
            state.received.remove(0);
            state.discarded += u64::from(counts);
            state.out_of_step = true;
        }
        None
    }

    fn handle_frame(&mut self, frame: &[u8]) {
        let is_ours = frame[1] == ADDRESS || self.has(Flaw::AcceptsOtherAddresses);
        let is_due = frame[2] == self.state.number || self.has(Flaw::AcceptsOldAnswers);
        let is_first = !self.state.answered || self.has(Flaw::AcceptsDoubledAnswers);
        if self.has(Flaw::KeepsAllFrames) {
            self.state.frames.push(frame.to_vec());
        }
        let is_dead = self.has(Flaw::NeverResynchronises) && self.state.out_of_step;
        let state = &mut self.state;
        if !(is_ours && is_due && is_first) || is_dead {
            state.discarded += 1;
            return;
        }
        state.answered = true;
        state.accepted += 1;
        state.value = [f64::from(i16::from_be_bytes([frame[3], frame[4]])) / 1000.0];
        state.until = None;
        state.phase = Phase::Idle;
    }

    fn report(&self, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("accepted", self.state.accepted);
        diagnostics.count("missing", self.state.missing);
        diagnostics.count("discarded", self.state.discarded);
    }
}

impl Driver for ToyDriver {
    fn name(&self) -> &'static str {
        "toy"
    }

    fn ports(&self) -> Vec<Port> {
        vec![
            Port::output("toy/value", Unit::Radian, 1),
            Port::input("toy/command", Unit::Radian, 1),
        ]
    }

    fn open(&mut self, now: HostTime) {
        self.start(now, Phase::Opening);
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        #[expect(clippy::cast_possible_truncation, reason = "it saturates")]
        let command = (from_process[0] * 1000.0).round() as i16;
        self.state.command = command;
        self.start(now, Phase::Transfer);
    }

    fn close(&mut self, now: HostTime) {
        self.start(now, Phase::Closing);
    }

    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        if self.has(Flaw::LosesBytesBetweenPieces) {
            self.state.received.clear();
        }
        if self.has(Flaw::BytesPostponeTimeOut) && self.state.until.is_some() && !bytes.is_empty() {
            self.state.until = Some(now + TIME_OUT);
        }
        self.state.received.extend(bytes);
        while let Some(frame) = self.next_frame() {
            self.handle_frame(&frame);
        }
    }

    fn handle_timeout(&mut self, now: HostTime) {
        if self.has(Flaw::CountsLooksAsTimeOuts) && self.state.until.is_some() {
            self.state.missing += 1;
        }
        if self.state.until.is_none_or(|until| now < until) {
            return;
        }
        if self.has(Flaw::TimeOutStaysDue) {
            return;
        }
        let state = &mut self.state;
        state.until = None;
        match self.flaw {
            Some(Flaw::CountsTimeOutsAsAnswers) => state.accepted += 1,
            Some(Flaw::DoesNotCountTimeOuts) => {}
            _ => state.missing += 1,
        }
        match state.phase {
            Phase::Opening | Phase::Closing if state.attempts < ATTEMPTS => self.request(now),
            Phase::Opening | Phase::Closing => state.phase = Phase::Failed,
            Phase::Transfer | Phase::Idle | Phase::Failed => state.phase = Phase::Idle,
        }
    }

    fn poll_timeout(&self) -> Option<HostTime> {
        self.state.until
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        let any = !self.state.request.is_empty();
        bytes.append(&mut self.state.request);
        any
    }

    fn is_busy(&self) -> Result<bool, DriverError> {
        match self.state.phase {
            Phase::Failed => Err(DriverError {
                why: String::from("the board does not answer: check its cable"),
            }),
            phase => Ok(phase != Phase::Idle),
        }
    }

    fn to_process(&self) -> &[f64] {
        &self.state.value
    }

    fn diagnostics(&self) -> Vec<Port> {
        Diagnostics::ports("toy", |diagnostics| self.report(diagnostics))
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        Diagnostics::read(values, |diagnostics| self.report(diagnostics));
    }

    fn save(&self) -> Snapshot {
        let mut state = self.state.clone();
        match self.flaw {
            Some(Flaw::DoesNotSavePartialFrame) => state.received.clear(),
            Some(Flaw::DoesNotSaveNumber) => state.number = 0,
            Some(Flaw::DoesNotSaveTimeOut) => state.until = None,
            _ => {}
        }
        Snapshot::of(&state)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.state = snapshot.read()?;
        Ok(())
    }
}

/// Emulated board.
pub type ToyBoard = FramedNode<ToyEmulation>;

/// Device-specific part of the board: the places of its signals in the plant.
#[derive(Default)]
pub struct ToyEmulation {
    value: std::ops::Range<usize>,
    command: std::ops::Range<usize>,
}

/// A request.
pub struct Request {
    bytes: [u8; LENGTH],
}

impl Request {
    fn value(&self) -> i16 {
        i16::from_be_bytes([self.bytes[3], self.bytes[4]])
    }
}

impl FramedMessage for Request {
    fn match_frame(front: &[u8]) -> FrameMatch {
        match (front.first(), front.get(..LENGTH)) {
            (Some(&first), _) if first != REQUEST => FrameMatch::Garbage,
            (_, None) => FrameMatch::Missing(LENGTH - front.len()),
            (_, Some(frame)) => {
                let (content, checksum) = frame.split_at(LENGTH - 2);
                if crc16(content).to_le_bytes() == *checksum {
                    FrameMatch::Frame(LENGTH)
                } else {
                    FrameMatch::Garbage
                }
            }
        }
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let bytes = frame.try_into().map_err(|_| FrameError::Length)?;
        Ok(Self { bytes })
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        bytes.extend(self.bytes);
    }
}

impl Emulation for ToyEmulation {
    type State = ();
    type Message = Request;

    fn initial(&self) {}

    fn name(&self) -> &'static str {
        "toy"
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.value = plant.find(owner, &Port::input("value", Unit::Radian, 1))?;
        self.command = plant.find(owner, &Port::output("command", Unit::Radian, 1))?;
        Ok(())
    }

    fn handle_message(
        &self,
        _state: &mut (),
        now: SimTime,
        request: Request,
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        let [_, address, number, ..] = request.bytes;
        if address != ADDRESS {
            return Ok(());
        }
        let command = f64::from(request.value()) / 1000.0;
        plant.actuate(self.command.clone())?.fill(command);
        let value = plant.sample(self.value.clone())?[0];
        #[expect(clippy::cast_possible_truncation, reason = "it saturates")]
        let value = (value * 1000.0).round() as i16;
        let bytes = frame(ANSWER, ADDRESS, number, value);
        let bytes = bytes.try_into().unwrap_or([0; LENGTH]);
        tx.send(now + REACTION, &Request { bytes });
        Ok(())
    }
}

/// Ports of the plant that the board measures and commands.
pub fn plant_ports() -> Vec<Port> {
    vec![
        Port::output("value", Unit::Radian, 1),
        Port::input("command", Unit::Radian, 1),
    ]
}
