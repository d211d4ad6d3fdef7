//! Answers that are received as a whole before they begin.

use twinrig_kernel::SimTime;
use twinrig_wire::Piece;

use super::{Bus, Controller};
use crate::answer::{Answer, AnswerProgress, PREFIX_LEN};
use crate::codes::CLASS_CONTROLLER;
use crate::controller_config::{ControllerConfig, ForwardingMode};

impl Controller {
    /// Receives a packet from the bus whose bytes will be complete as given, in advance, if nothing
    /// can happen before its end but its reception: it is the answer awaited, within all time
    /// limits. Returns whether it did; otherwise the bytes are passed in when they are complete.
    pub fn receive_packet(&mut self, now: SimTime, piece: Piece<'_>) -> bool {
        let ControllerConfig {
            timeout,
            response_limit,
            byte_time,
            passing,
            ..
        } = self.config;
        let Bus::Awaiting {
            to: from,
            since,
            noise: None,
        } = self.bus
        else {
            return false;
        };
        let (first, last) = (piece.first, piece.last());
        let in_time = since < first
            && first <= since + timeout
            && byte_time * PREFIX_LEN as u64 <= timeout
            && last <= first + response_limit;
        if passing != ForwardingMode::CutThrough
            || !in_time
            || piece.spacing != byte_time
            || piece.framing_error
        {
            return false;
        }
        let Some(progress) = Answer::receive_whole(from, piece.bytes) else {
            return false;
        };
        self.now = self.now.max(now);
        self.to_link.relay(first, piece);
        self.bus = Bus::Received {
            from,
            progress,
            last,
        };
        if progress == AnswerProgress::Valid {
            self.start_ahead(last);
        }
        true
    }

    /// Starts the request that follows a valid answer received in advance, which ends at `last`, if
    /// it is certain already.
    fn start_ahead(&mut self, last: SimTime) {
        let Some(entry) = self.receiver.next_at(last) else {
            return;
        };
        let to_board = entry
            .to()
            .is_some_and(|to| to.class() != CLASS_CONTROLLER && !to.is_broadcast());
        if !to_board || entry.error.is_some() || !entry.is_valid() {
            return;
        }
        let entry = entry.clone();
        self.now = last;
        self.ahead_until = last;
        self.receiver.pop_at(last);
        self.end_received();
        self.start(&entry);
    }

    /// Ends a valid answer received in advance.
    fn end_received(&mut self) {
        if let Bus::Received { last, .. } = self.bus {
            self.handle_deadline(last);
        }
    }
}
