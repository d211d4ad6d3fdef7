use thiserror::Error;
use twinrig_kernel::{BoardClock, SimDuration, SimTime};
use twinrig_runtime::{
    DriverError, Part, TaskError, TimeSource, Timing, TimingError, Wire, WiringError,
};
use twinrig_wire::{FaultSchedule, UsbTiming};

use super::stand::Stand;
use crate::bus::ServoBusWire;
use crate::config::{JointSignals, ReadPattern, ServoBusConfig, ServoConfig};
use crate::error::{PacketError, ServoBusError};
use crate::parser::{Parser, Received};
use crate::protocol::ProtocolVersion;
use crate::request::{Request, Span};
use crate::x::XL330_M288;

/// Time of a byte at 1 Mbit/s.
const BYTE_TIME: SimDuration = SimDuration::from_micros(10);
/// Register of the return delay, and its unit.
const RETURN_DELAY: u16 = 9;
const RETURN_DELAY_UNIT: SimDuration = SimDuration::from_micros(2);
const GOAL_POSITION: u16 = 116;
/// Registers that the loop reads, each by an instruction of its own: position, velocity, duty
/// cycle, voltage and temperature.
const READS: [Span; 5] = [
    span(132, 4),
    span(128, 4),
    span(124, 2),
    span(144, 2),
    span(146, 1),
];
const ID: u8 = 1;
/// Time after which an answer is missing.
const TIMEOUT: SimDuration = SimDuration::from_millis(100);

const fn span(address: u16, length: u16) -> Span {
    Span { address, length }
}

/// Loop of a blocking program over a bus with one XL330 at 1 Mbit/s: with torque it writes the goal
/// position, waits for the answer and sleeps; then it reads five registers one after the other.
#[derive(Clone, Debug)]
pub struct HostLoop {
    /// Adapter and host.
    pub usb: UsbTiming,
    /// Return delay of the servo, in steps of 2 µs, at most 508 µs.
    pub return_delay: SimDuration,
    /// Sleep after a write; none: without torque, and so without a write.
    pub sleep: Option<SimDuration>,
    /// Time of the program between an answer and its next act.
    pub program: Timing,
    /// Seed.
    pub seed: u64,
}

/// A loop that cannot be run.
#[derive(Debug, Error)]
pub enum LoopError {
    /// The bus.
    #[error(transparent)]
    Bus(#[from] ServoBusError),
    /// The joint.
    #[error(transparent)]
    Wiring(#[from] WiringError),
    /// The wire.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// A request.
    #[error(transparent)]
    Packet(#[from] PacketError),
    /// The time of the program.
    #[error("time of the program: {0}; check its bounds")]
    Program(#[from] TimingError),
    /// The driver.
    #[error(transparent)]
    Driver(#[from] DriverError),
    /// The servo does not answer.
    #[error("no answer to the request at {0}: lengthen no adapter beyond {TIMEOUT}")]
    NoAnswer(SimTime),
}

impl HostLoop {
    /// Runs the loop for `count` periods after the first 10 and returns their lengths, between the
    /// middles of the reads.
    ///
    /// # Errors
    /// [`LoopError`] if the adapter or the return delay is invalid.
    pub fn periods(&self, count: usize) -> Result<Vec<SimDuration>, LoopError> {
        let mut host = Host::new(self)?;
        let mut stamps = Vec::with_capacity(count + 11);
        for _ in 0..count + 11 {
            if let Some(sleep) = self.sleep {
                let data = &2048_i32.to_le_bytes();
                host.transact(&Request::Write {
                    address: GOAL_POSITION,
                    data,
                })?;
                host.wait(sleep)?;
            }
            let begin = host.now.since_start();
            for span in READS {
                host.transact(&Request::Read(span))?;
            }
            // Twice the middle, so that it is a whole number.
            stamps.push((begin + host.now.since_start()).as_nanos());
        }
        let pairs = stamps[10..].windows(2);
        let periods = pairs.map(|pair| SimDuration::from_nanos((pair[1] - pair[0]) / 2));
        Ok(periods.collect())
    }

    fn config(&self) -> ServoBusConfig {
        let units = self.return_delay.as_nanos() / RETURN_DELAY_UNIT.as_nanos();
        let units = i32::try_from(units).unwrap_or(i32::MAX);
        let servo = ServoConfig {
            name: "servo".to_owned(),
            kind: &XL330_M288,
            id: ID,
            registers: vec![(RETURN_DELAY, units)],
            settings: Vec::new(),
            signals: JointSignals::of_joint("servo"),
            command: String::new(),
            voltage: XL330_M288.voltage,
            temperature: 25.0,
            clock: BoardClock::IDEAL,
        };
        ServoBusConfig {
            name: "loop".to_owned(),
            servos: vec![servo],
            byte_time: BYTE_TIME,
            pattern: ReadPattern::Read,
            period: TIMEOUT,
            timeout: TIMEOUT,
            usb: self.usb.clone(),
            turnaround: SimDuration::ZERO,
            faults: FaultSchedule::default(),
            seed: self.seed,
        }
    }
}

/// The program at its end of the wire.
struct Host {
    wire: ServoBusWire,
    stand: Stand,
    now: SimTime,
    program: TimeSource,
    parser: Parser,
    bytes: Vec<u8>,
}

impl Host {
    fn new(of: &HostLoop) -> Result<Self, LoopError> {
        let config = of.config();
        let (stand, signals) = Stand::new(&config.servos);
        let mut wire = config.wire()?;
        wire.connect("loop", &signals)?;
        Ok(Self {
            wire,
            stand,
            now: SimTime::ZERO,
            program: of.program.clone().source(of.seed, "loop/program")?,
            parser: Parser::new(ProtocolVersion::Two),
            bytes: Vec::new(),
        })
    }

    /// Waits without a request.
    fn wait(&mut self, time: SimDuration) -> Result<(), LoopError> {
        self.now += time;
        self.stand.now = self.now;
        Ok(self.wire.advance(self.now, &mut self.stand)?)
    }

    /// Requests and waits for the answer.
    fn transact(&mut self, request: &Request<'_>) -> Result<(), LoopError> {
        let time = self.program.draw();
        self.wait(time)?;
        let start = self.now;
        self.bytes.clear();
        request.encode(ProtocolVersion::Two, ID, &mut self.bytes)?;
        self.wire.send(start, &self.bytes);
        while !self.has_answer() {
            let wake = self.wire.next_wake();
            let wake = wake.filter(|wake| *wake <= start + TIMEOUT);
            self.now = wake.ok_or(LoopError::NoAnswer(start))?;
            self.wire.advance(self.now, &mut self.stand)?;
        }
        Ok(())
    }

    /// Reads what is there; returns whether it completes an answer without error.
    fn has_answer(&mut self) -> bool {
        self.bytes.clear();
        self.wire.receive(&mut self.bytes);
        self.parser.push(&self.bytes);
        let Some(Received::Packet(packet)) = self.parser.next_packet() else {
            return false;
        };
        let status = packet.status(ProtocolVersion::Two);
        status.is_some_and(|status| status.error == 0)
    }
}
