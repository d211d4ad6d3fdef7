//! Host side of the wire: the driver that runs on the robot. It has neither clock nor port: it
//! composes requests with their time-outs and handles the frames received.

use serde::{Deserialize, Serialize};
use twinrig::kernel::{Port, SimDuration, Unit};
use twinrig_wire::{FrameMatch, FrameOutcome, Protocol, RequestKind};

use crate::protocol::{REQUEST, decode, match_frame};

/// Time-out of an answer.
const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(50);

/// Configuration.
pub struct RangeFinder {
    name: String,
}

impl RangeFinder {
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
        }
    }
}

/// Changing state.
#[derive(Default, Serialize, Deserialize)]
pub struct State {
    /// Newest distance \[m\].
    distance: f64,
    answers: u64,
    lost: u64,
}

impl Protocol for RangeFinder {
    type State = State;

    const ATTEMPTS: u32 = 3;

    const DIAGNOSTICS: &'static [(&'static str, Unit)] = &[
        ("answers", Unit::One),
        ("lost", Unit::One),
        ("last", Unit::Meter),
    ];

    fn match_frame(front: &[u8]) -> FrameMatch {
        match_frame(front)
    }

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        let name = format!("{}/distance", self.name);
        vec![Port::output(name, Unit::Meter, 1)]
    }

    fn request(
        &self,
        _state: &mut State,
        kind: RequestKind,
        _from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration> {
        match kind {
            RequestKind::Open | RequestKind::Transfer => {
                request.push(REQUEST);
                Some(ANSWER_TIMEOUT)
            }
            // The device needs no safe state.
            RequestKind::Close => None,
        }
    }

    fn handle_frame(
        &self,
        state: &mut State,
        _kind: Option<RequestKind>,
        frame: &[u8],
    ) -> FrameOutcome {
        let Some(millimetres) = decode(frame) else {
            return FrameOutcome::Incomplete;
        };
        state.distance = f64::from(millimetres) * 1e-3;
        state.answers += 1;
        FrameOutcome::Complete
    }

    fn time_out(&self, state: &mut State, _kind: RequestKind) {
        state.lost += 1;
    }

    fn open_failure(&self, _state: &State) -> String {
        format!(
            "{} does not answer: check the connection and the port",
            self.name
        )
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        std::slice::from_ref(&state.distance)
    }

    fn read_diagnostics(&self, state: &State, values: &mut [f64]) {
        values.copy_from_slice(&[state.answers as f64, state.lost as f64, state.distance]);
    }
}
