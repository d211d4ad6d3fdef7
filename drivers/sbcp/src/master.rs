use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::HostTime;

use crate::codes::{ErrorCode, FRAME_MAX};
use crate::error::SbcpError;
use crate::packet::{Payload, Request, Response};
use crate::parser::Parser;

/// What stands between the master and the boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Topology {
    /// Nothing: one packet goes out when the answer to the last one is in.
    Direct,
    /// A bus controller: a frame goes out in one piece.
    Controller,
}

/// How a master behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MasterConfig {
    /// What stands between it and the boards.
    pub topology: Topology,
    /// From writing a single request to giving its answer up: 20 ms.
    pub lazy_timeout: Duration,
    /// The same for a packet (direct: 1 ms, of which a good answer over USB takes 0.625 ms) or a frame
    /// (through the bus controller: 2 ms) of a cycle.
    pub cycle_timeout: Duration,
    /// After something was given up or came unasked, nothing is written until no byte has come for that
    /// long: 1 ms. What comes later than time-out and this together is beyond telling.
    pub quiet: Duration,
    /// Errors at which [`Master::is_out_of_errors`] holds; negative: never. 1, as in the original software.
    pub error_threshold: i64,
}

impl MasterConfig {
    /// The defaults for that topology.
    pub const fn new(topology: Topology) -> Self {
        Self {
            topology,
            lazy_timeout: Duration::from_millis(20),
            cycle_timeout: match topology {
                Topology::Direct => Duration::from_millis(1),
                Topology::Controller => Duration::from_millis(2),
            },
            quiet: Duration::from_millis(1),
            error_threshold: 1,
        }
    }
}

/// Why a request brought nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Failure {
    /// No answer came in time, or only a damaged one.
    #[error("no answer")]
    NoAnswer,
    /// The board, or the bus controller in its place, answered with an error.
    #[error("{0}")]
    Refused(ErrorCode),
}

/// What a request brought.
pub type Outcome = Result<Payload, Failure>;

/// What a master has counted since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MasterCounters {
    /// Single transfers finished.
    pub transfers: u64,
    /// Cycles finished.
    pub cycles: u64,
    /// Requests written.
    pub requests: u64,
    /// Good answers.
    pub answers: u64,
    /// Requests without a good answer; those of [`Master::probe`] do not count.
    pub errors: u64,
    /// Packets that nobody asked for, or that came too late.
    pub strays: u64,
    /// Bytes that belonged to no packet, or to one that came between transfers \[B\].
    pub garbage: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    Probe,
    Lazy,
    Cycle,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum State {
    Idle,
    /// A transfer has begun; it waits for the line to be quiet.
    Draining,
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
/// the requests before it, whose answers are lost. What matches no open request is a stray. An answer
/// from an earlier transfer must not be taken for one of this: when a request was given up, or a stray or a byte
/// came unasked, the next transfer first waits until the line has been quiet for [`MasterConfig::quiet`].
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
    /// Something may still come that belongs to nothing.
    unsettled: bool,
    /// When a byte came last, or was given up.
    last: HostTime,
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
            unsettled: false,
            last: HostTime::default(),
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
        self.last = now;
        let mut rest = bytes;
        while let State::Waiting(_) = self.state {
            let Some(packet) = self.parser.next(&mut rest) else {
                return;
            };
            let response = Response::parse(&packet);
            self.take(response.ok());
        }
        // Nobody has asked for these.
        self.counters.garbage += rest.len() as u64;
        self.unsettled |= !rest.is_empty();
    }

    /// It is `now`, which is when [`Master::poll_timeout`] wanted to be told, or later.
    pub fn handle_timeout(&mut self, now: HostTime) {
        if self.poll_timeout().is_none_or(|due| now < due) {
            return;
        }
        self.now = now;
        if self.state == State::Draining {
            self.settle();
            return;
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
            self.unsettled = true;
            self.last = now;
            self.open = match self.config.topology {
                Topology::Direct => self.open + 1,
                Topology::Controller => self.count,
            };
            self.go_on();
        }
    }

    /// When it wants to go on even if no byte comes.
    pub fn poll_timeout(&self) -> Option<HostTime> {
        match self.state {
            State::Idle | State::Writing => None,
            State::Draining => Some(later(self.last, self.config.quiet)),
            State::Waiting(until) => Some(until),
        }
    }

    /// Appends what is to be written next, in one piece, to `bytes`; says whether there was anything.
    pub fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        if self.state != State::Writing {
            return false;
        }
        let packets = match self.config.topology {
            Topology::Direct => self.open..self.open + 1,
            Topology::Controller => self.open..self.count,
        };
        self.counters.requests += packets.len() as u64;
        for request in self.requests[packets].iter().flatten() {
            request.emit(bytes);
        }
        let timeout = match self.kind {
            Kind::Probe | Kind::Lazy => self.config.lazy_timeout,
            Kind::Cycle => self.config.cycle_timeout,
        };
        self.state = State::Waiting(later(self.now, timeout));
        self.pass_broadcasts();
        true
    }

    /// Whether a transfer goes on.
    pub fn is_busy(&self) -> bool {
        self.state != State::Idle
    }

    /// Gives up what goes on at `now`: its open requests fail, uncounted. Answers may still come; the next
    /// transfer waits for them to pass.
    pub fn abort(&mut self, now: HostTime) {
        if let State::Waiting(_) = self.state {
            self.unsettled = true;
            self.last = now;
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
        if self.unsettled && now < later(self.last, self.config.quiet) {
            self.state = State::Draining;
        } else {
            self.settle();
        }
        Ok(())
    }

    /// The line is quiet: what comes from now on belongs to what is written from now on.
    fn settle(&mut self) {
        self.unsettled = false;
        self.parser.reset();
        self.state = State::Writing;
    }

    /// A packet has come while answers are awaited; None if it is no response.
    fn take(&mut self, response: Option<Response>) {
        let open = match self.config.topology {
            Topology::Direct => self.open..self.open + 1,
            Topology::Controller => self.open..self.count,
        };
        let asked = |response: &Response, index: usize| {
            self.requests[index].is_some_and(|request| request.to == response.from())
        };
        let found = response.and_then(|response| {
            let index = open.clone().find(|index| asked(&response, *index));
            index.map(|index| (index, response))
        });
        let Some((index, response)) = found else {
            self.counters.strays += 1;
            self.unsettled = true;
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
            self.state = State::Writing;
        } else {
            self.pass_broadcasts();
        }
    }

    /// Nobody answers a broadcast, so it is done when it is written.
    fn pass_broadcasts(&mut self) {
        let end = match self.config.topology {
            Topology::Direct => self.count.min(self.open + 1),
            Topology::Controller => self.count,
        };
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
            self.state = State::Writing;
        }
    }

    fn finish(&mut self) {
        self.state = State::Idle;
        // Behind the answers there may be more, which belongs to nothing.
        self.unsettled |= self.parser.is_amid();
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
