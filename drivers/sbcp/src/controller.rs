use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;
use twinrig_wire::{Arrivals, Piece, earlier};

use crate::answer::{Answer, AnswerProgress};
use crate::codes::{CLASS_CONTROLLER, ErrorCode, HEADER, LENGTH_OVERHEAD, PACKET_MAX};
use crate::controller_config::{ControllerConfig, ControllerCounters, ForwardingMode};
use crate::error::SbcpError;
use crate::link_receiver::{Entry, LinkReceiver, split_off};
use crate::packet::{Address, Payload, Request, checksum, emit};
use crate::registers::RegisterTable;
use crate::standard::execute_standard;
use crate::uart_transmitter::UartTransmitter;

mod packets;

/// Version of the emulated controller. ASSUMED.
const DEVICE_VERSION: u16 = 0x0100;

/// State of the bus.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Bus {
    Free,
    /// A request is relayed while it is still being received.
    Relaying,
    /// A request ended at `since`. Noise was received: the first and the last byte's times.
    Awaiting {
        to: Address,
        since: SimTime,
        noise: Option<(SimTime, SimTime)>,
    },
    Answering(Answer),
    /// The whole answer was received in advance; it ends at `last`.
    Received {
        from: Address,
        progress: AnswerProgress,
        last: SimTime,
    },
    /// The answer was abandoned; the board may still be transmitting.
    Draining {
        first: SimTime,
        last: SimTime,
    },
}

/// Bus controller, independent of link, bus and clock: bytes and times in, bytes and times out.
///
/// It receives requests from the host, puts them on the bus one by one, and relays the answers. For
/// each request whose first four bytes are valid, broadcasts excepted, it transmits one complete
/// packet, in order: the board's answer, or an error packet in the board's name, which may follow
/// relayed bytes of an invalid answer. It answers requests to itself (ping, get, set, save).
///
/// Whatever the boards transmit, the next request follows the end of this one by at most time-out,
/// limit and gap.
///
/// The owner passes in received bytes ([`Controller::handle_link`], which may be announced, and
/// [`Controller::handle_bus`]) and calls [`Controller::handle_timeout`] at
/// [`Controller::poll_timeout`]; after each call it takes the bytes to be transmitted
/// ([`Controller::poll_bus`], [`Controller::poll_link`]).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Controller {
    config: ControllerConfig,
    address: Address,
    registers: RegisterTable,
    now: SimTime,
    receiver: LinkReceiver,
    bus: Bus,
    /// Time from which the next request may be transmitted.
    bus_free: SimTime,
    to_bus: UartTransmitter,
    to_link: UartTransmitter,
    /// End of an answer that is counted, and after which a request is counted, in advance.
    ahead_until: SimTime,
    #[serde(skip)]
    scratch: Vec<u8>,
    counters: ControllerCounters,
}

impl Controller {
    /// A controller at power-on.
    ///
    /// # Errors
    /// [`SbcpError::Timeout`] or [`SbcpError::Limit`] if they exclude valid answers,
    /// [`SbcpError::Frame`] if the buffer holds no request, [`SbcpError::ByteTime`] if bytes take
    /// no time, [`SbcpError::Address`] if the id is reserved.
    pub fn new(config: ControllerConfig) -> Result<Self, SbcpError> {
        config.check()?;
        let byte_time = config.byte_time;
        Ok(Self {
            config,
            address: Address::new(CLASS_CONTROLLER, config.id)?,
            registers: RegisterTable::new(config.id, DEVICE_VERSION, &[])?,
            now: SimTime::ZERO,
            receiver: LinkReceiver::new(config.idle_gap, byte_time, config.packets_max),
            bus: Bus::Free,
            bus_free: SimTime::ZERO,
            to_bus: UartTransmitter::new(byte_time),
            to_link: UartTransmitter::new(byte_time),
            ahead_until: SimTime::ZERO,
            scratch: Vec::with_capacity(PACKET_MAX),
            counters: ControllerCounters::default(),
        })
    }

    /// Returns the controller's own address.
    pub fn address(&self) -> Address {
        self.address
    }

    /// Returns the counters at the last call.
    pub fn counters(&self) -> ControllerCounters {
        self.counters_at(self.now)
    }

    /// Returns the counters at `now`, by which all bytes and time-outs have been handled.
    pub fn counters_at(&self, now: SimTime) -> ControllerCounters {
        let busy = !matches!(self.bus, Bus::Free);
        let ahead = u64::from(now < self.ahead_until);
        ControllerCounters {
            requests: self.counters.requests - ahead,
            answers: self.counters.answers - ahead,
            overflows: self.receiver.overflows(now, busy),
            garbage: self.receiver.garbage,
            ..self.counters
        }
    }

    /// Handles bytes from the host at `now`; they may be announced, from the beginning of the first
    /// one on.
    pub fn handle_link(&mut self, now: SimTime, piece: Piece<'_>) {
        self.now = self.now.max(now);
        let interruption = self.receiver.interruption();
        if let Some(at) = interruption.filter(|at| *at < piece.first) {
            self.end_interrupted(at);
        }
        let mut rest = self.drop_framing_errors(piece);
        while !rest.bytes.is_empty() {
            let part = self.receiver.take(&mut rest);
            if let Bus::Relaying = self.bus {
                self.to_bus.relay(self.to_bus.end().max(self.now), part);
            }
            if self.receiver.current.is_complete() {
                if let Bus::Relaying = self.bus {
                    let entry = self.receiver.take_current();
                    self.request_sent(&entry);
                } else {
                    self.receiver.queue_current(None);
                }
            }
        }
        self.start_next();
    }

    /// Handles bytes from the bus, complete by `now`.
    pub fn handle_bus(&mut self, now: SimTime, piece: Piece<'_>) {
        self.now = self.now.max(now);
        self.receiver.admit(now, !matches!(self.bus, Bus::Free));
        let mut rest = self.drop_framing_errors(piece);
        while !rest.bytes.is_empty() {
            if let Some((at, _)) = self.deadline().filter(|(at, _)| *at < rest.first) {
                self.handle_deadline(at);
            }
            self.receive(&mut rest);
        }
        self.start_next();
    }

    /// Drops and counts bytes with a wrong stop bit, as the UARTs do.
    fn drop_framing_errors<'a>(&mut self, piece: Piece<'a>) -> Piece<'a> {
        if !piece.framing_error {
            return piece;
        }
        self.counters.framing_errors += piece.bytes.len() as u64;
        Piece {
            bytes: &[],
            ..piece
        }
    }

    /// Handles the time-out of [`Controller::poll_timeout`] at `now`, then or later; all bytes
    /// received by then have been passed in.
    pub fn handle_timeout(&mut self, now: SimTime) {
        self.now = self.now.max(now);
        self.receiver.admit(now, !matches!(self.bus, Bus::Free));
        while let Some((at, _)) = self.deadline().filter(|(at, _)| *at <= now) {
            let received = matches!(self.bus, Bus::Received { .. });
            self.handle_deadline(at);
            if received {
                // As after the last byte of an answer in `handle_bus`.
                self.start_next();
            }
        }
        if let Some(at) = self.receiver.interruption().filter(|at| *at <= now) {
            self.end_interrupted(at);
        }
        self.start_next();
    }

    /// Returns the time of the next required call of [`Controller::handle_timeout`].
    pub fn poll_timeout(&self) -> Option<SimTime> {
        let deadline = self.deadline().map(|(at, _)| at);
        earlier(deadline, self.receiver.interruption())
    }

    /// Returns the start of the next transmission on the bus.
    pub fn bus_start(&self) -> Option<SimTime> {
        self.to_bus.next_start()
    }

    /// Passes the next contiguous bytes for the bus to `send` if their first bit is out by `now`.
    pub fn poll_bus(&mut self, now: SimTime, send: &mut dyn FnMut(Piece<'_>)) -> bool {
        self.to_bus.take_started(now, send)
    }

    /// Passes the next contiguous bytes for the bus to `send` if they are those of complete
    /// requests: they are certain, whenever they begin.
    pub fn poll_requests(&mut self, send: &mut dyn FnMut(Piece<'_>)) -> bool {
        !matches!(self.bus, Bus::Relaying) && self.to_bus.take_started(SimTime::MAX, send)
    }

    /// Returns the completion time of the byte that decides about the answer being received, if the
    /// answer continues without a pause; None if it is interrupted. All bytes up to `now` have been
    /// passed in.
    pub fn expects(&self, now: SimTime) -> Option<SimTime> {
        match &self.bus {
            Bus::Answering(answer) => {
                Some(answer.next_decision(self.config.byte_time)).filter(|at| *at > now)
            }
            _ => None,
        }
    }

    /// Returns the start of the bytes for the host that [`Controller::poll_link`] has not taken: a
    /// refused request is answered when it is passed in.
    pub fn link_start(&self) -> Option<SimTime> {
        self.to_link.next_start()
    }

    /// Takes the bytes for the host as soon as they are certain: bytes are announced before they
    /// are complete.
    pub fn poll_link(&mut self, arrivals: &mut Arrivals) {
        self.to_link.take_all(arrivals);
    }

    /// Starts the next request, if there is one and the bus is free.
    fn start_next(&mut self) {
        while let Bus::Free = self.bus {
            self.receiver.admit(self.now, false);
            let Some(entry) = self.receiver.front() else {
                self.start_current();
                return;
            };
            let entry = entry.clone();
            self.receiver.pop();
            self.start(&entry);
        }
    }

    /// Starts a request that is completely received.
    fn start(&mut self, entry: &Entry) {
        let Some(to) = entry.to() else {
            return;
        };
        let at = self.now.max(entry.last);
        if let Some(code) = entry.error {
            self.send_error(to, code, at);
            return;
        }
        let for_self = to.class() == CLASS_CONTROLLER && to.is_for(self.address);
        let ready = match self.config.passing {
            ForwardingMode::CutThrough => entry.addressed,
            ForwardingMode::StoreAndForward => entry.last,
        };
        let start = self.bus_free.max(self.now).max(ready).max(entry.unbroken);
        if !entry.is_valid() && (for_self || entry.last <= start) {
            self.send_error(to, ErrorCode::CHECKSUM, at);
        } else if for_self {
            self.answer(entry, at);
        } else {
            self.to_bus.send_packet(start, entry.bytes());
            self.request_sent(entry);
        }
    }

    /// Starts a request that is still being received.
    fn start_current(&mut self) {
        let current = &self.receiver.current;
        let Some(to) = current.to() else {
            return;
        };
        let for_self = to.class() == CLASS_CONTROLLER && to.is_for(self.address);
        if for_self || self.config.passing == ForwardingMode::StoreAndForward {
            return;
        }
        let start = self.bus_free.max(self.now);
        let start = start.max(current.addressed).max(current.unbroken);
        self.to_bus.send_packet(start, current.bytes());
        self.bus = Bus::Relaying;
    }

    /// Updates the state after a request was transmitted completely.
    fn request_sent(&mut self, entry: &Entry) {
        self.counters.requests += 1;
        let end = self.to_bus.end();
        self.bus_free = end + self.config.gap;
        self.bus = Bus::Free;
        match entry.to() {
            Some(to) if !entry.is_valid() => self.send_error(to, ErrorCode::CHECKSUM, end),
            Some(to) if !to.is_broadcast() => {
                self.bus = Bus::Awaiting {
                    to,
                    since: end,
                    noise: None,
                };
            }
            _ => {}
        }
    }

    /// Answers a request to the controller itself.
    fn answer(&mut self, entry: &Entry, at: SimTime) {
        let Some(request) = entry
            .packet()
            .and_then(|packet| Request::parse(&packet).ok())
        else {
            return;
        };
        let (error, payload) = match execute_standard(&mut self.registers, &request) {
            Ok((payload, _)) => (ErrorCode::OK, payload),
            Err(error) => (error, Payload::default()),
        };
        if !request.to.is_broadcast() {
            self.scratch.clear();
            emit(self.address, error.0, &payload, &mut self.scratch);
            self.to_link.send(at, &self.scratch);
        }
    }

    /// Transmits an error packet to the host in the name of `from`.
    fn send_error(&mut self, from: Address, code: ErrorCode, at: SimTime) {
        if from.is_broadcast() {
            return;
        }
        self.counters.failures += 1;
        let fields = [from.class(), from.id(), LENGTH_OVERHEAD, code.0];
        let [class, id, length, error] = fields;
        let packet = [HEADER, class, id, length, error, checksum(&fields)];
        self.to_link.send(at, &packet);
    }

    /// Handles a packet from the host that is interrupted.
    fn end_interrupted(&mut self, at: SimTime) {
        let current = &self.receiver.current;
        let Some(to) = current.to() else {
            self.receiver.garbage += current.bytes().len() as u64;
            self.receiver.take_current();
            return;
        };
        if let Bus::Relaying = self.bus {
            self.receiver.take_current();
            self.send_error(to, ErrorCode::TRUNCATED, at.max(self.to_bus.end()));
            // The boards need silence to detect the start of the next packet.
            self.bus_free = at.max(self.to_bus.end()) + self.config.timeout;
            self.bus = Bus::Free;
        } else {
            self.receiver.queue_current(Some(ErrorCode::TRUNCATED));
        }
    }

    /// Returns the deadline of the current state of the bus, with the error reported after it.
    fn deadline(&self) -> Option<(SimTime, ErrorCode)> {
        let ControllerConfig {
            timeout,
            response_limit,
            byte_time,
            ..
        } = self.config;
        match &self.bus {
            Bus::Free | Bus::Relaying => None,
            Bus::Awaiting { since, .. } => Some((*since + timeout, ErrorCode::TIMEOUT)),
            Bus::Answering(answer) => Some(answer.deadline(timeout, response_limit, byte_time)),
            Bus::Received { last, .. } => Some((*last, ErrorCode::OK)),
            Bus::Draining { first, last } => {
                let end = (*last + timeout).min(*first + response_limit);
                Some((end, ErrorCode::UNEXPECTED))
            }
        }
    }

    /// Handles an expired deadline.
    fn handle_deadline(&mut self, at: SimTime) {
        let Some((_, code)) = self.deadline() else {
            return;
        };
        match std::mem::replace(&mut self.bus, Bus::Free) {
            Bus::Awaiting {
                to,
                noise: Some((first, last)),
                ..
            } => {
                self.send_error(to, ErrorCode::UNEXPECTED, at);
                self.bus = Bus::Draining { first, last };
                return;
            }
            Bus::Awaiting { to, .. } => {
                self.counters.timeouts += 1;
                self.send_error(to, code, at);
            }
            Bus::Answering(answer) => self.send_error(answer.from(), code, at),
            Bus::Received { from, progress, .. } => self.end_answer(from, progress, at),
            Bus::Free | Bus::Relaying | Bus::Draining { .. } => {}
        }
        self.bus_free = at + self.config.gap;
    }

    /// Receives the beginning of `rest` from the bus.
    fn receive(&mut self, rest: &mut Piece<'_>) {
        match &mut self.bus {
            Bus::Free | Bus::Relaying | Bus::Received { .. } => {
                split_off(rest, rest.bytes.len());
            }
            Bus::Draining { last, .. } => *last = split_off(rest, rest.bytes.len()).last(),
            Bus::Awaiting { to, since, noise } => {
                // Bytes complete before the end of the request cannot be its answer.
                while !rest.bytes.is_empty() && rest.first <= *since {
                    split_off(rest, 1);
                }
                let header = rest.bytes.iter().position(|byte| *byte == HEADER);
                let count = header.unwrap_or(rest.bytes.len());
                let garbage = split_off(rest, count);
                if count > 0 {
                    let first = noise.map_or(garbage.first, |(first, _)| first);
                    *noise = Some((first, garbage.last()));
                }
                if header.is_some() {
                    self.bus = Bus::Answering(Answer::new(*to, rest.first));
                }
            }
            Bus::Answering(_) => self.receive_answer(rest),
        }
    }

    fn receive_answer(&mut self, rest: &mut Piece<'_>) {
        let Bus::Answering(answer) = &mut self.bus else {
            return;
        };
        let (part, progress) = answer.receive(rest);
        let (from, at) = (answer.from(), part.last());
        if self.config.passing == ForwardingMode::CutThrough {
            if progress != AnswerProgress::Unexpected {
                self.to_link.relay(part.first, part);
            }
        } else if progress == AnswerProgress::Valid {
            self.to_link.send(at, answer.bytes());
        }
        match progress {
            AnswerProgress::Incomplete => {}
            AnswerProgress::Unexpected => {
                let first = answer.first();
                self.send_error(from, ErrorCode::UNEXPECTED, at);
                self.bus = Bus::Draining { first, last: at };
            }
            AnswerProgress::Valid | AnswerProgress::Damaged => {
                self.end_answer(from, progress, at);
                self.bus = Bus::Free;
                self.bus_free = at + self.config.gap;
            }
        }
    }

    /// Counts a complete answer, or reports that it is damaged.
    fn end_answer(&mut self, from: Address, progress: AnswerProgress, at: SimTime) {
        if progress == AnswerProgress::Valid {
            self.counters.answers += 1;
        } else {
            self.send_error(from, ErrorCode::CHECKSUM, at);
        }
    }
}
