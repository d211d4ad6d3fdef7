use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{BYTE_TIME, ErrorCode, Instruction, REGISTER_ID};
use crate::error::SbcpError;
use crate::packet::{Address, Payload, Request, emit};
use crate::registers::RegisterTable;
use crate::request_parser::RequestParser;
use crate::standard::{Change, execute_standard};

/// Time at which a slave handles a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AnswerPolicy {
    /// At its last bit.
    AtOnce,
    /// At the next iteration of its main loop ([`Slave::main_loop`]), as in the first firmware.
    MainLoop,
}

/// Configuration of a slave; the defaults are those of the final firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlaveConfig {
    /// Class of the device.
    pub class: u8,
    /// Time at which requests are handled.
    pub policy: AnswerPolicy,
    /// Time from a low-latency request's last bit to the answer's first: 10 µs, the maximum given
    /// by the thesis.
    pub low_latency_reaction: SimDuration,
    /// The same for the standard instructions, or from the main loop on: 10 µs, ASSUMED.
    pub standard_reaction: SimDuration,
    /// Silence that ends a packet being received: 15 µs, ASSUMED.
    pub idle_gap: SimDuration,
    /// Time of a byte (ten bits).
    pub byte_time: SimDuration,
    /// Required length of the payload of a low-latency request \[B\]; None: any.
    pub low_latency_request: Option<usize>,
}

impl SlaveConfig {
    /// The defaults for a device of that class.
    pub const fn new(class: u8) -> Self {
        Self {
            class,
            policy: AnswerPolicy::AtOnce,
            low_latency_reaction: SimDuration::from_micros(10),
            standard_reaction: SimDuration::from_micros(10),
            idle_gap: SimDuration::from_micros(15),
            byte_time: BYTE_TIME,
            low_latency_request: None,
        }
    }
}

/// Effect of a request on a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SlaveEvent {
    /// A low-latency request was accepted.
    LowLatency {
        /// Time: at its last bit, or in the main loop.
        at: SimTime,
        /// Payload of the request.
        payload: Payload,
    },
    /// A register was written.
    Written {
        /// Time.
        at: SimTime,
        /// Address of the register.
        address: u8,
        /// Value written.
        value: u16,
    },
    /// The non-volatile registers were saved.
    Saved {
        /// Time.
        at: SimTime,
    },
}

/// Counters of a slave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlaveCounters {
    /// Requests handled, including broadcasts.
    pub requests: u64,
    /// Answers sent.
    pub answers: u64,
    /// Answers with an error, among them.
    pub refused: u64,
    /// Requests with a wrong checksum.
    pub damaged: u64,
    /// Bytes outside packets \[B\].
    pub garbage: u64,
    /// Bytes dropped for a wrong stop bit \[B\].
    pub framing_errors: u64,
    /// Requests, or pending answers, replaced by a newer request.
    pub superseded: u64,
    /// Events lost because they were not polled in time.
    pub events_lost: u64,
    /// Minimum time from the last bit of a low-latency request to the first of its answer.
    pub response_shortest: SimDuration,
    /// Maximum of that time.
    pub response_longest: SimDuration,
}

/// Maximum number of pending events.
const EVENTS_MAX: usize = 8;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Answer {
    /// Completion time of the request, if it is a low-latency request.
    request_end: Option<SimTime>,
    start: SimTime,
    from: Address,
    error: ErrorCode,
    payload: Payload,
}

/// Protocol of a device on the bus, independent of bus and clock: bytes and times in, bytes and
/// times out.
///
/// The owner
/// 1. passes in all bytes transmitted by others ([`Slave::receive`]), in order of time;
/// 2. calls [`Slave::main_loop`] at every iteration of the device's main loop;
/// 3. after either, takes the events ([`Slave::poll_event`]) and the answer
///    ([`Slave::poll_transmit`]);
/// 4. sets the reply to the low-latency instruction beforehand, whenever there are new data
///    ([`Slave::set_reply`]): an answer carries the reply as of the request's last bit.
///
/// A slave does not answer broadcasts, packets for other devices, and packets with a wrong
/// checksum.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Slave {
    config: SlaveConfig,
    address: Address,
    registers: RegisterTable,
    parser: RequestParser,
    reply: Option<Payload>,
    /// Request waiting for the main loop, with its completion time.
    waiting: Option<(SimTime, Request)>,
    answer: Option<Answer>,
    events: VecDeque<SlaveEvent>,
    counters: SlaveCounters,
}

impl Slave {
    /// A device at power-on. Its id is that of its registers.
    ///
    /// # Errors
    /// [`SbcpError::Address`] if the class is reserved.
    pub fn new(config: SlaveConfig, registers: RegisterTable) -> Result<Self, SbcpError> {
        let id = registers.get(REGISTER_ID).unwrap_or_default();
        let address = Address::new(config.class, u8::try_from(id).unwrap_or(u8::MAX))?;
        if address.is_broadcast() {
            let (class, id) = (address.class(), address.id());
            return Err(SbcpError::Address { class, id });
        }
        Ok(Self {
            parser: RequestParser::new(config.idle_gap, config.byte_time),
            config,
            address,
            registers,
            reply: None,
            waiting: None,
            answer: None,
            events: VecDeque::with_capacity(EVENTS_MAX),
            counters: SlaveCounters::default(),
        })
    }

    /// Returns the address. An id written to the register applies from the next power cycle on, if
    /// it was saved.
    pub fn address(&self) -> Address {
        self.address
    }

    /// Returns the registers.
    pub fn registers(&self) -> &RegisterTable {
        &self.registers
    }

    /// Returns the registers, to be written by the device.
    pub fn registers_mut(&mut self) -> &mut RegisterTable {
        &mut self.registers
    }

    /// Returns the counters.
    pub fn counters(&self) -> SlaveCounters {
        SlaveCounters {
            damaged: self.parser.damaged,
            garbage: self.parser.garbage,
            ..self.counters
        }
    }

    /// Sets the reply to the low-latency instruction.
    ///
    /// # Errors
    /// [`SbcpError::Payload`] if it is too long; the previous reply remains.
    pub fn set_reply(&mut self, payload: &[u8]) -> Result<(), SbcpError> {
        self.reply = Some(Payload::new(payload)?);
        Ok(())
    }

    /// Receives bytes transmitted by others, complete by now.
    pub fn receive(&mut self, piece: Piece<'_>) {
        if piece.framing_error {
            self.counters.framing_errors += piece.bytes.len() as u64;
            self.parser.line_busy(piece);
            return;
        }
        let mut position = self.parser.begin(piece);
        while let Some((at, request)) = self.parser.next(self.address, piece, &mut position) {
            self.handle(at, &request);
        }
    }

    fn handle(&mut self, at: SimTime, request: &Request) {
        match self.config.policy {
            AnswerPolicy::AtOnce => self.execute(at, at, request),
            AnswerPolicy::MainLoop => {
                if self.waiting.replace((at, *request)).is_some() {
                    self.counters.superseded += 1;
                }
            }
        }
    }

    /// Returns the minimum number of further bytes before a reaction, for
    /// `twinrig_wire::Node::min_bytes_needed`.
    pub fn min_bytes_needed(&self) -> usize {
        self.parser.missing()
    }

    /// Returns the device's address as [`recipient`] has it, for
    /// `twinrig_wire::Node::listens_to`; none within a packet, or with
    /// [`AnswerPolicy::MainLoop`].
    ///
    /// [`recipient`]: crate::recipient
    pub fn packet_address(&self, spacing: SimDuration) -> Option<u16> {
        let listens =
            self.config.policy == AnswerPolicy::AtOnce && self.parser.ignores_others(spacing);
        listens.then(|| self.address.word())
    }

    /// Runs an iteration of the main loop at `now`: with [`AnswerPolicy::MainLoop`], handles the
    /// last request received.
    pub fn main_loop(&mut self, now: SimTime) {
        if let Some((request_end, request)) = self.waiting {
            self.waiting = None;
            self.execute(request_end, now, &request);
        }
    }

    /// Returns the next event, in order. At most eight are pending; then the oldest is lost.
    pub fn poll_event(&mut self) -> Option<SlaveEvent> {
        self.events.pop_front()
    }

    /// Appends the next answer to `bytes` and returns the start of its first bit.
    pub fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let answer = self.answer.take()?;
        emit(answer.from, answer.error.0, &answer.payload, bytes);
        self.counters.answers += 1;
        self.counters.refused += u64::from(answer.error != ErrorCode::OK);
        if let Some(request_end) = answer.request_end {
            self.record_response(answer.start - request_end);
        }
        Some(answer.start)
    }

    fn record_response(&mut self, response: SimDuration) {
        let counters = &mut self.counters;
        if counters.response_longest.is_zero() {
            counters.response_shortest = response;
        }
        counters.response_shortest = counters.response_shortest.min(response);
        counters.response_longest = counters.response_longest.max(response);
    }

    /// Cycles the power: unsaved registers have their factory values; received bytes, the reply,
    /// pending answers and events are discarded.
    pub fn power_cycle(&mut self) {
        self.registers.power_cycle();
        let id = self.registers.get(REGISTER_ID).unwrap_or_default();
        let id = u8::try_from(id).ok();
        // The register accepts no reserved id.
        if let Some(Ok(address)) = id.map(|id| Address::new(self.config.class, id)) {
            self.address = address;
        }
        self.parser.reset();
        self.reply = None;
        self.waiting = None;
        self.answer = None;
        self.events.clear();
    }

    fn execute(&mut self, request_end: SimTime, at: SimTime, request: &Request) {
        self.counters.requests += 1;
        let outcome = self.handle_instruction(at, request);
        if request.to.is_broadcast() {
            return;
        }
        let (error, payload) = match outcome {
            Ok(payload) => (ErrorCode::OK, payload),
            Err(error) => (error, Payload::default()),
        };
        let low_latency = request.instruction == Instruction::LOW_LATENCY;
        let reaction = if low_latency && self.config.policy == AnswerPolicy::AtOnce {
            self.config.low_latency_reaction
        } else {
            self.config.standard_reaction
        };
        let answer = Answer {
            request_end: low_latency.then_some(request_end),
            start: at + reaction,
            from: self.address,
            error,
            payload,
        };
        if self.answer.replace(answer).is_some() {
            self.counters.superseded += 1;
        }
    }

    fn handle_instruction(&mut self, at: SimTime, request: &Request) -> Result<Payload, ErrorCode> {
        if request.instruction == Instruction::LOW_LATENCY {
            let payload = request.payload;
            let required = self.config.low_latency_request;
            if required.is_some_and(|len| len != payload.len()) {
                return Err(ErrorCode::BAD_LENGTH);
            }
            self.push_event(SlaveEvent::LowLatency { at, payload });
            return self.reply.ok_or(ErrorCode::NOT_READY);
        }
        let (payload, change) = execute_standard(&mut self.registers, request)?;
        match change {
            Change::Unchanged => {}
            Change::Written { address, value } => {
                self.push_event(SlaveEvent::Written { at, address, value });
            }
            Change::Saved => self.push_event(SlaveEvent::Saved { at }),
        }
        Ok(payload)
    }

    fn push_event(&mut self, event: SlaveEvent) {
        if self.events.len() == EVENTS_MAX {
            self.events.pop_front();
            self.counters.events_lost += 1;
        }
        self.events.push_back(event);
    }
}
