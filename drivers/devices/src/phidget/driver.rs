use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_wire::{
    Diagnostics, FrameCounts, FrameOutcome, FramedDriver, FramedMessage, Pacing, Protocol,
    RequestKind, SequenceNumber, TrafficError,
};

use super::assumed::ANSWER_TIMEOUT;
use super::protocol::{COUNTS, Message, SCALE};
use super::{Board, Phidget};

/// Driver of the board: sets it up and keeps its newest readings.
///
/// Opening lasts until the board has accepted its set-up and sent a report. Reports missing by the
/// board's own sequence number are counted.
pub type PhidgetDriver = FramedDriver<PhidgetProtocol>;

/// Requests to the board and interpretation of its messages.
#[derive(Debug)]
pub struct PhidgetProtocol(pub(super) Phidget);

/// Changing state.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// The board has accepted its set-up, so that its reports are accepted.
    accepted: bool,
    refused: bool,
    sequence: SequenceNumber<u8>,
    readings: Vec<f64>,
    reports: u64,
    lost: u64,
    stale: u64,
    overloaded: u64,
    foreign: u64,
}

impl State {
    /// Processes a report. Returns whether it is new, and the set-up has been accepted.
    fn report<const N: usize>(
        &mut self,
        sequence: u8,
        overloaded: bool,
        readings: [f64; N],
    ) -> bool {
        let Some(lost) = self.sequence.advance(sequence) else {
            self.stale += 1;
            return false;
        };
        self.reports += 1;
        self.lost += lost;
        self.overloaded += u64::from(overloaded);
        self.readings.clear();
        self.readings.extend(readings);
        self.accepted
    }
}

impl Protocol for PhidgetProtocol {
    type State = State;
    type Message = Message;

    const DEVICE: &'static str = "board";

    fn initial(&self) -> State {
        State {
            readings: vec![0.0; self.0.board.channels()],
            ..State::default()
        }
    }

    fn name(&self) -> &str {
        &self.0.name
    }

    fn ports(&self) -> Vec<Port> {
        let board = self.0.board;
        let (port, unit) = match board {
            Board::Bridge { .. } => ("bridge", Unit::One),
            Board::InterfaceKit { .. } => ("analog", Unit::Volt),
        };
        let name = format!("{}/{port}", self.0.name);
        vec![Port::output(name, unit, board.channels())]
    }

    fn request(
        &self,
        state: &mut State,
        kind: RequestKind,
        _from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration> {
        match kind {
            RequestKind::Open => {
                state.accepted = false;
                Message::Setup(self.0.board.setup()).encode(request);
                Some(ANSWER_TIMEOUT)
            }
            // The newest readings are available, and the board needs no safe state: it continues to
            // report.
            RequestKind::Transfer | RequestKind::Close => None,
        }
    }

    fn handle_message(
        &self,
        state: &mut State,
        _kind: Option<RequestKind>,
        message: Message,
    ) -> FrameOutcome {
        let complete = match (message, self.0.board) {
            (Message::Accepted { done: true }, board) if !state.accepted => {
                state.accepted = true;
                return FrameOutcome::More(ANSWER_TIMEOUT + board.interval());
            }
            (Message::Accepted { done }, _) => {
                state.refused = !done;
                false
            }
            (
                Message::Bridge {
                    sequence,
                    overload,
                    counts,
                },
                Board::Bridge { gain, .. },
            ) => {
                let one = f64::from(COUNTS) * f64::from(gain.times());
                let ratios = counts.map(|count| f64::from(count) / one);
                state.report(sequence, overload.contains(&true), ratios)
            }
            (Message::InterfaceKit { sequence, readings }, Board::InterfaceKit { .. }) => {
                let volt = f64::from(SCALE) / 5.0;
                let volts = readings.map(|reading| f64::from(reading) / volt);
                state.report(sequence, false, volts)
            }
            _ => {
                state.foreign += 1;
                false
            }
        };
        FrameOutcome::complete_if(complete)
    }

    fn open_failure(&self, state: &State) -> String {
        let name = &self.0.name;
        if state.refused {
            format!("the board of {name} rejects its set-up: it is a board of another type")
        } else {
            format!(
                "the board of {name} did not accept its set-up and report within {ANSWER_TIMEOUT}, in {} attempts: check the connection and the port",
                Self::ATTEMPTS
            )
        }
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.readings
    }

    fn pacing(&self) -> Option<Pacing> {
        match self.0.board {
            board @ Board::Bridge { .. } => Some(Pacing::Frames(board.interval())),
            // It reports changes only.
            Board::InterfaceKit { .. } => None,
        }
    }

    fn counts(&self, state: &State) -> FrameCounts {
        let errors = [
            (TrafficError::Lost, state.lost),
            (TrafficError::NotNew, state.stale),
            (TrafficError::Unexpected, state.foreign),
        ];
        FrameCounts::new(state.reports, &errors)
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("reports", state.reports);
        diagnostics.count("lost", state.lost);
        diagnostics.count("stale", state.stale);
        diagnostics.count("overloaded", state.overloaded);
        diagnostics.count("foreign", state.foreign);
    }
}
