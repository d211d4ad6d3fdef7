use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_wire::{
    Diagnostics, FrameCounts, FrameOutcome, FramedDriver, FramedMessage, Pacing, Protocol,
    RequestKind, TrafficError,
};

use super::assumed::ANSWER_TIMEOUT;
use super::protocol::{ANALOG, Answer, COUNTS, LINES, Request};
use super::{AdcRange, Rb110};

/// Driver of the board: transmits one pulse per servo and transfer, and reads the analog inputs.
///
/// A transfer takes one period of the pulses, with or without an answer; a missing answer is
/// counted, and the analog readings keep their values. Only a board that does not answer at opening
/// is an error.
pub type Rb110Driver = FramedDriver<Rb110Protocol>;

/// Requests to the board and interpretation of its answers.
#[derive(Debug)]
pub struct Rb110Protocol(pub(super) Rb110);

/// Changing state.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    sequence: u8,
    answered: bool,
    volts: Vec<f64>,
    transfers: u64,
    answers: u64,
    lost: u64,
    saturated: u64,
    replaced: u64,
}

/// Widths of pulses \[ticks\]; `None` for a line whose pulse does not change.
type Pulses = [Option<u32>; LINES];

impl Rb110Protocol {
    fn pulses(&self, state: &mut State, angles: &[f64]) -> Pulses {
        let mut pulses = [None; LINES];
        for (servo, &angle) in self.0.servos.iter().zip(angles) {
            // NaN commands nothing: the pulse does not change.
            let ticks = servo.pulse.ticks(angle);
            pulses[servo.line] = ticks.map(|(ticks, _)| ticks);
            state.saturated += u64::from(ticks.is_none_or(|(_, saturated)| saturated));
        }
        pulses
    }

    /// Returns the pulses that switch the servos off.
    fn off(&self) -> Pulses {
        let mut pulses = [None; LINES];
        for servo in &self.0.servos {
            pulses[servo.line] = Some(servo.pulse.off);
        }
        pulses
    }
}

impl Protocol for Rb110Protocol {
    type State = State;
    type Message = Answer;

    const DEVICE: &'static str = "servo board";

    fn initial(&self) -> State {
        State {
            sequence: 0,
            answered: false,
            volts: vec![0.0; self.0.analog.len()],
            transfers: 0,
            answers: 0,
            lost: 0,
            saturated: 0,
            replaced: 0,
        }
    }

    fn name(&self) -> &str {
        &self.0.name
    }

    fn ports(&self) -> Vec<Port> {
        let servos = self.0.servos.iter();
        let mut ports: Vec<Port> = servos
            .map(|servo| Port::input(&servo.command, Unit::Radian, 1))
            .collect();
        if !self.0.analog.is_empty() {
            let name = format!("{}/adc", self.0.name);
            ports.push(Port::output(name, Unit::Volt, self.0.analog.len()));
        }
        ports
    }

    fn request(
        &self,
        state: &mut State,
        kind: RequestKind,
        from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration> {
        let (pulses, timeout) = match kind {
            RequestKind::Open => ([None; LINES], ANSWER_TIMEOUT),
            RequestKind::Transfer => (self.pulses(state, from_process), self.0.period),
            RequestKind::Close => (self.off(), ANSWER_TIMEOUT),
        };
        let mut inputs = [false; ANALOG];
        for input in &self.0.analog {
            inputs[input.channel] = true;
        }
        state.sequence = state.sequence.wrapping_add(1);
        state.answered = false;
        let message = Request {
            sequence: state.sequence,
            twice: self.0.range == AdcRange::TwiceReference,
            pulses,
            inputs,
        };
        message.encode(request);
        Some(timeout)
    }

    fn handle_message(
        &self,
        state: &mut State,
        kind: Option<RequestKind>,
        answer: Answer,
    ) -> FrameOutcome {
        if answer.sequence != state.sequence || state.answered {
            return FrameOutcome::Incomplete;
        }
        state.answered = true;
        state.answers += 1;
        state.replaced += u64::from(answer.replaced);
        let full_scale = self.0.range.full_scale(self.0.reference);
        for (volts, input) in state.volts.iter_mut().zip(&self.0.analog) {
            if let Some(count) = answer.counts[input.channel] {
                *volts = f64::from(count) * full_scale / f64::from(COUNTS);
            }
        }
        FrameOutcome::complete_if(kind != Some(RequestKind::Transfer))
    }

    fn time_out(&self, state: &mut State, kind: RequestKind) {
        state.lost += u64::from(!state.answered);
        state.transfers += u64::from(kind == RequestKind::Transfer);
    }

    fn open_failure(&self, _state: &State) -> String {
        format!(
            "the servo board of {} answered none of {} requests within {ANSWER_TIMEOUT} each: check the connection and the port",
            self.0.name,
            Self::ATTEMPTS
        )
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.volts
    }

    fn pacing(&self) -> Option<Pacing> {
        Some(Pacing::Requests(self.0.period))
    }

    fn counts(&self, state: &State) -> FrameCounts {
        FrameCounts::new(state.answers, &[(TrafficError::NoAnswer, state.lost)])
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("transfers", state.transfers);
        diagnostics.count("lost", state.lost);
        diagnostics.count("saturated", state.saturated);
        diagnostics.count("replaced", state.replaced);
    }
}
