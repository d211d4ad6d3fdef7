use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;
use twinrig_wire::{Arrivals, Piece, earlier};

use crate::answer::{Answer, Hearing};
use crate::codes::{CLASS_CONTROLLER, ErrorCode, HEADER, LENGTH_BESIDE, PACKET_MAX};
use crate::controller_config::{ControllerConfig, ControllerCounters, Passing};
use crate::error::SbcpError;
use crate::intake::{Entry, Intake, split_off};
use crate::outbox::Outbox;
use crate::packet::{Address, Payload, Request, checksum, emit};
use crate::registers::RegisterTable;
use crate::standard::obey;

/// Version of the emulated controller. ASSUMED.
const DEVICE_VERSION: u16 = 0x0100;

/// What goes on on the bus.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Bus {
    Free,
    /// A request goes out while it still comes in.
    Sending,
    /// A request is out at `since`. Noise was heard since `noise`, last at `last`.
    Listening {
        to: Address,
        since: SimTime,
        noise: Option<(SimTime, SimTime)>,
    },
    Answering(Answer),
    /// The answer was given up; its talker has perhaps not finished.
    Draining {
        first: SimTime,
        last: SimTime,
    },
}

/// The bus controller without link, bus or clock: bytes and times in, bytes and times out.
///
/// It takes requests from the host, puts them on the bus one by one, and passes the answers back. For each
/// request whose first four bytes make sense, broadcasts excepted, it sends one whole packet, in order: the
/// board's answer, or an error packet in its name, which may follow what was already passed on of a bad
/// answer. Requests to itself (ping, get, set, save) it answers itself.
///
/// However the boards behave, it goes on to the next request not later than time-out, limit and gap after the
/// end of this one.
///
/// Whoever holds it tells it what comes ([`Controller::handle_link`], which may be announced, and
/// [`Controller::handle_bus`]) and when it is [`Controller::poll_timeout`] ([`Controller::handle_timeout`]);
/// after each, takes what it sends ([`Controller::poll_bus`], [`Controller::poll_link`]).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Controller {
    config: ControllerConfig,
    address: Address,
    registers: RegisterTable,
    now: SimTime,
    intake: Intake,
    bus: Bus,
    /// From when on a request may go out.
    bus_free: SimTime,
    to_bus: Outbox,
    to_link: Outbox,
    #[serde(skip)]
    scratch: Vec<u8>,
    counters: ControllerCounters,
}

impl Controller {
    /// A controller that has heard nothing yet.
    ///
    /// # Errors
    /// [`SbcpError::Timeout`] or [`SbcpError::Limit`] if no good answer would pass, [`SbcpError::Frame`] if it holds no
    /// request, [`SbcpError::ByteTime`] if bytes take no time, [`SbcpError::Address`] if nobody can have its id.
    pub fn new(config: ControllerConfig) -> Result<Self, SbcpError> {
        config.check()?;
        let byte_time = config.byte_time;
        Ok(Self {
            config,
            address: Address::new(CLASS_CONTROLLER, config.id)?,
            registers: RegisterTable::new(config.id, DEVICE_VERSION, &[])?,
            now: SimTime::ZERO,
            intake: Intake::new(config.idle_gap, byte_time, config.packets_max),
            bus: Bus::Free,
            bus_free: SimTime::ZERO,
            to_bus: Outbox::new(byte_time),
            to_link: Outbox::new(byte_time),
            scratch: Vec::with_capacity(PACKET_MAX),
            counters: ControllerCounters::default(),
        })
    }

    /// What it answers to itself.
    pub fn address(&self) -> Address {
        self.address
    }

    /// What was counted so far.
    pub fn counters(&self) -> ControllerCounters {
        ControllerCounters {
            overflows: self.intake.overflows,
            garbage: self.intake.garbage,
            ..self.counters
        }
    }

    /// Takes bytes from the host at `now`; they may be announced, from the beginning of the first one on.
    pub fn handle_link(&mut self, now: SimTime, piece: Piece<'_>) {
        self.now = self.now.max(now);
        let broken = self.intake.breaks_off();
        if let Some(at) = broken.filter(|at| *at < piece.first) {
            self.break_off(at);
        }
        let mut rest = self.received(piece);
        while !rest.bytes.is_empty() {
            let part = self.intake.take(&mut rest);
            if let Bus::Sending = self.bus {
                self.to_bus.relay(self.to_bus.end().max(self.now), part);
            }
            if self.intake.current.is_complete() {
                if let Bus::Sending = self.bus {
                    let entry = self.intake.take_current();
                    self.sent(&entry);
                } else {
                    self.intake.queue_current(None);
                }
            }
        }
        self.drive();
    }

    /// Takes bytes from the bus, complete by `now`.
    pub fn handle_bus(&mut self, now: SimTime, piece: Piece<'_>) {
        self.now = self.now.max(now);
        self.intake.admit(now, !matches!(self.bus, Bus::Free));
        let mut rest = self.received(piece);
        while !rest.bytes.is_empty() {
            if let Some((at, _)) = self.deadline().filter(|(at, _)| *at < rest.first) {
                self.give_up(at);
            }
            self.receive(&mut rest);
        }
        self.drive();
    }

    /// What its UARTs hand on of a piece: they drop bytes whose stop bit is wrong.
    fn received<'a>(&mut self, piece: Piece<'a>) -> Piece<'a> {
        if !piece.framing_error {
            return piece;
        }
        self.counters.framing_errors += piece.bytes.len() as u64;
        Piece {
            bytes: &[],
            ..piece
        }
    }

    /// It is `now`, which is when [`Controller::poll_timeout`] wanted to be told, or later; what came by then
    /// has been told.
    pub fn handle_timeout(&mut self, now: SimTime) {
        self.now = self.now.max(now);
        self.intake.admit(now, !matches!(self.bus, Bus::Free));
        while let Some((at, _)) = self.deadline().filter(|(at, _)| *at <= now) {
            self.give_up(at);
        }
        if let Some(at) = self.intake.breaks_off().filter(|at| *at <= now) {
            self.break_off(at);
        }
        self.drive();
    }

    /// When it wants to go on even if no byte comes.
    pub fn poll_timeout(&self) -> Option<SimTime> {
        let deadline = self.deadline().map(|(at, _)| at);
        earlier(deadline, self.intake.breaks_off())
    }

    /// When it begins to send on the bus next.
    pub fn bus_start(&self) -> Option<SimTime> {
        self.to_bus.next_start()
    }

    /// What it sends on the bus, if the first bit is out by `now`: all that follows without a break.
    pub fn poll_bus(&mut self, now: SimTime, send: &mut dyn FnMut(Piece<'_>)) -> bool {
        self.to_bus.take_started(now, send)
    }

    /// When the byte is complete with which it learns more about the answer that it is hearing, if that goes on without
    /// a break; None if it has broken off. At `now` it has heard everything so far.
    pub fn expects(&self, now: SimTime) -> Option<SimTime> {
        match &self.bus {
            Bus::Answering(answer) => {
                Some(answer.expects(self.config.byte_time)).filter(|at| *at > now)
            }
            _ => None,
        }
    }

    /// What it sends to the host and was not yet taken, as soon as that is sure: bytes are announced before they are
    /// complete.
    pub fn poll_link(&mut self, arrivals: &mut Arrivals) {
        self.to_link.take_all(arrivals);
    }

    /// Begins the next request, if there is one and the bus is free.
    fn drive(&mut self) {
        while let Bus::Free = self.bus {
            self.intake.admit(self.now, false);
            let Some(entry) = self.intake.front() else {
                self.begin_current();
                return;
            };
            let entry = entry.clone();
            self.intake.pop();
            self.begin(&entry);
        }
    }

    /// Begins with a request that has come in completely.
    fn begin(&mut self, entry: &Entry) {
        let Some(to) = entry.to() else {
            return;
        };
        let here = self.now.max(entry.last);
        if let Some(code) = entry.refused {
            self.refuse(to, code, here);
            return;
        }
        let own = to.class() == CLASS_CONTROLLER && to.is_for(self.address);
        let ready = match self.config.passing {
            Passing::CutThrough => entry.known,
            Passing::StoreAndForward => entry.last,
        };
        let start = self.bus_free.max(self.now).max(ready).max(entry.unbroken);
        if entry.packet().is_none() && (own || entry.last <= start) {
            self.refuse(to, ErrorCode::CHECKSUM, here);
        } else if own {
            self.answer(entry, here);
        } else {
            self.to_bus.send(start, entry.bytes());
            self.sent(entry);
        }
    }

    /// Begins with a request that is still coming in.
    fn begin_current(&mut self) {
        let current = &self.intake.current;
        let Some(to) = current.to() else {
            return;
        };
        let own = to.class() == CLASS_CONTROLLER && to.is_for(self.address);
        if own || self.config.passing == Passing::StoreAndForward {
            return;
        }
        let start = self.bus_free.max(self.now);
        let start = start.max(current.known).max(current.unbroken);
        self.to_bus.send(start, current.bytes());
        self.bus = Bus::Sending;
    }

    /// A request is on its way completely.
    fn sent(&mut self, entry: &Entry) {
        self.counters.requests += 1;
        let end = self.to_bus.end();
        self.bus_free = end + self.config.gap;
        self.bus = Bus::Free;
        match entry.to() {
            Some(to) if entry.packet().is_none() => self.refuse(to, ErrorCode::CHECKSUM, end),
            Some(to) if !to.is_broadcast() => {
                self.bus = Bus::Listening {
                    to,
                    since: end,
                    noise: None,
                };
            }
            _ => {}
        }
    }

    /// A request that is for the controller itself.
    fn answer(&mut self, entry: &Entry, at: SimTime) {
        let Some(request) = entry
            .packet()
            .and_then(|packet| Request::parse(&packet).ok())
        else {
            return;
        };
        let (error, payload) = match obey(&mut self.registers, &request) {
            Ok((payload, _)) => (ErrorCode::OK, payload),
            Err(error) => (error, Payload::default()),
        };
        if !request.to.is_broadcast() {
            self.scratch.clear();
            emit(self.address, error.0, &payload, &mut self.scratch);
            self.to_link.send(at, &self.scratch);
        }
    }

    /// Sends an error packet in the name of `from`.
    fn refuse(&mut self, from: Address, code: ErrorCode, at: SimTime) {
        if from.is_broadcast() {
            return;
        }
        self.counters.failures += 1;
        let body = [from.class(), from.id(), LENGTH_BESIDE, code.0];
        let [class, id, length, error] = body;
        let packet = [HEADER, class, id, length, error, checksum(&body)];
        self.to_link.send(at, &packet);
    }

    /// What came from the host stopped amid a packet.
    fn break_off(&mut self, at: SimTime) {
        let current = &self.intake.current;
        let Some(to) = current.to() else {
            self.intake.garbage += current.bytes().len() as u64;
            self.intake.take_current();
            return;
        };
        if let Bus::Sending = self.bus {
            self.intake.take_current();
            self.refuse(to, ErrorCode::TRUNCATED, at.max(self.to_bus.end()));
            // The boards want silence before they listen again.
            self.bus_free = at.max(self.to_bus.end()) + self.config.timeout;
            self.bus = Bus::Free;
        } else {
            self.intake.queue_current(Some(ErrorCode::TRUNCATED));
        }
    }

    /// When what goes on on the bus is given up, and why.
    fn deadline(&self) -> Option<(SimTime, ErrorCode)> {
        let ControllerConfig {
            timeout,
            response_limit,
            byte_time,
            ..
        } = self.config;
        match &self.bus {
            Bus::Free | Bus::Sending => None,
            Bus::Listening { since, .. } => Some((*since + timeout, ErrorCode::TIMEOUT)),
            Bus::Answering(answer) => Some(answer.deadline(timeout, response_limit, byte_time)),
            Bus::Draining { first, last } => {
                let end = (*last + timeout).min(*first + response_limit);
                Some((end, ErrorCode::STRANGE))
            }
        }
    }

    /// The deadline has passed.
    fn give_up(&mut self, at: SimTime) {
        let Some((_, code)) = self.deadline() else {
            return;
        };
        match std::mem::replace(&mut self.bus, Bus::Free) {
            Bus::Listening {
                to,
                noise: Some((first, last)),
                ..
            } => {
                self.refuse(to, ErrorCode::STRANGE, at);
                self.bus = Bus::Draining { first, last };
                return;
            }
            Bus::Listening { to, .. } => {
                self.counters.timeouts += 1;
                self.refuse(to, code, at);
            }
            Bus::Answering(answer) => self.refuse(answer.from(), code, at),
            Bus::Free | Bus::Sending | Bus::Draining { .. } => {}
        }
        self.bus_free = at + self.config.gap;
    }

    /// Hears the beginning of `rest`.
    fn receive(&mut self, rest: &mut Piece<'_>) {
        match &mut self.bus {
            Bus::Free | Bus::Sending => {
                split_off(rest, rest.bytes.len());
            }
            Bus::Draining { last, .. } => *last = split_off(rest, rest.bytes.len()).last(),
            Bus::Listening { to, since, noise } => {
                // What was complete when the request was not yet over cannot be its answer.
                while !rest.bytes.is_empty() && rest.first <= *since {
                    split_off(rest, 1);
                }
                let header = rest.bytes.iter().position(|byte| *byte == HEADER);
                let count = header.unwrap_or(rest.bytes.len());
                let heard = split_off(rest, count);
                if count > 0 {
                    let first = noise.map_or(heard.first, |(first, _)| first);
                    *noise = Some((first, heard.last()));
                }
                if header.is_some() {
                    self.bus = Bus::Answering(Answer::new(*to, rest.first));
                }
            }
            Bus::Answering(_) => self.hear_answer(rest),
        }
    }

    fn hear_answer(&mut self, rest: &mut Piece<'_>) {
        let Bus::Answering(answer) = &mut self.bus else {
            return;
        };
        let (part, hearing) = answer.receive(rest);
        let (from, at) = (answer.from(), part.last());
        if self.config.passing == Passing::CutThrough {
            if hearing != Hearing::Strange {
                self.to_link.relay(part.first, part);
            }
        } else if hearing == Hearing::Good {
            self.to_link.send(at, answer.bytes());
        }
        match hearing {
            Hearing::GoesOn => return,
            Hearing::Strange => {
                let first = answer.first();
                self.refuse(from, ErrorCode::STRANGE, at);
                self.bus = Bus::Draining { first, last: at };
                return;
            }
            Hearing::Good => self.counters.answers += 1,
            Hearing::Damaged => self.refuse(from, ErrorCode::CHECKSUM, at),
        }
        self.bus = Bus::Free;
        self.bus_free = at + self.config.gap;
    }
}
