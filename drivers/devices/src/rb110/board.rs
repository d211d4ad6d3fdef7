use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{AnalogInputs, Diagnostics, Emulation, FramedNode, TxQueue, quantize};

use super::assumed::REACTION;
use super::protocol::{Answer, COUNTS, LINES, Request, TICK_NS};
use super::{AdcRange, Rb110};

/// Emulated board: pulses by its own clock, with a common start on all lines. New widths take
/// effect at the next start of the pulses; the servo has its command at the pulse's end, when it is
/// written to the plant.
pub type Rb110Board = FramedNode<Rb110Emulation>;

/// Device-specific part of the emulated board.
#[derive(Debug)]
pub struct Rb110Emulation {
    config: Rb110,
    /// Places of the servos' commands in the plant.
    commands: Vec<Range<usize>>,
    inputs: AnalogInputs,
}

/// Changing state.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// Requested widths, which take effect at the next start.
    next: [Option<u32>; LINES],
    /// Widths of the repeated pulses \[ticks\]; 0: none.
    pulses: [u32; LINES],
    /// Lines whose pulse has ended since the last start.
    ended: [bool; LINES],
    /// Number of periods begun.
    begun: u64,
    /// Number of pulses ended.
    sent: u64,
}

impl State {
    fn begin_pulses(&mut self) {
        for (pulse, next) in self.pulses.iter_mut().zip(&mut self.next) {
            *pulse = next.take().unwrap_or(*pulse);
        }
        self.ended = [false; LINES];
        self.begun += 1;
    }
}

impl Rb110Emulation {
    /// Creates the emulation from a checked configuration.
    pub(super) fn new(config: Rb110) -> Self {
        Self {
            inputs: AnalogInputs::new(config.analog.clone()),
            config,
            commands: Vec::new(),
        }
    }

    /// Returns the simulation time at which the board's clock shows `after` past the start of
    /// period `number`.
    fn instant(&self, number: u64, after: SimDuration) -> SimTime {
        let Rb110 { clock, period, .. } = &self.config;
        clock.sim_at_period(*period, number, after)
    }

    fn next_start(&self, state: &State) -> SimTime {
        self.instant(state.begun, SimDuration::ZERO)
    }

    /// Returns the end of the pulse on `line`, if one is in progress.
    fn end(&self, state: &State, line: usize) -> Option<SimTime> {
        let ticks = state.pulses[line];
        let current = state.begun.checked_sub(1)?;
        let in_progress = ticks > 0 && !state.ended[line];
        let width = SimDuration::from_nanos(u64::from(ticks) * TICK_NS);
        in_progress.then(|| self.instant(current, width))
    }

    /// Ends the pulses due by now and writes their commands to the plant.
    fn end_pulses(
        &self,
        state: &mut State,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        for line in 0..LINES {
            if self.end(state, line).is_none_or(|at| at > now) {
                continue;
            }
            state.ended[line] = true;
            state.sent += 1;
            let servos = self.config.servos.iter().zip(&self.commands);
            for (servo, command) in servos.filter(|(servo, _)| servo.line == line) {
                if let Some(angle) = servo.pulse.angle(state.pulses[line]) {
                    plant.actuate(command.clone())?.fill(angle);
                }
            }
        }
        Ok(())
    }

    /// Stores the requested pulses and converts the requested inputs.
    fn answer(
        &self,
        state: &mut State,
        request: &Request,
        plant: &mut dyn PlantAccess,
    ) -> Result<Answer, TaskError> {
        let mut answer = Answer {
            sequence: request.sequence,
            ..Answer::default()
        };
        for (next, &requested) in state.next.iter_mut().zip(&request.pulses) {
            if requested.is_some() {
                answer.replaced |= next.is_some();
                *next = requested;
            }
        }
        let range = if request.twice {
            AdcRange::TwiceReference
        } else {
            AdcRange::Reference
        };
        let full_scale = range.full_scale(self.config.reference);
        for (channel, count) in answer.counts.iter_mut().enumerate() {
            if request.inputs[channel] {
                let exact = self.inputs.read(channel, plant)? / full_scale * f64::from(COUNTS);
                // The converter rounds down.
                *count = Some(quantize(exact.floor(), 0..=COUNTS - 1).0);
            }
        }
        Ok(answer)
    }
}

impl Emulation for Rb110Emulation {
    type State = State;
    type Message = Request;

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.config.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let servos = self.config.servos.iter();
        self.commands = servos
            .map(|servo| plant.find(owner, &Port::output(&servo.command, Unit::Radian, 1)))
            .collect::<Result<_, _>>()?;
        self.inputs.connect(owner, plant)
    }

    fn next_instant(&self, state: &State) -> Option<SimTime> {
        let ends = (0..LINES).filter_map(|line| self.end(state, line));
        ends.chain([self.next_start(state)]).min()
    }

    fn act(
        &self,
        state: &mut State,
        now: SimTime,
        plant: &mut dyn PlantAccess,
        _tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        self.end_pulses(state, now, plant)?;
        if self.next_start(state) <= now {
            state.begin_pulses();
        }
        Ok(())
    }

    fn handle_message(
        &self,
        state: &mut State,
        now: SimTime,
        request: Request,
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        let answer = self.answer(state, &request, plant)?;
        tx.send(now + REACTION, &answer);
        Ok(())
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("pulses", state.sent);
    }
}
