use std::ops::Range;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::HostTime;
use twinrig_wire::{TrafficError, TrafficLog};

use crate::attribution::Attribution;
use crate::codes::FRAME_MAX;
use crate::error::SbcpError;
use crate::late_answers::LateAnswers;
use crate::master_config::{MasterConfig, MasterCounters, Outcome, RequestError, Topology};
use crate::packet::{Payload, Request, Response};
use crate::parser::Parser;

mod answers;
mod traffic;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    Probe,
    Lazy,
    Cycle,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum State {
    Idle,
    /// A transfer has begun and waits, at most until then, for the end of unsolicited bytes.
    Draining(HostTime),
    /// The next requests wait until then, when late answers of their boards are excluded.
    Holding(HostTime),
    /// The next requests are to be written.
    Writing,
    /// Answers are expected until then.
    Waiting(HostTime),
}

/// Host side of the protocol, without port or clock.
///
/// A transfer begins with one request ([`Master::transfer`], the *lazy* workflow) or with a frame
/// of them ([`Master::cycle`], the *scheduled* one). After that, and whenever bytes were received
/// ([`Master::handle_bytes`]) or the time of [`Master::poll_timeout`] has come
/// ([`Master::handle_timeout`]), the owner writes the bytes of [`Master::poll_transmit`]. When
/// [`Master::is_busy`] is false again, [`Master::outcomes`] has one outcome per request.
///
/// **Which answer is whose.** Answers carry no number, only class and id of their source, and they
/// arrive in the order of the requests. So an answer is that of the first open request to that
/// address, and closes the requests before it, whose answers are lost. A packet that matches no
/// open request is a stray.
///
/// **Late answers.** An answer to an abandoned request must not be taken for that to a later one.
/// Only a later request to the same board is affected, so that board gets no request until
/// [`MasterConfig::cycle_timeout`] (or [`MasterConfig::lazy_timeout`]) and [`MasterConfig::grace`]
/// have passed since the abandoned request was written (for the reason see [`crate::GRACE`]);
/// others are served meanwhile. An answer that no open request asked for is attributed to the
/// oldest unanswered request to its board of the last 10 ms, and counted as late, by device and
/// with its delay behind the time-out ([`Master::traffic`]). If answers were accepted for later
/// requests meanwhile, they belonged to earlier ones, and are counted as stale. From then on an
/// answer of a board that owes one is doubtful ([`Master::is_doubtful`]): it completes the request,
/// but its content is not to be used.
///
/// **Unsolicited bytes.** After a stray, or a byte while no request is open, the next transfer
/// waits until there has been no unsolicited byte for [`MasterConfig::quiet`], but not longer than
/// [`MasterConfig::drain_timeout`]: a station that never stops causes errors but does not block the
/// bus.
///
/// **Damaged answers.** Directly on the bus, an answer of the requested board with a wrong checksum
/// ends the wait: the board transmits nothing more. A bus controller sends an error packet behind
/// it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Master {
    config: MasterConfig,
    state: State,
    kind: Kind,
    requests: [Option<Request>; FRAME_MAX],
    outcomes: Vec<Outcome>,
    count: usize,
    /// Index of the first request that is neither answered nor abandoned.
    open: usize,
    parser: Parser,
    /// Time of the last unsolicited byte or packet since the last transfer began.
    unsolicited: Option<HostTime>,
    /// Time at which the open requests were written.
    written: HostTime,
    late: LateAnswers,
    now: HostTime,
    counters: MasterCounters,
    traffic: TrafficLog,
    attribution: Attribution,
    /// Answers that may belong to earlier requests.
    doubtful: [bool; FRAME_MAX],
    /// Errors that do not count towards the threshold.
    startup_errors: u64,
    /// Finds late answers in unsolicited bytes.
    unsolicited_parser: Parser,
}

impl Master {
    /// A master without a transfer.
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
            unsolicited: None,
            written: HostTime::default(),
            late: LateAnswers::default(),
            now: HostTime::default(),
            counters: MasterCounters::default(),
            traffic: TrafficLog::default(),
            attribution: Attribution::default(),
            doubtful: [false; FRAME_MAX],
            startup_errors: 0,
            unsolicited_parser: Parser::default(),
        }
    }

    /// Returns the configuration.
    pub fn config(&self) -> MasterConfig {
        self.config
    }

    /// Returns the counters.
    pub fn counters(&self) -> MasterCounters {
        MasterCounters {
            garbage: self.counters.garbage + self.parser.skipped(),
            ..self.counters
        }
    }

    /// Whether the number of errors since [`Master::end_startup`] has reached
    /// [`MasterConfig::error_threshold`].
    pub fn error_threshold_reached(&self) -> bool {
        let threshold = u64::try_from(self.config.error_threshold);
        let errors = self.counters.errors - self.startup_errors;
        threshold.is_ok_and(|threshold| errors >= threshold.max(1))
    }

    /// Begins the transfer of one request at `now`.
    ///
    /// # Errors
    /// [`SbcpError::Busy`] if a transfer is in progress.
    pub fn transfer(&mut self, now: HostTime, request: &Request) -> Result<(), SbcpError> {
        self.begin(now, Kind::Lazy, std::slice::from_ref(request))
    }

    /// The same for a board that may be absent: a missing answer is not counted as an error.
    ///
    /// # Errors
    /// [`SbcpError::Busy`] if a transfer is in progress.
    pub fn probe(&mut self, now: HostTime, request: &Request) -> Result<(), SbcpError> {
        self.begin(now, Kind::Probe, std::slice::from_ref(request))
    }

    /// Begins a cycle at `now`: a frame of requests to different boards.
    ///
    /// # Errors
    /// [`SbcpError::Busy`] if a transfer is in progress, [`SbcpError::Frame`] if there are no or
    /// too many requests.
    pub fn cycle(&mut self, now: HostTime, frame: &[Request]) -> Result<(), SbcpError> {
        self.begin(now, Kind::Cycle, frame)
    }

    /// Handles bytes read at `now`: arbitrary bytes, in pieces of any length.
    pub fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.now = now;
        let skipped = self.parser.skipped();
        let mut rest = bytes;
        while let State::Waiting(_) = self.state {
            let Some(packet) = self.parser.next(&mut rest) else {
                self.handle_damaged();
                self.record_garbled(skipped, now);
                return;
            };
            let response = Response::parse(&packet);
            self.handle_response(response.ok());
        }
        if !rest.is_empty() {
            // Unsolicited bytes.
            self.counters.garbage += rest.len() as u64;
            self.unsolicited = Some(now);
            self.inspect_unsolicited(rest);
        }
    }

    /// Handles the time-out of [`Master::poll_timeout`] at `now`, then or later.
    pub fn handle_timeout(&mut self, now: HostTime) {
        if self.poll_timeout().is_none_or(|due| now < due) {
            return;
        }
        self.now = now;
        match self.state {
            State::Draining(limit) => {
                let quiet = self.quiet_from().is_none_or(|from| from <= now);
                self.counters.drain_timeouts += u64::from(!quiet && limit <= now);
                self.start_requests();
                return;
            }
            State::Holding(_) => {
                self.schedule_requests();
                return;
            }
            State::Idle | State::Writing | State::Waiting(_) => {}
        }
        // A false header may hide a packet behind it.
        let skipped = self.parser.skipped();
        while let State::Waiting(_) = self.state {
            let Some(packet) = self.parser.give_up() else {
                break;
            };
            let response = Response::parse(&packet);
            self.handle_response(response.ok());
        }
        self.record_garbled(skipped, now);
        if let State::Waiting(_) = self.state {
            self.abandon();
            for index in self.outstanding() {
                self.record_error(index, TrafficError::NoAnswer);
            }
            self.open = self.outstanding().end;
            self.proceed();
        }
    }

    /// Returns the time of the next required call of [`Master::handle_timeout`].
    pub fn poll_timeout(&self) -> Option<HostTime> {
        match self.state {
            State::Idle | State::Writing => None,
            State::Draining(limit) => Some(self.quiet_from().map_or(limit, |from| from.min(limit))),
            State::Holding(until) | State::Waiting(until) => Some(until),
        }
    }

    /// Appends the bytes to be written next, in one piece, to `bytes`; returns whether there are
    /// any.
    pub fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        if self.state != State::Writing {
            return false;
        }
        // Bytes received before cannot be answers to these requests.
        self.parser.reset();
        let packets = self.outstanding();
        self.counters.requests += packets.len() as u64;
        self.record_requests();
        for request in self.requests[packets].iter().flatten() {
            request.emit(bytes);
        }
        self.written = self.now;
        self.state = State::Waiting(self.now + self.timeout());
        self.complete_broadcasts();
        true
    }

    /// Whether a transfer is in progress.
    pub fn is_busy(&self) -> bool {
        self.state != State::Idle
    }

    /// Aborts the transfer at `now`: its open requests fail without being counted. Their answers
    /// may still arrive; their boards get no request until these are excluded.
    pub fn abort(&mut self, now: HostTime) {
        self.now = now;
        if let State::Waiting(_) = self.state {
            self.abandon();
        }
        self.state = State::Idle;
    }

    /// Returns the outcomes of the requests of the last transfer, in order; empty while it is in
    /// progress.
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
        self.doubtful = [false; FRAME_MAX];
        self.outcomes.clear();
        self.outcomes.resize(packets, Err(RequestError::NoAnswer));
        if self.quiet_from().is_some_and(|from| now < from) {
            self.state = State::Draining(now + self.config.drain_timeout);
        } else {
            self.start_requests();
        }
        Ok(())
    }

    /// Returns the time from which the line counts as quiet, if there were unsolicited bytes.
    fn quiet_from(&self) -> Option<HostTime> {
        self.unsolicited.map(|last| last + self.config.quiet)
    }

    /// Starts the requests when the line is quiet or the wait for it has timed out.
    fn start_requests(&mut self) {
        self.unsolicited = None;
        self.schedule_requests();
    }

    /// Returns the indices of the requests that are open or to be written next.
    fn outstanding(&self) -> Range<usize> {
        match self.config.topology {
            Topology::Direct => self.open..self.count.min(self.open + 1),
            Topology::Controller => self.open..self.count,
        }
    }

    /// Schedules the next requests: at once, or as soon as late answers of their boards are
    /// excluded.
    fn schedule_requests(&mut self) {
        let requests = self.requests[self.outstanding()].iter().flatten();
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

    /// Abandons the open requests; their answers may still arrive.
    fn abandon(&mut self) {
        let due = self.written + self.timeout();
        let until = due + self.config.grace;
        for index in self.outstanding() {
            if let Some(request) = self.requests[index] {
                self.late.add(self.now, request.to, until);
                self.attribution.abandon(request.to, self.written, due);
            }
        }
    }

    /// Continues after a request is answered or abandoned.
    fn proceed(&mut self) {
        if self.open < self.count && self.config.topology == Topology::Direct {
            self.schedule_requests();
        } else {
            self.complete_broadcasts();
        }
    }

    /// Completes broadcasts, which are not answered, as soon as they are written.
    fn complete_broadcasts(&mut self) {
        let end = self.outstanding().end;
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
            self.schedule_requests();
        }
    }

    fn finish(&mut self) {
        self.state = State::Idle;
        // Bytes behind the answers are unsolicited.
        if self.parser.is_partial() {
            self.unsolicited = Some(self.now);
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
