//! Assignment of received packets to requests.

use twinrig_wire::TrafficError;

use super::Master;
use crate::codes::ErrorCode;
use crate::master_config::{RequestError, Topology};
use crate::packet::Response;

impl Master {
    /// Ends the wait for an answer that was received with a wrong checksum. All bytes so far are
    /// parsed.
    pub(super) fn handle_damaged(&mut self) {
        let open = self.requests[self.outstanding()].first().copied().flatten();
        let matches_open =
            |(class, id)| open.is_some_and(|open| (open.to.class(), open.to.id()) == (class, id));
        let over = self.config.topology == Topology::Direct && !self.parser.is_partial();
        if over && self.parser.damaged().is_some_and(matches_open) {
            self.counters.damaged += 1;
            self.record_error(self.open, TrafficError::Checksum);
            self.open += 1;
            self.proceed();
        }
    }

    /// Handles a packet received while answers are expected; None if it is not a response.
    pub(super) fn handle_response(&mut self, response: Option<Response>) {
        let open = self.outstanding();
        let matches = |response: &Response, index: usize| {
            self.requests[index].is_some_and(|request| request.to == response.from())
        };
        let found = response.and_then(|response| {
            let index = open.clone().find(|index| matches(&response, *index));
            index.map(|index| (index, response))
        });
        if found.is_none() {
            self.record_unexpected(response.as_ref());
        }
        let Some((index, response)) = found else {
            self.counters.strays += 1;
            self.unsolicited = Some(self.now);
            return;
        };
        for lost in self.open..index {
            self.record_error(lost, TrafficError::NoAnswer);
        }
        self.record_answer(index, &response);
        self.outcomes[index] = match response.error {
            ErrorCode::OK => Ok(response.payload),
            error => Err(RequestError::Refused(error)),
        };
        self.open = index + 1;
        self.proceed();
    }
}
