use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_wire::{FrameMatch, FrameOutcome, FramedDriver, Protocol, RequestKind};

use crate::assumed::{ANSWER_TIMEOUT, ATTEMPTS};
use crate::protocol::{Counts, Frame, Health, Message, Status, match_frame};
use crate::{OptoForce, SampleChoice, Speed};

/// Driver of the sensor: configures it and keeps the newest sample.
///
/// Opening lasts until the sensor has acknowledged and sent a sample. Samples missing by the
/// sensor's own counter are counted, as are those with a fault status. The force keeps its value
/// until the next valid sample.
pub type OptoForceDriver = FramedDriver<OptoForceProtocol>;

/// Requests to the sensor and interpretation of its frames.
#[derive(Debug)]
pub struct OptoForceProtocol(OptoForce);

/// Changing state.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// The sensor has acknowledged its configuration, so that its samples are accepted.
    acknowledged: bool,
    refused: Option<u8>,
    counter: Option<u16>,
    force: [f64; 3],
    counters: Counters,
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Counters {
    samples: u64,
    lost: u64,
    stale: u64,
    unwell: u64,
    overloaded: u64,
    foreign: u64,
}

impl OptoForceProtocol {
    /// Creates the protocol from a checked configuration.
    pub(crate) fn new(config: OptoForce) -> Self {
        Self(config)
    }

    /// Processes a sample. Returns whether it is new and valid.
    fn sample(&self, state: &mut State, counter: u16, status: Status, counts: [i16; 3]) -> bool {
        let counters = &mut state.counters;
        let ahead = state.counter.map_or(1, |last| counter.wrapping_sub(last));
        if ahead == 0 || ahead > u16::MAX / 2 {
            // A repeated or late sample.
            counters.stale += 1;
            return false;
        }
        counters.samples += 1;
        counters.lost += u64::from(ahead - 1);
        counters.overloaded += u64::from(status.overload().contains(&true));
        state.counter = Some(counter);
        if status.electronics() != 0 || status.health() != Health::Good {
            counters.unwell += 1;
            return false;
        }
        state.force = counts.map(|count| f64::from(count) / self.0.sensitivity);
        true
    }
}

impl Protocol for OptoForceProtocol {
    type State = State;

    const ATTEMPTS: u32 = ATTEMPTS;

    const DIAGNOSTICS: &'static [(&'static str, Unit)] = &[
        ("samples", Unit::One),
        ("lost", Unit::One),
        ("stale", Unit::One),
        ("unwell", Unit::One),
        ("overloaded", Unit::One),
        ("foreign", Unit::One),
    ];

    fn match_frame(front: &[u8]) -> FrameMatch {
        match_frame(front)
    }

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
                let period = SimDuration::from_millis(u64::from(self.0.speed.code()));
                return (self.0.take == SampleChoice::Fresh).then(|| period * 2);
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

    fn handle_frame(
        &self,
        state: &mut State,
        kind: Option<RequestKind>,
        frame: &[u8],
    ) -> FrameOutcome {
        match (Frame::new(frame).and_then(Message::try_from), kind) {
            (
                Ok(Message::Data {
                    counter,
                    status,
                    counts: Counts::Three(counts),
                }),
                _,
            ) => {
                let valid = self.sample(state, counter, status, counts);
                match kind {
                    Some(RequestKind::Open) if valid && state.acknowledged => {
                        FrameOutcome::Complete
                    }
                    Some(RequestKind::Transfer) if valid => FrameOutcome::Complete,
                    _ => FrameOutcome::Incomplete,
                }
            }
            (Ok(Message::Acknowledgement { status: 0 }), Some(RequestKind::Open))
                if !state.acknowledged =>
            {
                state.acknowledged = true;
                FrameOutcome::More(ANSWER_TIMEOUT)
            }
            (Ok(Message::Acknowledgement { status: 0 }), Some(RequestKind::Close)) => {
                FrameOutcome::Complete
            }
            (Ok(Message::Acknowledgement { status }), _) => {
                state.refused = Some(status).filter(|status| *status != 0);
                FrameOutcome::Incomplete
            }
            (Ok(Message::Data { .. } | Message::Configuration { .. }), _) => {
                state.counters.foreign += 1;
                FrameOutcome::Incomplete
            }
            (Err(_), _) => FrameOutcome::Incomplete,
        }
    }

    fn time_out(&self, state: &mut State, kind: RequestKind) {
        state.counters.stale += u64::from(kind == RequestKind::Transfer);
    }

    fn open_failure(&self, state: &State) -> String {
        let name = &self.0.name;
        match state.refused {
            Some(status) => {
                format!("the sensor of {name} rejects its configuration with status {status}")
            }
            None => format!(
                "the sensor of {name} did not acknowledge and send within {ANSWER_TIMEOUT}, in {ATTEMPTS} attempts: check the connection and the port"
            ),
        }
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.force
    }

    fn read_diagnostics(&self, state: &State, values: &mut [f64]) {
        let Counters {
            samples,
            lost,
            stale,
            unwell,
            overloaded,
            foreign,
        } = state.counters;
        let counts = [samples, lost, stale, unwell, overloaded, foreign];
        values.copy_from_slice(&counts.map(|count| count as f64));
    }
}
