use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Driver, DriverError, Transfer};
use twinrig_wire::{Framer, FramerState};

use crate::assumed::{ATTEMPTS, PATIENCE};
use crate::protocol::{Counts, Frame, Health, Message, Status, measure};
use crate::{OptoForce, Speed, Take};

/// Sets the sensor up and keeps its newest sample.
///
/// Opening takes as long as it takes until the sensor has acknowledged and sent a sample. Samples that are missing by
/// the sensor's own counter are counted; so are those that say that something is wrong with the sensor. The force stays as
/// it was until a sound sample comes.
#[derive(Debug)]
pub struct OptoForceDriver {
    config: OptoForce,
    framer: Framer,
    state: State,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct State {
    phase: Phase,
    /// When waiting is over.
    until: Option<HostTime>,
    request: Option<Vec<u8>>,
    counter: Option<u16>,
    force: [f64; 3],
    counters: Counters,
    refused: Option<u8>,
    failed: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
enum Phase {
    #[default]
    Idle,
    /// It has asked so often.
    Opening(u32),
    /// Acknowledged; now for a sample.
    Awaiting(u32),
    /// A transfer that wants a fresh sample.
    Transfer,
    /// It has asked so often.
    Closing(u32),
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

fn later(now: HostTime, by: SimDuration) -> HostTime {
    HostTime::from_nanos(now.as_nanos().saturating_add(by.as_nanos()))
}

impl OptoForceDriver {
    /// From what was checked.
    pub(crate) fn new(config: OptoForce) -> Self {
        Self {
            config,
            framer: Framer::new(measure),
            state: State::default(),
        }
    }

    fn ask(&mut self, now: HostTime, phase: Phase, speed: Speed) {
        let configuration = Message::Configuration {
            speed,
            cutoff: self.config.cutoff,
            zero: self.config.zero,
        };
        configuration.encode(self.state.request.insert(Vec::new()));
        self.wait(now, phase, PATIENCE);
    }

    fn wait(&mut self, now: HostTime, phase: Phase, patience: SimDuration) {
        self.state.phase = phase;
        self.state.until = Some(later(now, patience));
    }

    fn rest(&mut self) {
        self.state.phase = Phase::Idle;
        self.state.until = None;
    }

    fn handle(&mut self, now: HostTime, message: &Message) {
        match (self.state.phase, message) {
            (
                _,
                Message::Data {
                    counter,
                    status,
                    counts: Counts::Three(counts),
                },
            ) => {
                self.sample(*counter, *status, *counts);
            }
            (Phase::Opening(asked), Message::Acknowledgement { status: 0 }) => {
                self.wait(now, Phase::Awaiting(asked), PATIENCE);
            }
            (Phase::Closing(_), Message::Acknowledgement { status: 0 }) => self.rest(),
            (_, Message::Acknowledgement { status }) => {
                self.state.refused = Some(*status).filter(|status| *status != 0);
            }
            _ => self.state.counters.foreign += 1,
        }
    }

    fn sample(&mut self, counter: u16, status: Status, counts: [i16; 3]) {
        let counters = &mut self.state.counters;
        let ahead = self
            .state
            .counter
            .map_or(1, |last| counter.wrapping_sub(last));
        if ahead == 0 || ahead > u16::MAX / 2 {
            // It came before, or late.
            counters.stale += 1;
            return;
        }
        counters.samples += 1;
        counters.lost += u64::from(ahead - 1);
        counters.overloaded += u64::from(status.overload().contains(&true));
        self.state.counter = Some(counter);
        if status.electronics() != 0 || status.health() != Health::Good {
            counters.unwell += 1;
            return;
        }
        self.state.force = counts.map(|count| f64::from(count) / self.config.sensitivity);
        if matches!(self.state.phase, Phase::Awaiting(_) | Phase::Transfer) {
            self.rest();
        }
    }
}

impl Driver for OptoForceDriver {
    fn name(&self) -> &str {
        &self.config.name
    }

    fn ports(&self) -> Vec<Port> {
        let name = format!("{}/force", self.config.name);
        vec![Port::output(name, Unit::Newton, 3)]
    }

    fn open(&mut self, now: HostTime) {
        self.ask(now, Phase::Opening(1), self.config.speed);
    }

    fn begin(&mut self, now: HostTime, _from_process: &[f64]) {
        if self.config.take == Take::Fresh {
            let period = SimDuration::from_millis(u64::from(self.config.speed.code()));
            self.wait(now, Phase::Transfer, period * 2);
        }
    }

    fn close(&mut self, now: HostTime) {
        self.ask(now, Phase::Closing(1), Speed::Stop);
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
                self.ask(now, Phase::Opening(asked + 1), self.config.speed);
            }
            Phase::Closing(asked) if asked < ATTEMPTS => {
                self.ask(now, Phase::Closing(asked + 1), Speed::Stop);
            }
            Phase::Opening(_) | Phase::Awaiting(_) => {
                self.state.failed = true;
                self.rest();
            }
            Phase::Transfer => {
                self.state.counters.stale += 1;
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
            let name = &self.config.name;
            let why = match self.state.refused {
                Some(status) => {
                    format!("the sensor of {name} refuses its configuration with status {status}")
                }
                None => format!(
                    "the sensor of {name} did not acknowledge and send within {PATIENCE}, {ATTEMPTS} times over: is it there, at the right port?"
                ),
            };
            return Err(DriverError { why });
        }
        Ok(match self.state.phase {
            Phase::Idle => Transfer::Done,
            _ => Transfer::Busy,
        })
    }

    fn to_process(&self) -> &[f64] {
        &self.state.force
    }

    fn gauges(&self) -> Vec<Port> {
        [
            "samples",
            "lost",
            "stale",
            "unwell",
            "overloaded",
            "foreign",
            "garbage",
        ]
        .map(|gauge| Port::output(format!("{}/{gauge}", self.config.name), Unit::One, 1))
        .into()
    }

    fn read_gauges(&self, values: &mut [f64]) {
        let Counters {
            samples,
            lost,
            stale,
            unwell,
            overloaded,
            foreign,
        } = self.state.counters;
        let garbage = self.framer.skipped();
        let counts = [samples, lost, stale, unwell, overloaded, foreign, garbage];
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
