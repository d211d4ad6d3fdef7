//! Host side of the wire: the driver that runs on the robot. It has neither clock nor port: it
//! composes requests with their time-outs and handles the messages received.

use serde::{Deserialize, Serialize};
use twinrig::bus::{
    Diagnostics, FrameOutcome, FramedMessage, Port, Protocol, RequestKind, SimDuration, Unit,
};

use crate::protocol::{Answer, Request};

/// Time-out of an answer.
pub const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(50);

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
    type Message = Answer;

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
                Request.encode(request);
                Some(ANSWER_TIMEOUT)
            }
            // The device needs no safe state.
            RequestKind::Close => None,
        }
    }

    fn handle_message(
        &self,
        state: &mut State,
        _kind: Option<RequestKind>,
        Answer(millimetres): Answer,
    ) -> FrameOutcome {
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

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("answers", state.answers);
        diagnostics.count("lost", state.lost);
        diagnostics.value("last", Unit::Meter, state.distance);
    }
}
