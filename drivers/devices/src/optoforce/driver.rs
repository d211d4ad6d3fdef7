use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_wire::{
    Diagnostics, FrameCounts, FrameOutcome, FramedDriver, FramedMessage, Pacing, Protocol,
    RequestKind, SequenceNumber, TrafficError,
};

use super::assumed::ANSWER_TIMEOUT;
use super::protocol::{Counts, Health, Message, Status};
use super::{OptoForce, SampleChoice, Speed};

/// Driver of the sensor: configures it and keeps the newest sample.
///
/// Opening lasts until the sensor has acknowledged and sent a sample. Samples missing by the
/// sensor's own counter are counted, as are those with a fault status. The force keeps its value
/// until the next valid sample.
pub type OptoForceDriver = FramedDriver<OptoForceProtocol>;

/// Requests to the sensor and interpretation of its messages.
#[derive(Debug)]
pub struct OptoForceProtocol(pub(super) OptoForce);

/// Changing state.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// The sensor has acknowledged its configuration, so that its samples are accepted.
    acknowledged: bool,
    refused: Option<u8>,
    counter: SequenceNumber<u16>,
    force: [f64; 3],
    samples: u64,
    lost: u64,
    stale: u64,
    unwell: u64,
    overloaded: u64,
    foreign: u64,
}

impl OptoForceProtocol {
    /// Returns the period of the samples.
    fn period(&self) -> SimDuration {
        SimDuration::from_millis(u64::from(self.0.speed.code()))
    }

    /// Processes a sample. Returns whether it is new and valid.
    fn sample(&self, state: &mut State, counter: u16, status: Status, counts: [i16; 3]) -> bool {
        let Some(lost) = state.counter.advance(counter) else {
            state.stale += 1;
            return false;
        };
        state.samples += 1;
        state.lost += lost;
        state.overloaded += u64::from(status.overload().contains(&true));
        if status.electronics() != 0 || status.health() != Health::Good {
            state.unwell += 1;
            return false;
        }
        state.force = counts.map(|count| f64::from(count) / self.0.sensitivity);
        true
    }
}

impl Protocol for OptoForceProtocol {
    type State = State;
    type Message = Message;

    const DEVICE: &'static str = "sensor";

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.0.name
    }

    fn ports(&self) -> Vec<Port> {
        let name = format!("{}/force", self.0.name);
        vec![Port::output(name, Unit::Newton, 3)]
    }

    fn request(
        &self,
        state: &mut State,
        kind: RequestKind,
        _from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration> {
        let speed = match kind {
            RequestKind::Open => self.0.speed,
            RequestKind::Close => Speed::Stop,
            // The next sample is sent without a request.
            RequestKind::Transfer => {
                return (self.0.take == SampleChoice::Fresh).then(|| self.period() * 2);
            }
        };
        state.acknowledged = false;
        let configuration = Message::Configuration {
            speed,
            cutoff: self.0.cutoff,
            zero: self.0.zero,
        };
        configuration.encode(request);
        Some(ANSWER_TIMEOUT)
    }

    fn handle_message(
        &self,
        state: &mut State,
        kind: Option<RequestKind>,
        message: Message,
    ) -> FrameOutcome {
        match message {
            Message::Data {
                counter,
                status,
                counts: Counts::Three(counts),
            } => {
                let valid = self.sample(state, counter, status, counts);
                FrameOutcome::complete_if(match kind {
                    Some(RequestKind::Open) => valid && state.acknowledged,
                    Some(RequestKind::Transfer) => valid,
                    Some(RequestKind::Close) | None => false,
                })
            }
            Message::Acknowledgement { status: 0 } => match kind {
                Some(RequestKind::Open) if !state.acknowledged => {
                    state.acknowledged = true;
                    FrameOutcome::More(ANSWER_TIMEOUT)
                }
                Some(RequestKind::Close) => FrameOutcome::Complete,
                _ => {
                    state.refused = None;
                    FrameOutcome::Incomplete
                }
            },
            Message::Acknowledgement { status } => {
                state.refused = Some(status);
                FrameOutcome::Incomplete
            }
            Message::Data { .. } | Message::Configuration { .. } => {
                state.foreign += 1;
                FrameOutcome::Incomplete
            }
        }
    }

    fn time_out(&self, state: &mut State, kind: RequestKind) {
        state.stale += u64::from(kind == RequestKind::Transfer);
    }

    fn open_failure(&self, state: &State) -> String {
        let name = &self.0.name;
        match state.refused {
            Some(status) => {
                format!("the sensor of {name} rejects its configuration with status {status}")
            }
            None => format!(
                "the sensor of {name} did not acknowledge and send within {ANSWER_TIMEOUT}, in {} attempts: check the connection and the port",
                Self::ATTEMPTS
            ),
        }
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.force
    }

    fn pacing(&self) -> Option<Pacing> {
        (self.0.speed != Speed::Stop).then(|| Pacing::Frames(self.period()))
    }

    fn counts(&self, state: &State) -> FrameCounts {
        let errors = [
            (TrafficError::Lost, state.lost),
            (TrafficError::NotNew, state.stale),
            (TrafficError::Fault, state.unwell),
            (TrafficError::Unexpected, state.foreign),
        ];
        FrameCounts::new(state.samples, &errors)
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("samples", state.samples);
        diagnostics.count("lost", state.lost);
        diagnostics.count("stale", state.stale);
        diagnostics.count("unwell", state.unwell);
        diagnostics.count("overloaded", state.overloaded);
        diagnostics.count("foreign", state.foreign);
    }
}
