use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{BYTE_TIME, ErrorCode, Instruction, REGISTER_ID};
use crate::error::SbcpError;
use crate::listener::Listener;
use crate::packet::{Address, Payload, Request, emit};
use crate::registers::RegisterTable;
use crate::standard::{Change, obey};

/// When a slave deals with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AnswerPolicy {
    /// When its last bit is in.
    AtOnce,
    /// When its main loop comes round next ([`Slave::main_loop`]), as the first firmware did.
    MainLoop,
}

/// How a slave behaves; the defaults are those of the final firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlaveConfig {
    /// Kind of device.
    pub class: u8,
    /// When requests are dealt with.
    pub policy: AnswerPolicy,
    /// From a low-latency request's last bit to the answer's first: 10 µs, the most that the thesis gives.
    pub low_latency_reaction: SimDuration,
    /// The same for the standard instructions, or from the main loop on: 10 µs, ASSUMED.
    pub standard_reaction: SimDuration,
    /// Silence that ends whatever was being received: 15 µs, ASSUMED.
    pub idle_gap: SimDuration,
    /// Ten bits.
    pub byte_time: SimDuration,
    /// Length that the payload of a low-latency request must have \[B\]; None if any.
    pub low_latency_request: Option<usize>,
}

impl SlaveConfig {
    /// Of a device of that class.
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

/// What a request did to a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SlaveEvent {
    /// A low-latency request was taken.
    LowLatency {
        /// When: at its last bit, or in the main loop.
        at: SimTime,
        /// What it carried.
        payload: Payload,
    },
    /// A register was set.
    Written {
        /// When.
        at: SimTime,
        /// Which.
        address: u8,
        /// To what.
        value: u16,
    },
    /// The non-volatile registers were saved.
    Saved {
        /// When.
        at: SimTime,
    },
}

/// What a slave has counted since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlaveCounters {
    /// Requests dealt with, broadcast ones included.
    pub requests: u64,
    /// Answers given.
    pub answers: u64,
    /// Answers that told of an error, among them.
    pub refused: u64,
    /// Requests with a wrong checksum.
    pub damaged: u64,
    /// Bytes that belonged to no packet \[B\].
    pub garbage: u64,
    /// Bytes that were dropped for a wrong stop bit \[B\].
    pub framing_errors: u64,
    /// Requests, or answers not yet begun, that a newer request replaced.
    pub superseded: u64,
    /// Events that nobody took in time.
    pub events_lost: u64,
    /// Shortest time from the last bit of a low-latency request to the first of its answer.
    pub response_shortest: SimDuration,
    /// Longest.
    pub response_longest: SimDuration,
}

/// Most events that wait for the board.
const EVENTS_MAX: usize = 8;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Answer {
    /// When the request was complete, if it was one of low latency.
    asked: Option<SimTime>,
    start: SimTime,
    from: Address,
    error: ErrorCode,
    payload: Payload,
}

/// The protocol of a device on the bus, without bus or clock: bytes and times in, bytes and times out.
///
/// Whoever holds it
/// 1. lets it hear everything on the bus that it did not say itself ([`Slave::receive`]), in order of time;
/// 2. calls [`Slave::main_loop`] at every round of the device's main loop;
/// 3. after either, takes the events ([`Slave::poll_event`]) and what it answers ([`Slave::poll_transmit`]);
/// 4. makes the reply to the low-latency instruction beforehand, whenever there are new data
///    ([`Slave::set_reply`]): an answer carries the reply as it was at the request's last bit.
///
/// It never answers a broadcast, a packet for others or one with a wrong checksum.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Slave {
    config: SlaveConfig,
    address: Address,
    registers: RegisterTable,
    listener: Listener,
    reply: Option<Payload>,
    /// Heard, and waiting for the main loop.
    waiting: Option<(SimTime, Request)>,
    answer: Option<Answer>,
    events: VecDeque<SlaveEvent>,
    counters: SlaveCounters,
}

impl Slave {
    /// A device whose power has just come. Its id is in its registers.
    ///
    /// # Errors
    /// [`SbcpError::Address`] if nobody can have that class.
    pub fn new(config: SlaveConfig, registers: RegisterTable) -> Result<Self, SbcpError> {
        let id = registers.get(REGISTER_ID).unwrap_or_default();
        let address = Address::new(config.class, u8::try_from(id).unwrap_or(u8::MAX))?;
        if address.is_broadcast() {
            let (class, id) = (address.class(), address.id());
            return Err(SbcpError::Address { class, id });
        }
        Ok(Self {
            listener: Listener::new(config.idle_gap, config.byte_time),
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

    /// What it answers to. An id that was set counts from the next power cycle on, if it was saved.
    pub fn address(&self) -> Address {
        self.address
    }

    /// Its registers.
    pub fn registers(&self) -> &RegisterTable {
        &self.registers
    }

    /// Its registers, to be written by the device itself.
    pub fn registers_mut(&mut self) -> &mut RegisterTable {
        &mut self.registers
    }

    /// What was counted so far.
    pub fn counters(&self) -> SlaveCounters {
        SlaveCounters {
            damaged: self.listener.damaged,
            garbage: self.listener.garbage,
            ..self.counters
        }
    }

    /// Makes the reply to the low-latency instruction.
    ///
    /// # Errors
    /// [`SbcpError::Payload`] if it is too long; the old one stays.
    pub fn set_reply(&mut self, payload: &[u8]) -> Result<(), SbcpError> {
        self.reply = Some(Payload::new(payload)?);
        Ok(())
    }

    /// Hears bytes that others put on the bus, complete by now.
    pub fn receive(&mut self, piece: Piece<'_>) {
        if piece.framing_error {
            self.counters.framing_errors += piece.bytes.len() as u64;
            self.listener.line_busy(piece);
            return;
        }
        let mut heard = self.listener.begin(piece);
        while let Some((at, request)) = self.listener.next(self.address, piece, &mut heard) {
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

    /// How many bytes it must hear from now on before it can react to them, at least: for
    /// `twinrig_wire::Node::attention`.
    pub fn attention(&self) -> usize {
        self.listener.missing()
    }

    /// The main loop comes round at `now`: with [`AnswerPolicy::MainLoop`], deals with the request that came
    /// last.
    pub fn main_loop(&mut self, now: SimTime) {
        if let Some((asked, request)) = self.waiting.take() {
            self.execute(asked, now, &request);
        }
    }

    /// What the requests did, in order. Eight of them wait at most; then the oldest is lost.
    pub fn poll_event(&mut self) -> Option<SlaveEvent> {
        self.events.pop_front()
    }

    /// Appends the answer that it gives next to `bytes`, and says when its first bit is on the bus.
    pub fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let answer = self.answer.take()?;
        emit(answer.from, answer.error.0, &answer.payload, bytes);
        self.counters.answers += 1;
        self.counters.refused += u64::from(answer.error != ErrorCode::OK);
        if let Some(asked) = answer.asked {
            self.note_response(answer.start - asked);
        }
        Some(answer.start)
    }

    fn note_response(&mut self, response: SimDuration) {
        let counters = &mut self.counters;
        if counters.response_longest.is_zero() {
            counters.response_shortest = response;
        }
        counters.response_shortest = counters.response_shortest.min(response);
        counters.response_longest = counters.response_longest.max(response);
    }

    /// Power went and came: registers that were not saved are as delivered, nothing heard is remembered.
    pub fn power_cycle(&mut self) {
        self.registers.power_cycle();
        let id = self.registers.get(REGISTER_ID).unwrap_or_default();
        let id = u8::try_from(id).ok();
        // The register takes no id that is nobody's.
        if let Some(Ok(address)) = id.map(|id| Address::new(self.config.class, id)) {
            self.address = address;
        }
        self.listener.reset();
        self.reply = None;
        self.waiting = None;
        self.answer = None;
        self.events.clear();
    }

    fn execute(&mut self, asked: SimTime, at: SimTime, request: &Request) {
        self.counters.requests += 1;
        let outcome = self.obey(at, request);
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
            asked: low_latency.then_some(asked),
            start: at + reaction,
            from: self.address,
            error,
            payload,
        };
        if self.answer.replace(answer).is_some() {
            self.counters.superseded += 1;
        }
    }

    fn obey(&mut self, at: SimTime, request: &Request) -> Result<Payload, ErrorCode> {
        if request.instruction == Instruction::LOW_LATENCY {
            let payload = request.payload;
            let wanted = self.config.low_latency_request;
            if wanted.is_some_and(|len| len != payload.len()) {
                return Err(ErrorCode::BAD_LENGTH);
            }
            self.tell(SlaveEvent::LowLatency { at, payload });
            return self.reply.ok_or(ErrorCode::NOT_READY);
        }
        let (payload, change) = obey(&mut self.registers, request)?;
        match change {
            Change::Nothing => {}
            Change::Written { address, value } => {
                self.tell(SlaveEvent::Written { at, address, value });
            }
            Change::Saved => self.tell(SlaveEvent::Saved { at }),
        }
        Ok(payload)
    }

    fn tell(&mut self, event: SlaveEvent) {
        if self.events.len() == EVENTS_MAX {
            self.events.pop_front();
            self.counters.events_lost += 1;
        }
        self.events.push_back(event);
    }
}
