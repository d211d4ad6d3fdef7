use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Driver, DriverError, Transfer};
use twinrig_wire::{Framer, FramerState};

use crate::assumed::{ATTEMPTS, PATIENCE};
use crate::protocol::{ANALOG, Answer, COUNTS, Frame, LINES, Request, measure};
use crate::{AdcRange, Rb110};

/// Gives the board a pulse for each servo, once a transfer, and brings what its analog inputs read.
///
/// A transfer takes one period of the pulses, whether the board answers in that time or not; an answer that does not come
/// is counted, and the analog readings stay as they were. Only a board that does not answer at the beginning is an error.
#[derive(Debug)]
pub struct Rb110Driver {
    config: Rb110,
    framer: Framer,
    state: State,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct State {
    phase: Phase,
    sequence: u8,
    answered: bool,
    /// When the transfer is over, or waiting is.
    until: Option<HostTime>,
    request: Option<Vec<u8>>,
    volts: Vec<f64>,
    failed: bool,
    counters: Counters,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
enum Phase {
    #[default]
    Idle,
    /// It has asked so often.
    Opening(u32),
    Transfer,
    /// It has asked so often.
    Closing(u32),
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Counters {
    transfers: u64,
    lost: u64,
    saturated: u64,
    replaced: u64,
}

fn later(now: HostTime, by: SimDuration) -> HostTime {
    HostTime::from_nanos(now.as_nanos().saturating_add(by.as_nanos()))
}

impl Rb110Driver {
    /// From what was checked.
    pub(crate) fn new(config: Rb110) -> Self {
        let state = State {
            volts: vec![0.0; config.analog.len()],
            ..State::default()
        };
        Self {
            config,
            framer: Framer::new(measure),
            state,
        }
    }

    fn ask(&mut self, now: HostTime, pulses: [Option<u32>; LINES], patience: SimDuration) {
        self.state.sequence = self.state.sequence.wrapping_add(1);
        let mut inputs = [false; ANALOG];
        for input in &self.config.analog {
            inputs[input.channel] = true;
        }
        let request = Request {
            sequence: self.state.sequence,
            twice: self.config.range == AdcRange::TwiceReference,
            pulses,
            inputs,
        };
        request.encode(self.state.request.insert(Vec::new()));
        self.state.answered = false;
        self.state.until = Some(later(now, patience));
    }

    /// The pulses that leave the servos alone.
    fn off(&self) -> [Option<u32>; LINES] {
        let mut pulses = [None; LINES];
        for servo in &self.config.servos {
            pulses[servo.line] = Some(servo.pulse.off);
        }
        pulses
    }

    fn handle(&mut self, answer: &Answer) {
        if answer.sequence != self.state.sequence || self.state.answered {
            return;
        }
        self.state.answered = true;
        self.state.counters.replaced += u64::from(answer.replaced);
        let full_scale = self.config.range.full_scale(self.config.reference);
        for (volts, input) in self.state.volts.iter_mut().zip(&self.config.analog) {
            if let Some(count) = answer.counts[input.channel] {
                *volts = f64::from(count) * full_scale / f64::from(COUNTS);
            }
        }
        if self.state.phase != Phase::Transfer {
            self.rest();
        }
    }

    fn rest(&mut self) {
        self.state.phase = Phase::Idle;
        self.state.until = None;
    }
}

impl Driver for Rb110Driver {
    fn name(&self) -> &str {
        &self.config.name
    }

    fn ports(&self) -> Vec<Port> {
        let servos = self.config.servos.iter();
        let mut ports: Vec<Port> = servos
            .map(|servo| Port::input(&servo.command, Unit::Radian, 1))
            .collect();
        if !self.config.analog.is_empty() {
            let name = format!("{}/adc", self.config.name);
            ports.push(Port::output(name, Unit::Volt, self.config.analog.len()));
        }
        ports
    }

    fn open(&mut self, now: HostTime) {
        self.state.phase = Phase::Opening(1);
        self.ask(now, [None; LINES], PATIENCE);
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        let mut pulses = [None; LINES];
        for (servo, &angle) in self.config.servos.iter().zip(from_process) {
            // What is no number commands nothing: the pulse stays as it is.
            if let Some((ticks, saturated)) = servo.pulse.ticks(angle) {
                pulses[servo.line] = Some(ticks);
                self.state.counters.saturated += u64::from(saturated);
            } else {
                self.state.counters.saturated += 1;
            }
        }
        self.state.phase = Phase::Transfer;
        self.ask(now, pulses, self.config.period);
    }

    fn close(&mut self, now: HostTime) {
        self.state.phase = Phase::Closing(1);
        self.ask(now, self.off(), PATIENCE);
    }

    fn handle_bytes(&mut self, _now: HostTime, bytes: &[u8]) {
        self.framer.push(bytes);
        while let Some(frame) = self.framer.next_frame() {
            let answer = Frame::new(frame).and_then(Answer::try_from);
            if let Ok(answer) = answer {
                self.handle(&answer);
            }
        }
    }

    fn handle_timeout(&mut self, now: HostTime) {
        if self.state.until.is_none_or(|until| now < until) {
            return;
        }
        self.state.counters.lost += u64::from(!self.state.answered);
        match self.state.phase {
            Phase::Opening(asked) if asked < ATTEMPTS => {
                self.state.phase = Phase::Opening(asked + 1);
                self.ask(now, [None; LINES], PATIENCE);
            }
            Phase::Closing(asked) if asked < ATTEMPTS => {
                self.state.phase = Phase::Closing(asked + 1);
                self.ask(now, self.off(), PATIENCE);
            }
            Phase::Opening(_) => {
                self.state.failed = true;
                self.rest();
            }
            Phase::Transfer => {
                self.state.counters.transfers += 1;
                self.rest();
            }
            Phase::Closing(_) | Phase::Idle => self.rest(),
        }
    }

    fn poll_timeout(&self) -> Option<HostTime> {
        self.state.until
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        let request = self.state.request.take();
        bytes.extend(request.iter().flatten());
        request.is_some()
    }

    fn poll_transfer(&mut self) -> Result<Transfer, DriverError> {
        if self.state.failed {
            let why = format!(
                "the servo board of {} answered none of {ATTEMPTS} requests within {PATIENCE} each: is it there, at the right port?",
                self.config.name
            );
            return Err(DriverError { why });
        }
        Ok(match self.state.phase {
            Phase::Idle => Transfer::Done,
            _ => Transfer::Busy,
        })
    }

    fn to_process(&self) -> &[f64] {
        &self.state.volts
    }

    fn gauges(&self) -> Vec<Port> {
        ["transfers", "lost", "saturated", "replaced", "garbage"]
            .map(|gauge| Port::output(format!("{}/{gauge}", self.config.name), Unit::One, 1))
            .into()
    }

    fn read_gauges(&self, values: &mut [f64]) {
        let Counters {
            transfers,
            lost,
            saturated,
            replaced,
        } = self.state.counters;
        let counts = [transfers, lost, saturated, replaced, self.framer.skipped()];
        values.copy_from_slice(&counts.map(|count| count as f64));
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.state, self.framer.state()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (state, framer): (State, FramerState) = snapshot.read()?;
        self.state = state;
        self.framer.set_state(framer);
        Ok(())
    }
}
