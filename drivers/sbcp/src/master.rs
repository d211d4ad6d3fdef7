use std::ops::Range;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::HostTime;

use crate::codes::{ErrorCode, FRAME_MAX};
use crate::error::SbcpError;
use crate::late_answers::LateAnswers;
use crate::master_config::{Failure, MasterConfig, MasterCounters, Outcome, Topology};
use crate::packet::{Payload, Request, Response};
use crate::parser::Parser;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    Probe,
    Lazy,
    Cycle,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum State {
    Idle,
    /// A transfer has begun; it waits until nobody talks unasked, at most until then.
    Draining(HostTime),
    /// The next requests wait until no older answer of their boards can come.
    Holding(HostTime),
    /// Requests are to be written.
    Writing,
    /// Answers are awaited until then.
    Waiting(HostTime),
}

/// The host's side of the protocol, without a port or a clock of its own.
///
/// A transfer is begun with one request ([`Master::transfer`], the *lazy* workflow) or with a frame of them
/// ([`Master::cycle`], the *scheduled* one). After that, and whenever bytes have come
/// ([`Master::handle_bytes`]) or the time has that [`Master::poll_timeout`] gives
/// ([`Master::handle_timeout`]), whoever holds it writes what [`Master::poll_transmit`] gives. When
/// [`Master::is_busy`] no longer holds, [`Master::outcomes`] has one outcome for each request.
///
/// **Which answer is whose.** Answers carry no number, only class and id of their source, and they come in
/// the order of the requests. So an answer is that of the first open request to that address, and closes
/// the requests before it, whose answers are lost. What matches no open request is a stray.
///
/// **Late answers.** An answer to a request that was given up must not be taken for that to a later one. It could be
/// for one to the same board only, so that board is not asked again until [`MasterConfig::cycle_timeout`] (or
/// [`MasterConfig::lazy_timeout`]) and [`MasterConfig::grace`] have passed since the request that was given up was
/// written ([`crate::GRACE`] says why this is enough); others are asked meanwhile.
///
/// **Who talks unasked.** After a stray, or a byte that no request is open for, the next transfer waits until nobody has
/// talked unasked for [`MasterConfig::quiet`], but not longer than [`MasterConfig::drain_timeout`]: a talker who never
/// ends costs errors, not the bus.
///
/// **Damaged answers.** Directly on the bus, what is an answer of the board that was asked but for its checksum ends
/// the wait: that board says nothing more. A bus controller sends an error packet behind it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Master {
    config: MasterConfig,
    state: State,
    kind: Kind,
    requests: [Option<Request>; FRAME_MAX],
    outcomes: Vec<Outcome>,
    count: usize,
    /// The first of the requests that is neither answered nor given up.
    open: usize,
    parser: Parser,
    /// When somebody talked unasked, the last time since the last transfer began.
    noise: Option<HostTime>,
    /// When the open requests were written.
    written: HostTime,
    late: LateAnswers,
    now: HostTime,
    counters: MasterCounters,
}

fn later(now: HostTime, by: Duration) -> HostTime {
    let by = u64::try_from(by.as_nanos()).unwrap_or(u64::MAX);
    HostTime::from_nanos(now.as_nanos().saturating_add(by))
}

impl Master {
    /// A master that has written nothing yet.
    pub fn new(config: MasterConfig) -> Self {
        Self {
            config,
            state: State::Idle,
            kind: Kind::Lazy,
            requests: [None; FRAME_MAX],
            outcomes: Vec::with_capacity(FRAME_MAX),
            count: 0,
            open: 0,
            parser: Parser::default(),
            noise: None,
            written: HostTime::default(),
            late: LateAnswers::default(),
            now: HostTime::default(),
            counters: MasterCounters::default(),
        }
    }

    /// How it behaves.
    pub fn config(&self) -> MasterConfig {
        self.config
    }

    /// What was counted so far.
    pub fn counters(&self) -> MasterCounters {
        MasterCounters {
            garbage: self.counters.garbage + self.parser.skipped(),
            ..self.counters
        }
    }

    /// Whether as many errors were counted as are too many.
    pub fn is_out_of_errors(&self) -> bool {
        let threshold = u64::try_from(self.config.error_threshold);
        threshold.is_ok_and(|threshold| self.counters.errors >= threshold.max(1))
    }

    /// Begins to transfer one request at `now`.
    ///
    /// # Errors
    /// [`SbcpError::Busy`] if a transfer goes on.
    pub fn transfer(&mut self, now: HostTime, request: &Request) -> Result<(), SbcpError> {
        self.begin(now, Kind::Lazy, std::slice::from_ref(request))
    }

    /// The same, for a board that may be missing: is not counted as an error then.
    ///
    /// # Errors
    /// [`SbcpError::Busy`] if a transfer goes on.
    pub fn probe(&mut self, now: HostTime, request: &Request) -> Result<(), SbcpError> {
        self.begin(now, Kind::Probe, std::slice::from_ref(request))
    }

    /// Begins a cycle at `now`: a frame of requests to different boards.
    ///
    /// # Errors
    /// [`SbcpError::Busy`] if a transfer goes on, [`SbcpError::Frame`] if there are none or too many.
    pub fn cycle(&mut self, now: HostTime, frame: &[Request]) -> Result<(), SbcpError> {
        self.begin(now, Kind::Cycle, frame)
    }

    /// Takes bytes that were read at `now`: any bytes at all, in pieces of any length.
    pub fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.now = now;
        let mut rest = bytes;
        while let State::Waiting(_) = self.state {
            let Some(packet) = self.parser.next(&mut rest) else {
                self.take_damaged();
                return;
            };
            let response = Response::parse(&packet);
            self.take(response.ok());
        }
        if !rest.is_empty() {
            // Nobody has asked for these.
            self.counters.garbage += rest.len() as u64;
            self.noise = Some(now);
        }
    }

    /// It is `now`, which is when [`Master::poll_timeout`] wanted to be told, or later.
    pub fn handle_timeout(&mut self, now: HostTime) {
        if self.poll_timeout().is_none_or(|due| now < due) {
            return;
        }
        self.now = now;
        match self.state {
            State::Draining(limit) => {
                let quiet = self.quiet_from().is_none_or(|from| from <= now);
                self.counters.drain_timeouts += u64::from(!quiet && limit <= now);
                self.settle();
                return;
            }
            State::Holding(_) => {
                self.request();
                return;
            }
            State::Idle | State::Writing | State::Waiting(_) => {}
        }
        // What began like a packet may have hidden one behind it.
        while let State::Waiting(_) = self.state {
            let Some(packet) = self.parser.give_up() else {
                break;
            };
            let response = Response::parse(&packet);
            self.take(response.ok());
        }
        if let State::Waiting(_) = self.state {
            self.give_up();
            self.open = self.asked().end;
            self.go_on();
        }
    }

    /// When it wants to go on even if no byte comes.
    pub fn poll_timeout(&self) -> Option<HostTime> {
        match self.state {
            State::Idle | State::Writing => None,
            State::Draining(limit) => Some(self.quiet_from().map_or(limit, |from| from.min(limit))),
            State::Holding(until) | State::Waiting(until) => Some(until),
        }
    }

    /// Appends what is to be written next, in one piece, to `bytes`; says whether there was anything.
    pub fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        if self.state != State::Writing {
            return false;
        }
        // What came before cannot be an answer to these.
        self.parser.reset();
        let packets = self.asked();
        self.counters.requests += packets.len() as u64;
        for request in self.requests[packets].iter().flatten() {
            request.emit(bytes);
        }
        self.written = self.now;
        self.state = State::Waiting(later(self.now, self.timeout()));
        self.pass_broadcasts();
        true
    }

    /// Whether a transfer goes on.
    pub fn is_busy(&self) -> bool {
        self.state != State::Idle
    }

    /// Gives up what goes on at `now`: its open requests fail, uncounted. Their answers may still come; their boards are
    /// not asked until they cannot any more.
    pub fn abort(&mut self, now: HostTime) {
        self.now = now;
        if let State::Waiting(_) = self.state {
            self.give_up();
        }
        self.state = State::Idle;
    }

    /// What the requests of the last transfer brought, in their order; nothing while it goes on.
    pub fn outcomes(&self) -> &[Outcome] {
        if self.is_busy() { &[] } else { &self.outcomes }
    }

    fn begin(&mut self, now: HostTime, kind: Kind, frame: &[Request]) -> Result<(), SbcpError> {
        if self.is_busy() {
            return Err(SbcpError::Busy);
        }
        let packets = frame.len();
        if packets == 0 || packets > FRAME_MAX {
            return Err(SbcpError::Frame { packets });
        }
        self.now = now;
        self.kind = kind;
        for (slot, request) in self.requests.iter_mut().zip(frame) {
            *slot = Some(*request);
        }
        self.count = packets;
        self.open = 0;
        self.outcomes.clear();
        self.outcomes.resize(packets, Err(Failure::NoAnswer));
        if self.quiet_from().is_some_and(|from| now < from) {
            self.state = State::Draining(later(now, self.config.drain_timeout));
        } else {
            self.settle();
        }
        Ok(())
    }

    /// From when on nobody has talked unasked for long enough, if somebody did.
    fn quiet_from(&self) -> Option<HostTime> {
        self.noise.map(|last| later(last, self.config.quiet))
    }

    /// The line is quiet, or never will be.
    fn settle(&mut self) {
        self.noise = None;
        self.request();
    }

    /// The requests that are open, or to be written next.
    fn asked(&self) -> Range<usize> {
        match self.config.topology {
            Topology::Direct => self.open..self.count.min(self.open + 1),
            Topology::Controller => self.open..self.count,
        }
    }

    /// The next requests are to be written, as soon as no older answer of their boards can come.
    fn request(&mut self) {
        let requests = self.requests[self.asked()].iter().flatten();
        let free = requests
            .filter_map(|request| self.late.until(request.to))
            .max();
        self.state = match free.filter(|until| *until > self.now) {
            Some(until) => State::Holding(until),
            None => State::Writing,
        };
    }

    fn timeout(&self) -> Duration {
        match self.kind {
            Kind::Probe | Kind::Lazy => self.config.lazy_timeout,
            Kind::Cycle => self.config.cycle_timeout,
        }
    }

    /// The open requests are given up; their answers may still come.
    fn give_up(&mut self) {
        let until = later(self.written, self.timeout() + self.config.grace);
        for index in self.asked() {
            if let Some(request) = self.requests[index] {
                self.late.add(self.now, request.to, until);
            }
        }
    }

    /// All bytes so far were looked at, and no answer was among them. Perhaps it was, but damaged.
    fn take_damaged(&mut self) {
        let open = self.requests[self.asked()].first().copied().flatten();
        let of_open =
            |(class, id)| open.is_some_and(|open| (open.to.class(), open.to.id()) == (class, id));
        let over = self.config.topology == Topology::Direct && !self.parser.is_amid();
        if over && self.parser.damaged().is_some_and(of_open) {
            self.counters.damaged += 1;
            self.open += 1;
            self.go_on();
        }
    }

    /// A packet has come while answers are awaited; None if it is no response.
    fn take(&mut self, response: Option<Response>) {
        let open = self.asked();
        let asked = |response: &Response, index: usize| {
            self.requests[index].is_some_and(|request| request.to == response.from())
        };
        let found = response.and_then(|response| {
            let index = open.clone().find(|index| asked(&response, *index));
            index.map(|index| (index, response))
        });
        let Some((index, response)) = found else {
            self.counters.strays += 1;
            self.noise = Some(self.now);
            return;
        };
        self.outcomes[index] = match response.error {
            ErrorCode::OK => Ok(response.payload),
            error => Err(Failure::Refused(error)),
        };
        self.open = index + 1;
        self.go_on();
    }

    /// A request is answered or given up.
    fn go_on(&mut self) {
        if self.open < self.count && self.config.topology == Topology::Direct {
            self.request();
        } else {
            self.pass_broadcasts();
        }
    }

    /// Nobody answers a broadcast, so it is done when it is written.
    fn pass_broadcasts(&mut self) {
        let end = self.asked().end;
        let before = self.open;
        while self.open < end
            && self.requests[self.open].is_some_and(|request| request.to.is_broadcast())
        {
            self.outcomes[self.open] = Ok(Payload::default());
            self.open += 1;
        }
        if self.open == self.count {
            self.finish();
        } else if self.config.topology == Topology::Direct && self.open > before {
            self.request();
        }
    }

    fn finish(&mut self) {
        self.state = State::Idle;
        // Behind the answers there may be more, which belongs to nothing.
        if self.parser.is_amid() {
            self.noise = Some(self.now);
        }
        let answers = self.outcomes.iter().filter(|outcome| outcome.is_ok());
        let answers = answers.count() as u64;
        self.counters.answers += answers;
        match self.kind {
            Kind::Cycle => self.counters.cycles += 1,
            Kind::Lazy | Kind::Probe => self.counters.transfers += 1,
        }
        if self.kind != Kind::Probe {
            self.counters.errors += self.outcomes.len() as u64 - answers;
        }
    }
}
