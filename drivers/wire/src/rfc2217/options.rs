use super::com_port::COM_PORT;
use super::telnet::{TelnetVerb, push_negotiation};

/// Binary transmission (RFC 856).
pub(super) const BINARY: u8 = 0;
/// Suppression of "go ahead" (RFC 858).
pub(super) const SUPPRESS_GO_AHEAD: u8 = 3;

/// Accepted options, in both directions.
const ACCEPTED: [u8; 3] = [BINARY, SUPPRESS_GO_AHEAD, COM_PORT];

/// State of an option in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum OptionState {
    #[default]
    Off,
    Requested,
    On,
    Refused,
}

/// End of a connection that performs an option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    Own = 0,
    Other = 1,
}

/// Negotiation of the accepted options. An answer is sent upon a change only, so that two ends
/// cannot answer each other without end (RFC 854).
#[derive(Debug, Default)]
pub(super) struct Negotiation {
    states: [[OptionState; ACCEPTED.len()]; 2],
}

impl Negotiation {
    /// Requests an accepted option, unless it is on.
    pub(super) fn request(&mut self, end: End, option: u8, reply: &mut Vec<u8>) {
        let Some(state) = self.state_mut(end, option) else {
            return;
        };
        if *state == OptionState::Off {
            *state = OptionState::Requested;
            push_negotiation(agreement(end), option, reply);
        }
    }

    /// Handles a received negotiation.
    pub(super) fn handle(&mut self, verb: TelnetVerb, option: u8, reply: &mut Vec<u8>) {
        let (end, on) = match verb {
            TelnetVerb::Will => (End::Other, true),
            TelnetVerb::Wont => (End::Other, false),
            TelnetVerb::Do => (End::Own, true),
            TelnetVerb::Dont => (End::Own, false),
        };
        let Some(state) = self.state_mut(end, option) else {
            if on {
                push_negotiation(refusal(end), option, reply);
            }
            return;
        };
        let (new, answer) = match (*state, on) {
            (OptionState::Requested | OptionState::On, true) => (OptionState::On, None),
            (_, true) => (OptionState::On, Some(agreement(end))),
            (OptionState::On, false) => (OptionState::Refused, Some(refusal(end))),
            (_, false) => (OptionState::Refused, None),
        };
        *state = new;
        if let Some(verb) = answer {
            push_negotiation(verb, option, reply);
        }
    }

    pub(super) fn is_on(&self, end: End, option: u8) -> bool {
        self.is(end, option, OptionState::On)
    }

    /// Returns whether the other end has refused or disabled an option.
    pub(super) fn is_refused(&self, end: End, option: u8) -> bool {
        self.is(end, option, OptionState::Refused)
    }

    fn is(&self, end: End, option: u8, state: OptionState) -> bool {
        let mut options = ACCEPTED.iter().zip(&self.states[end as usize]);
        options.any(|(accepted, found)| *accepted == option && *found == state)
    }

    /// Returns the state of an option; none if it is not accepted.
    fn state_mut(&mut self, end: End, option: u8) -> Option<&mut OptionState> {
        let n = ACCEPTED.iter().position(|accepted| *accepted == option)?;
        self.states[end as usize].get_mut(n)
    }
}

/// Returns the verb by which this end requests or confirms an option of `end`.
fn agreement(end: End) -> TelnetVerb {
    match end {
        End::Own => TelnetVerb::Will,
        End::Other => TelnetVerb::Do,
    }
}

fn refusal(end: End) -> TelnetVerb {
    match end {
        End::Own => TelnetVerb::Wont,
        End::Other => TelnetVerb::Dont,
    }
}
