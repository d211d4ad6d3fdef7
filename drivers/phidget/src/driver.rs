use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Driver, DriverError, Transfer};
use twinrig_wire::{Framer, FramerState};

use crate::assumed::{ATTEMPTS, PATIENCE};
use crate::protocol::{COUNTS, Frame, Message, SCALE, measure};
use crate::{Board, Phidget};

/// Sets the board up and keeps its newest readings.
///
/// Opening takes as long as it takes until the board has accepted its set-up and reported. Reports that are missing by the
/// board's own count are counted.
#[derive(Debug)]
pub struct PhidgetDriver {
    config: Phidget,
    framer: Framer,
    state: State,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct State {
    phase: Phase,
    /// When waiting is over.
    until: Option<HostTime>,
    request: Option<Vec<u8>>,
    sequence: Option<u8>,
    readings: Vec<f64>,
    counters: Counters,
    refused: bool,
    failed: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
enum Phase {
    #[default]
    Idle,
    /// It has asked so often.
    Opening(u32),
    /// Accepted; now for a report.
    Awaiting(u32),
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Counters {
    reports: u64,
    lost: u64,
    stale: u64,
    overloaded: u64,
    foreign: u64,
}

fn later(now: HostTime, by: SimDuration) -> HostTime {
    HostTime::from_nanos(now.as_nanos().saturating_add(by.as_nanos()))
}

impl PhidgetDriver {
    /// From what was checked.
    pub(crate) fn new(config: Phidget) -> Self {
        let state = State {
            readings: vec![0.0; config.board.channels()],
            ..State::default()
        };
        Self {
            config,
            framer: Framer::new(measure),
            state,
        }
    }

    fn ask(&mut self, now: HostTime, asked: u32) {
        let setup = Message::Setup(self.config.board.setup());
        setup.encode(self.state.request.insert(Vec::new()));
        self.state.phase = Phase::Opening(asked);
        self.state.until = Some(later(now, PATIENCE));
    }

    fn rest(&mut self) {
        self.state.phase = Phase::Idle;
        self.state.until = None;
    }

    fn handle(&mut self, now: HostTime, message: &Message) {
        match (message, self.config.board, self.state.phase) {
            (Message::Accepted { done: true }, _, Phase::Opening(asked)) => {
                self.state.phase = Phase::Awaiting(asked);
                let patience = PATIENCE + self.config.board.interval();
                self.state.until = Some(later(now, patience));
            }
            (Message::Accepted { done }, ..) => self.state.refused = !done,
            (
                Message::Bridge {
                    sequence,
                    overload,
                    counts,
                },
                Board::Bridge { gain, .. },
                _,
            ) => {
                let one = f64::from(COUNTS) * f64::from(gain.times());
                let over = overload.contains(&true);
                self.report(*sequence, over, counts.map(|count| f64::from(count) / one));
            }
            (Message::InterfaceKit { sequence, readings }, Board::InterfaceKit { .. }, _) => {
                let volt = f64::from(SCALE) / 5.0;
                let volts = readings.map(|reading| f64::from(reading) / volt);
                self.report(*sequence, false, volts);
            }
            _ => self.state.counters.foreign += 1,
        }
    }

    fn report<const N: usize>(&mut self, sequence: u8, overloaded: bool, readings: [f64; N]) {
        let counters = &mut self.state.counters;
        let last = self.state.sequence;
        let ahead = last.map_or(1, |last| sequence.wrapping_sub(last));
        if ahead == 0 || ahead > u8::MAX / 2 {
            // It came before, or late.
            counters.stale += 1;
            return;
        }
        counters.reports += 1;
        counters.lost += u64::from(ahead - 1);
        counters.overloaded += u64::from(overloaded);
        self.state.sequence = Some(sequence);
        self.state.readings.clear();
        self.state.readings.extend(readings);
        if matches!(self.state.phase, Phase::Awaiting(_)) {
            self.rest();
        }
    }
}

impl Driver for PhidgetDriver {
    fn name(&self) -> &str {
        &self.config.name
    }

    fn ports(&self) -> Vec<Port> {
        let board = self.config.board;
        let (port, unit) = match board {
            Board::Bridge { .. } => ("bridge", Unit::One),
            Board::InterfaceKit { .. } => ("analog", Unit::Volt),
        };
        let name = format!("{}/{port}", self.config.name);
        vec![Port::output(name, unit, board.channels())]
    }

    fn open(&mut self, now: HostTime) {
        self.ask(now, 1);
    }

    fn begin(&mut self, _now: HostTime, _from_process: &[f64]) {}

    /// There is nothing to be left safe: the board goes on reporting.
    fn close(&mut self, _now: HostTime) {
        self.rest();
    }

    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        self.framer.push(bytes);
        while let Some(frame) = self.framer.next_frame() {
            let message = Frame::new(frame).and_then(Message::try_from);
            if let Ok(message) = message {
                self.handle(now, &message);
            }
        }
    }

    fn handle_timeout(&mut self, now: HostTime) {
        if self.state.until.is_none_or(|until| now < until) {
            return;
        }
        match self.state.phase {
            Phase::Opening(asked) | Phase::Awaiting(asked) if asked < ATTEMPTS => {
                self.ask(now, asked + 1);
            }
            Phase::Opening(_) | Phase::Awaiting(_) => {
                self.state.failed = true;
                self.rest();
            }
            Phase::Idle => self.rest(),
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
            let name = &self.config.name;
            let why = if self.state.refused {
                format!("the board of {name} refuses its set-up: it is another board")
            } else {
                format!(
                    "the board of {name} did not accept its set-up and report within {PATIENCE}, {ATTEMPTS} times over: is it there, at the right port?"
                )
            };
            return Err(DriverError { why });
        }
        Ok(match self.state.phase {
            Phase::Idle => Transfer::Done,
            _ => Transfer::Busy,
        })
    }

    fn to_process(&self) -> &[f64] {
        &self.state.readings
    }

    fn gauges(&self) -> Vec<Port> {
        [
            "reports",
            "lost",
            "stale",
            "overloaded",
            "foreign",
            "garbage",
        ]
        .map(|gauge| Port::output(format!("{}/{gauge}", self.config.name), Unit::One, 1))
        .into()
    }

    fn read_gauges(&self, values: &mut [f64]) {
        let Counters {
            reports,
            lost,
            stale,
            overloaded,
            foreign,
        } = self.state.counters;
        let garbage = self.framer.skipped();
        let counts = [reports, lost, stale, overloaded, foreign, garbage];
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
