use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalTime, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};
use twinrig_wire::{Framer, FramerState, Node, Piece};

use crate::assumed::REACTION;
use crate::protocol::{Answer, COUNTS, Frame, LINES, Request, TICK_NS, measure};
use crate::{AdcRange, Rb110};

/// The emulated board: pulses on its own clock, all lines beginning theirs together. New widths are taken at the next
/// pulse's start; the servo has its command at the pulse's end, and the plant is told then.
#[derive(Debug)]
pub struct Rb110Board {
    config: Rb110,
    framer: Framer,
    /// Where the plant takes the commands of the servos.
    commands: Vec<Range<usize>>,
    /// Where the plant has what the analog inputs read.
    inputs: Vec<Option<usize>>,
    state: State,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct State {
    /// Asked for, and taken at the next start.
    next: [Option<u32>; LINES],
    /// Widths of the pulses that go on and on \[ticks\]; 0: none.
    pulses: [u32; LINES],
    /// Lines whose pulse has ended since the last start.
    ended: [bool; LINES],
    /// How many periods have begun.
    begun: u64,
    answer: Option<(SimTime, Vec<u8>)>,
    sent: u64,
}

impl Rb110Board {
    /// From what was checked.
    pub(crate) fn new(config: Rb110) -> Self {
        Self {
            config,
            framer: Framer::new(measure),
            commands: Vec::new(),
            inputs: Vec::new(),
            state: State::default(),
        }
    }

    /// When the clock shows `after` past the start of period `number`.
    fn instant(&self, number: u64, after: SimDuration) -> SimTime {
        let shown = SimTime::ZERO + self.config.period * number + after;
        let shown = i64::try_from(shown.as_nanos()).unwrap_or(i64::MAX);
        self.config.clock.sim_at(LocalTime::from_nanos(shown))
    }

    fn next_start(&self) -> SimTime {
        self.instant(self.state.begun, SimDuration::ZERO)
    }

    /// When the pulse on `line` ends, if one goes on.
    fn end(&self, line: usize) -> Option<SimTime> {
        let ticks = self.state.pulses[line];
        let current = self.state.begun.checked_sub(1)?;
        let goes_on = ticks > 0 && !self.state.ended[line];
        let width = SimDuration::from_nanos(u64::from(ticks) * TICK_NS);
        goes_on.then(|| self.instant(current, width))
    }

    /// Ends the pulses that end by now: the servos hear them.
    fn end_pulses(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        for line in 0..LINES {
            if self.end(line).is_none_or(|at| at > now) {
                continue;
            }
            self.state.ended[line] = true;
            self.state.sent += 1;
            let servos = self.config.servos.iter().zip(&self.commands);
            for (servo, command) in servos.filter(|(servo, _)| servo.line == line) {
                if let Some(angle) = servo.pulse.angle(self.state.pulses[line]) {
                    world.actuate(command.clone())?.fill(angle);
                }
            }
        }
        Ok(())
    }

    fn begin_pulses(&mut self) {
        for (pulse, next) in self.state.pulses.iter_mut().zip(&mut self.state.next) {
            *pulse = next.take().unwrap_or(*pulse);
        }
        self.state.ended = [false; LINES];
        self.state.begun += 1;
    }

    fn handle(
        &mut self,
        now: SimTime,
        request: &Request,
        world: &mut dyn World,
    ) -> Result<(), TaskError> {
        let mut answer = Answer {
            sequence: request.sequence,
            ..Answer::default()
        };
        for (next, &asked) in self.state.next.iter_mut().zip(&request.pulses) {
            if asked.is_some() {
                answer.replaced |= next.is_some();
                *next = asked;
            }
        }
        let range = if request.twice {
            AdcRange::TwiceReference
        } else {
            AdcRange::Reference
        };
        let full_scale = range.full_scale(self.config.reference);
        let asked = request.inputs.iter().zip(&mut answer.counts);
        for (_, count) in asked.filter(|(asked, _)| **asked) {
            *count = Some(0);
        }
        for (input, &place) in self.config.analog.iter().zip(&self.inputs) {
            let (Some(tap), Some(place)) = (&input.tap, place) else {
                continue;
            };
            if request.inputs[input.channel] {
                let volts = tap.reading(world.sample(place..place + 1)?[0]);
                answer.counts[input.channel] = Some(convert(volts, full_scale));
            }
        }
        let mut bytes = Vec::new();
        answer.encode(&mut bytes);
        self.state.answer = Some((now + REACTION, bytes));
        Ok(())
    }
}

/// What the converter makes of a voltage.
fn convert(volts: f64, full_scale: f64) -> u16 {
    let most = f64::from(COUNTS - 1);
    let count = (volts / full_scale * f64::from(COUNTS)).clamp(0.0, most);
    // A voltage that is no number becomes 0.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 1023; the converter rounds down"
    )]
    let count = count as u16;
    count
}

impl Node for Rb110Board {
    fn name(&self) -> &str {
        &self.config.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let servos = self.config.servos.iter();
        self.commands = servos
            .map(|servo| plant.find(owner, &Port::output(&servo.command, Unit::Radian, 1)))
            .collect::<Result<_, _>>()?;
        let inputs = self.config.analog.iter().map(|input| input.tap.as_ref());
        self.inputs = inputs
            .map(|tap| tap.map(|tap| tap.find(owner, plant)).transpose())
            .collect::<Result<_, _>>()?;
        Ok(())
    }

    fn hear(&mut self, piece: Piece<'_>) {
        self.framer.push(piece.bytes);
    }

    fn attention(&self) -> Option<usize> {
        Some(self.framer.missing())
    }

    fn next_wake(&self) -> Option<SimTime> {
        let ends = (0..LINES).filter_map(|line| self.end(line));
        ends.chain([self.next_start()]).min()
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        while let Some(frame) = self.framer.next_frame() {
            if let Ok(request) = Frame::new(frame).and_then(Request::try_from) {
                self.handle(now, &request, world)?;
            }
        }
        self.end_pulses(now, world)?;
        while self.next_start() <= now {
            self.begin_pulses();
            self.end_pulses(now, world)?;
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, answer) = self.state.answer.take()?;
        bytes.extend(answer);
        Some(start)
    }

    fn gauges(&self) -> Vec<Port> {
        let name = &self.config.name;
        ["pulses", "unheard"]
            .map(|gauge| Port::output(format!("{name}/{gauge}"), Unit::One, 1))
            .into()
    }

    fn read_gauges(&self, _now: SimTime, values: &mut [f64]) {
        values.copy_from_slice(&[self.state.sent as f64, self.framer.skipped() as f64]);
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
