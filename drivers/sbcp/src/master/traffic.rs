//! Record of errors and late answers.

use twinrig_kernel::{HostTime, SimDuration};
use twinrig_wire::{TrafficError, TrafficLog};

use super::{Kind, Master};
use crate::attribution::Late;
use crate::codes::ErrorCode;
use crate::packet::{Address, Response};

impl Master {
    /// Returns the number of a device in the [`TrafficLog`].
    pub const fn device(address: Address) -> u16 {
        u16::from_le_bytes([address.id(), address.class()])
    }

    /// Returns the record of requests, answers and errors.
    pub fn traffic(&self) -> &TrafficLog {
        &self.traffic
    }

    /// Ends the start-up of the boards: silences and errors so far stay recorded, but a silence is
    /// judged, and an error counted towards [`crate::MasterConfig::error_threshold`], from now on.
    pub fn end_startup(&mut self) {
        self.traffic.forget_silences();
        self.startup_errors = self.counters.errors;
    }

    /// Records an answer whose content no board sends.
    pub fn record_implausible(&mut self, from: Address, now: HostTime) {
        let kind = TrafficError::Implausible;
        self.traffic.error(kind, Some(Self::device(from)), 1, now);
    }

    /// Returns whether the answer to a request of the last transfer may be that to an earlier one:
    /// the board owes an answer, and answers were late before. Its content is not to be used.
    pub fn is_doubtful(&self, index: usize) -> bool {
        self.doubtful.get(index).copied().unwrap_or_default()
    }

    /// Returns whether an answer to an abandoned request may still arrive at `now`, late.
    pub fn may_answer_late(&self, now: HostTime) -> bool {
        self.attribution.is_open(now)
    }

    /// Records the packets that are written.
    pub(super) fn record_requests(&mut self) {
        for request in self.requests[self.outstanding()].iter().flatten() {
            let answered = self.kind != Kind::Probe && !request.to.is_broadcast();
            let device = answered.then(|| Self::device(request.to));
            self.traffic.request(device, self.now);
        }
    }

    /// Records that the answer to a request is missing or wrong.
    pub(super) fn record_error(&mut self, index: usize, kind: TrafficError) {
        if self.kind == Kind::Probe {
            return;
        }
        if let Some(request) = self.requests[index] {
            let device = Some(Self::device(request.to));
            self.traffic.error(kind, device, 1, self.now);
        }
    }

    /// Records an answer to an open request.
    pub(super) fn record_answer(&mut self, index: usize, response: &Response) {
        match response.error {
            ErrorCode::OK => {
                let from = response.from();
                self.traffic.answer(Self::device(from), self.now);
                let due = self.written + self.timeout();
                let (attribution, written) = (&mut self.attribution, self.written);
                self.doubtful[index] = attribution.accept(from, written, due, self.now);
            }
            ErrorCode::TIMEOUT => self.record_error(index, TrafficError::NoAnswer),
            ErrorCode::CHECKSUM => self.record_error(index, TrafficError::Checksum),
            _ => self.record_error(index, TrafficError::Refused),
        }
    }

    /// Records a packet that no open request asked for: a late answer, if a request to its source
    /// was abandoned.
    pub(super) fn record_unexpected(&mut self, response: Option<&Response>) {
        let (traffic, attribution, now) = (&mut self.traffic, &mut self.attribution, self.now);
        let from = response.map(Response::from);
        let attributed = from.is_some_and(|from| {
            let mut record = |late: Late| {
                let lateness = u64::try_from(late.lateness.as_nanos()).unwrap_or(u64::MAX);
                traffic.late(Self::device(from), SimDuration::from_nanos(lateness), now);
                if late.taken {
                    traffic.stale();
                }
            };
            attribution.attribute(from, now, &mut record)
        });
        if !attributed {
            self.traffic.error(TrafficError::Unexpected, None, 1, now);
        }
    }

    /// Records an error if the parser has skipped bytes beyond `before`.
    pub(super) fn record_garbled(&mut self, before: u64, now: HostTime) {
        let garbled = u64::from(self.parser.skipped() > before);
        let kind = TrafficError::Garbled;
        self.traffic.error(kind, None, garbled, now);
    }

    /// Looks for late answers in bytes that are not part of a transfer.
    pub(super) fn inspect_unsolicited(&mut self, bytes: &[u8]) {
        let skipped = self.unsolicited_parser.skipped();
        let mut rest = bytes;
        while let Some(packet) = self.unsolicited_parser.next(&mut rest) {
            let response = Response::parse(&packet).ok();
            self.record_unexpected(response.as_ref());
        }
        let garbled = u64::from(self.unsolicited_parser.skipped() > skipped);
        let kind = TrafficError::Garbled;
        self.traffic.error(kind, None, garbled, self.now);
    }
}
