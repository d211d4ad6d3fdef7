use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_wire::{FrameMatch, FrameOutcome, FramedDriver, Protocol, RequestKind};

use crate::assumed::{ANSWER_TIMEOUT, ATTEMPTS};
use crate::protocol::{ANALOG, Answer, COUNTS, Frame, LINES, Request, match_frame};
use crate::{AdcRange, Rb110};

/// Driver of the board: transmits one pulse per servo and transfer, and reads the analog inputs.
///
/// A transfer takes one period of the pulses, with or without an answer; a missing answer is
/// counted, and the analog readings keep their values. Only a board that does not answer at opening
/// is an error.
pub type Rb110Driver = FramedDriver<Rb110Protocol>;

/// Requests to the board and interpretation of its answers.
#[derive(Debug)]
pub struct Rb110Protocol(Rb110);

/// Changing state.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    sequence: u8,
    answered: bool,
    volts: Vec<f64>,
    counters: Counters,
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Counters {
    transfers: u64,
    lost: u64,
    saturated: u64,
    replaced: u64,
}

/// Widths of pulses \[ticks\]; `None` for a line whose pulse does not change.
type Pulses = [Option<u32>; LINES];

impl Rb110Protocol {
    /// Creates the protocol from a checked configuration.
    pub(crate) fn new(config: Rb110) -> Self {
        Self(config)
    }

    fn pulses(&self, counters: &mut Counters, angles: &[f64]) -> Pulses {
        let mut pulses = [None; LINES];
        for (servo, &angle) in self.0.servos.iter().zip(angles) {
            // NaN commands nothing: the pulse does not change.
            if let Some((ticks, saturated)) = servo.pulse.ticks(angle) {
                pulses[servo.line] = Some(ticks);
                counters.saturated += u64::from(saturated);
            } else {
                counters.saturated += 1;
            }
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

    const ATTEMPTS: u32 = ATTEMPTS;

    const DIAGNOSTICS: &'static [(&'static str, Unit)] = &[
        ("transfers", Unit::One),
        ("lost", Unit::One),
        ("saturated", Unit::One),
        ("replaced", Unit::One),
    ];

    fn match_frame(front: &[u8]) -> FrameMatch {
        match_frame(front)
    }

    fn initial(&self) -> State {
        State {
            sequence: 0,
            answered: false,
            volts: vec![0.0; self.0.analog.len()],
            counters: Counters::default(),
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
            RequestKind::Transfer => {
                let pulses = self.pulses(&mut state.counters, from_process);
                (pulses, self.0.period)
            }
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

    fn handle_frame(
        &self,
        state: &mut State,
        kind: Option<RequestKind>,
        frame: &[u8],
    ) -> FrameOutcome {
        let Ok(answer) = Frame::new(frame).and_then(Answer::try_from) else {
            return FrameOutcome::Incomplete;
        };
        if answer.sequence != state.sequence || state.answered {
            return FrameOutcome::Incomplete;
        }
        state.answered = true;
        state.counters.replaced += u64::from(answer.replaced);
        let full_scale = self.0.range.full_scale(self.0.reference);
        for (volts, input) in state.volts.iter_mut().zip(&self.0.analog) {
            if let Some(count) = answer.counts[input.channel] {
                *volts = f64::from(count) * full_scale / f64::from(COUNTS);
            }
        }
        if kind == Some(RequestKind::Transfer) {
            FrameOutcome::Incomplete
        } else {
            FrameOutcome::Complete
        }
    }

    fn time_out(&self, state: &mut State, kind: RequestKind) {
        state.counters.lost += u64::from(!state.answered);
        state.counters.transfers += u64::from(kind == RequestKind::Transfer);
    }

    fn open_failure(&self, _state: &State) -> String {
        format!(
            "the servo board of {} answered none of {ATTEMPTS} requests within {ANSWER_TIMEOUT} each: check the connection and the port",
            self.0.name
        )
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.volts
    }

    fn read_diagnostics(&self, state: &State, values: &mut [f64]) {
        let Counters {
            transfers,
            lost,
            saturated,
            replaced,
        } = state.counters;
        let counts = [transfers, lost, saturated, replaced];
        values.copy_from_slice(&counts.map(|count| count as f64));
    }
}
