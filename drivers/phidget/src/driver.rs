use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_wire::{FrameMatch, FrameOutcome, FramedDriver, Protocol, RequestKind};

use crate::assumed::{ANSWER_TIMEOUT, ATTEMPTS};
use crate::protocol::{COUNTS, Frame, Message, SCALE, match_frame};
use crate::{Board, Phidget};

/// Driver of the board: sets it up and keeps its newest readings.
///
/// Opening lasts until the board has accepted its set-up and sent a report. Reports missing by the
/// board's own sequence number are counted.
pub type PhidgetDriver = FramedDriver<PhidgetProtocol>;

/// Requests to the board and interpretation of its frames.
#[derive(Debug)]
pub struct PhidgetProtocol(Phidget);

/// Changing state.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    /// The board has accepted its set-up, so that its reports are accepted.
    accepted: bool,
    refused: bool,
    sequence: Option<u8>,
    readings: Vec<f64>,
    counters: Counters,
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Counters {
    reports: u64,
    lost: u64,
    stale: u64,
    overloaded: u64,
    foreign: u64,
}

impl PhidgetProtocol {
    /// Creates the protocol from a checked configuration.
    pub(crate) fn new(config: Phidget) -> Self {
        Self(config)
    }
}

impl State {
    /// Processes a report. Returns whether it is new.
    fn report<const N: usize>(
        &mut self,
        sequence: u8,
        overloaded: bool,
        readings: [f64; N],
    ) -> bool {
        let last = self.sequence;
        let ahead = last.map_or(1, |last| sequence.wrapping_sub(last));
        if ahead == 0 || ahead > u8::MAX / 2 {
            // A repeated or late report.
            self.counters.stale += 1;
            return false;
        }
        self.counters.reports += 1;
        self.counters.lost += u64::from(ahead - 1);
        self.counters.overloaded += u64::from(overloaded);
        self.sequence = Some(sequence);
        self.readings.clear();
        self.readings.extend(readings);
        true
    }
}

impl Protocol for PhidgetProtocol {
    type State = State;

    const ATTEMPTS: u32 = ATTEMPTS;

    const DIAGNOSTICS: &'static [(&'static str, Unit)] = &[
        ("reports", Unit::One),
        ("lost", Unit::One),
        ("stale", Unit::One),
        ("overloaded", Unit::One),
        ("foreign", Unit::One),
    ];

    fn match_frame(front: &[u8]) -> FrameMatch {
        match_frame(front)
    }

    fn initial(&self) -> State {
        State {
            accepted: false,
            refused: false,
            sequence: None,
            readings: vec![0.0; self.0.board.channels()],
            counters: Counters::default(),
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

    fn handle_frame(
        &self,
        state: &mut State,
        _kind: Option<RequestKind>,
        frame: &[u8],
    ) -> FrameOutcome {
        let Ok(message) = Frame::new(frame).and_then(Message::try_from) else {
            return FrameOutcome::Incomplete;
        };
        let new = match (message, self.0.board) {
            (Message::Accepted { done: true }, _) if !state.accepted => {
                state.accepted = true;
                return FrameOutcome::More(ANSWER_TIMEOUT + self.0.board.interval());
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
                let over = overload.contains(&true);
                state.report(sequence, over, counts.map(|count| f64::from(count) / one))
            }
            (Message::InterfaceKit { sequence, readings }, Board::InterfaceKit { .. }) => {
                let volt = f64::from(SCALE) / 5.0;
                let volts = readings.map(|reading| f64::from(reading) / volt);
                state.report(sequence, false, volts)
            }
            _ => {
                state.counters.foreign += 1;
                false
            }
        };
        if new && state.accepted {
            FrameOutcome::Complete
        } else {
            FrameOutcome::Incomplete
        }
    }

    fn open_failure(&self, state: &State) -> String {
        let name = &self.0.name;
        if state.refused {
            format!("the board of {name} rejects its set-up: it is a board of another type")
        } else {
            format!(
                "the board of {name} did not accept its set-up and report within {ANSWER_TIMEOUT}, in {ATTEMPTS} attempts: check the connection and the port"
            )
        }
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.readings
    }

    fn read_diagnostics(&self, state: &State, values: &mut [f64]) {
        let Counters {
            reports,
            lost,
            stale,
            overloaded,
            foreign,
        } = state.counters;
        let counts = [reports, lost, stale, overloaded, foreign];
        values.copy_from_slice(&counts.map(|count| count as f64));
    }
}
