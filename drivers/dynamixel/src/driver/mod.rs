use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{BusHealth, Driver, DriverError};
use twinrig_wire::{Diagnostics, TrafficError, TrafficLog};

use crate::config::{ServoBusConfig, ServoConfig};
use crate::error::ServoBusError;
use crate::parser::{Parser, Received};
use crate::protocol::{Packet, ProtocolVersion};

mod session;
mod step;
mod transfer;

use step::Step;

/// Bytes of an answer besides its data, byte stuffing included.
const ANSWER: u64 = 16;

/// Host driver of servos: prepares them, writes the goals of all servos by one instruction and
/// reads their positions once in a transfer, and turns the torque off at the end.
///
/// For every servo its input is the command \[rad\], its output the measured angle \[rad\]. The
/// output of a servo that does not answer keeps its last value. An instruction to all servos is not
/// answered: a goal that a servo refuses, because of its limits or its bus watchdog, is not
/// noticed.
///
/// Diagnostics, `BUS/…`, counted from the creation of the driver: `transfers`; `answers`; `lost`,
/// servos that did not answer a read in time; `refused`, answers with an error; `damaged`, packets
/// with a wrong checksum; `unexpected`, answers that nothing asked for; `saturated`, goals beyond a
/// turn; `garbage`, bytes outside packets.
pub struct DynamixelDriver {
    config: ServoBusConfig,
    /// Identifiers, and the reads of a bulk read.
    ids: Vec<u8>,
    reads: Vec<u8>,
    /// Identifiers and goals of a sync write.
    writes: Vec<u8>,
    state: State,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    stage: Stage,
    parser: Parser,
    /// Bytes to be written.
    tx: Vec<u8>,
    /// Time-out of the pending request.
    until: Option<HostTime>,
    attempts: u32,
    /// Servos whose answers to the pending read are missing.
    missing: Vec<bool>,
    /// Goals in the order of the servos \[counts\].
    goals: Vec<i32>,
    to_process: Vec<f64>,
    failed: Option<String>,
    counters: Counters,
    traffic: TrafficLog,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Stage {
    Closed,
    /// Step of a servo.
    Opening(usize, usize),
    Open,
    /// The next servo to be read alone.
    Reading(usize),
    Closing(usize),
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Counters {
    transfers: u64,
    answers: u64,
    lost: u64,
    refused: u64,
    damaged: u64,
    unexpected: u64,
    saturated: u64,
}

impl ServoBusConfig {
    /// Returns the driver, which runs on the host.
    ///
    /// # Errors
    /// [`ServoBusError`] if the configuration is invalid.
    pub fn driver(&self) -> Result<DynamixelDriver, ServoBusError> {
        self.check()?;
        let count = self.servos.len();
        let protocol = self.protocol();
        let reads = self.checked_reads()?;
        Ok(DynamixelDriver {
            ids: self.servos.iter().map(|servo| servo.id).collect(),
            reads,
            writes: Vec::new(),
            state: State {
                stage: Stage::Closed,
                parser: Parser::new(protocol),
                tx: Vec::new(),
                until: None,
                attempts: 0,
                missing: vec![false; count],
                goals: vec![0; count],
                to_process: vec![0.0; count],
                failed: None,
                counters: Counters::default(),
                traffic: TrafficLog::default(),
            },
            config: self.clone(),
        })
    }
}

impl DynamixelDriver {
    fn servo(&self, index: usize) -> &ServoConfig {
        &self.config.servos[index]
    }

    /// Waits for the answers of `answers` servos, of `data` bytes each, to the bytes to be written.
    fn wait(&mut self, now: HostTime, answers: usize, data: u16) {
        let answers = answers as u64;
        let bytes = self.state.tx.len() as u64 + answers * (ANSWER + u64::from(data));
        let delays = Step::RETURN_DELAY * answers;
        let wait = self.config.byte_time * bytes + delays + self.config.timeout;
        self.state.until = Some(now + wait);
    }

    fn count_unexpected(&mut self, servo: Option<usize>, now: HostTime) {
        self.state.counters.unexpected += 1;
        let kind = TrafficError::Unexpected;
        self.state.traffic.error(kind, servo.map(number), 1, now);
    }

    /// Counts an error if bytes have been skipped beyond `before`.
    fn count_garbled(&mut self, before: u64, now: HostTime) {
        let garbled = u64::from(self.state.parser.skipped() > before);
        let kind = TrafficError::Garbled;
        self.state.traffic.error(kind, None, garbled, now);
    }

    /// Discards the beginning of an answer whose rest has not come in time.
    fn discard_beginning(&mut self, now: HostTime) {
        let skipped = self.state.parser.skipped();
        self.state.parser.reset();
        self.count_garbled(skipped, now);
    }

    fn handle_packet(&mut self, now: HostTime, packet: &Packet<'_>) {
        let protocol = self.config.protocol();
        match (self.state.stage, packet.status(protocol)) {
            (Stage::Opening(..) | Stage::Closing(_), Some(status)) => {
                self.handle_step(now, &status);
            }
            (Stage::Reading(_), Some(_)) if packet.id == ProtocolVersion::BROADCAST => {
                self.handle_fast(now, packet.parameters);
            }
            (Stage::Reading(_), Some(status)) => self.handle_read(now, &status),
            _ => self.count_unexpected(None, now),
        }
    }

    fn report(&self, diagnostics: &mut Diagnostics<'_>) {
        let counters = &self.state.counters;
        diagnostics.count("transfers", counters.transfers);
        diagnostics.count("answers", counters.answers);
        diagnostics.count("lost", counters.lost);
        diagnostics.count("refused", counters.refused);
        diagnostics.count("damaged", counters.damaged);
        diagnostics.count("unexpected", counters.unexpected);
        diagnostics.count("saturated", counters.saturated);
        diagnostics.count("garbage", self.state.parser.skipped());
    }
}

/// Number of a servo in the traffic log.
fn number(index: usize) -> u16 {
    u16::try_from(index).unwrap_or(u16::MAX)
}

impl Driver for DynamixelDriver {
    fn name(&self) -> &str {
        &self.config.name
    }

    fn ports(&self) -> Vec<Port> {
        let servos = || self.config.servos.iter();
        let commands = servos().map(|servo| Port::input(&servo.command, Unit::Radian, 1));
        let angles = servos().map(|servo| Port::output(&servo.signals.angle, Unit::Radian, 1));
        commands.chain(angles).collect()
    }

    fn open(&mut self, now: HostTime) {
        self.state.attempts = 0;
        self.state.parser.reset();
        self.state.stage = if self.config.servos.is_empty() {
            Stage::Open
        } else {
            let first = self.servo(0);
            let protocol = self.config.protocol();
            let step = Step::answer_all(first);
            // A step fits into a packet.
            let all = ProtocolVersion::BROADCAST;
            let _ = step.request().encode(protocol, all, &mut self.state.tx);
            Stage::Opening(0, 0)
        };
        self.request_step(now);
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        let state = &mut self.state;
        let servos = self.config.servos.iter().zip(&mut state.goals);
        for ((servo, goal), command) in servos.zip(from_process) {
            // A command that is not a number leaves the last goal.
            let limited = match servo.model().goal_counts(*command) {
                Some((counts, limited)) => {
                    *goal = counts;
                    limited
                }
                None => true,
            };
            state.counters.saturated += u64::from(limited);
        }
        if state.stage == Stage::Open {
            self.begin_transfer(now);
        }
    }

    fn close(&mut self, now: HostTime) {
        if self.state.stage == Stage::Closed && self.state.failed.is_none() {
            return;
        }
        self.state.traffic.forget_silences();
        self.state.failed = None;
        self.state.attempts = 0;
        self.state.parser.reset();
        self.state.tx.clear();
        self.state.stage = if self.config.servos.is_empty() {
            Stage::Closed
        } else {
            Stage::Closing(0)
        };
        self.request_step(now);
    }

    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        let skipped = self.state.parser.skipped();
        // The parser is moved out while its packets are handled.
        let empty = Parser::new(self.config.protocol());
        let mut parser = std::mem::replace(&mut self.state.parser, empty);
        parser.push(bytes);
        while let Some(received) = parser.next_packet() {
            match received {
                Received::Packet(packet) => self.handle_packet(now, &packet),
                Received::Damaged { .. } => {
                    self.state.counters.damaged += 1;
                    let kind = TrafficError::Checksum;
                    self.state.traffic.error(kind, None, 1, now);
                }
            }
        }
        self.state.parser = parser;
        self.count_garbled(skipped, now);
    }

    fn handle_timeout(&mut self, now: HostTime) {
        if self.state.until.is_none_or(|until| now < until) {
            return;
        }
        self.state.until = None;
        match self.state.stage {
            Stage::Opening(index, _) | Stage::Closing(index) => {
                let kind = TrafficError::NoAnswer;
                self.state.traffic.error(kind, Some(number(index)), 1, now);
                self.discard_beginning(now);
                self.repeat_step(now);
            }
            Stage::Reading(_) => {
                for servo in 0..self.config.servos.len() {
                    if std::mem::take(&mut self.state.missing[servo]) {
                        self.state.counters.lost += 1;
                        let kind = TrafficError::NoAnswer;
                        self.state.traffic.error(kind, Some(number(servo)), 1, now);
                    }
                }
                self.discard_beginning(now);
                self.continue_reading(now);
            }
            Stage::Closed | Stage::Open => {}
        }
    }

    fn poll_timeout(&self) -> Option<HostTime> {
        self.state.until
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        let any = !self.state.tx.is_empty();
        bytes.append(&mut self.state.tx);
        any
    }

    fn is_busy(&self) -> Result<bool, DriverError> {
        match (&self.state.failed, self.state.stage) {
            // The first failure is reported when all servos have been told to turn off.
            (Some(why), Stage::Closed) => Err(DriverError { why: why.clone() }),
            (_, stage) => Ok(!matches!(stage, Stage::Open | Stage::Closed)),
        }
    }

    fn to_process(&self) -> &[f64] {
        &self.state.to_process
    }

    fn diagnostics(&self) -> Vec<Port> {
        Diagnostics::ports(&self.config.name, |diagnostics| self.report(diagnostics))
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        Diagnostics::read(values, |diagnostics| self.report(diagnostics));
    }

    fn period(&self) -> Option<SimDuration> {
        Some(self.config.period)
    }

    fn bus_health(&self, now: HostTime) -> Option<BusHealth> {
        let name = |index: u16| {
            let servo = self.config.servos.get(usize::from(index));
            servo.map_or_else(String::new, |it| {
                format!("servo {} (id {})", it.name, it.id)
            })
        };
        Some(self.state.traffic.health(now, self.period(), name))
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.config.name, &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (name, state): (String, State) = snapshot.read()?;
        if name != self.config.name || state.goals.len() != self.state.goals.len() {
            return Err(SnapshotError::Mismatch {
                expected: self.config.name.clone(),
                found: name,
            });
        }
        self.state = state;
        Ok(())
    }
}
