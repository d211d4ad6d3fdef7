/// "Interpret as command", which begins each command; in data it is doubled.
const IAC: u8 = 255;
/// Begin and end of a subnegotiation.
const SB: u8 = 250;
const SE: u8 = 240;

/// Maximum length of a subnegotiation, its option included \[bytes\]. A longer one is discarded:
/// the longest message that is needed has 6 bytes.
pub const SUBNEGOTIATION_MAX: usize = 64;

/// Verb of a negotiation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TelnetVerb {
    /// The sender enables the option, or offers it.
    Will,
    /// The sender disables the option, or refuses it.
    Wont,
    /// The sender accepts the option of the receiver, or requests it.
    Do,
    /// The sender refuses the option of the receiver.
    Dont,
}

impl TelnetVerb {
    const ALL: [Self; 4] = [Self::Will, Self::Wont, Self::Do, Self::Dont];

    fn code(self) -> u8 {
        match self {
            Self::Will => 251,
            Self::Wont => 252,
            Self::Do => 253,
            Self::Dont => 254,
        }
    }
}

/// Element of a Telnet stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TelnetEvent<'a> {
    /// Data, not empty. Adjacent data may come in several events.
    Data(&'a [u8]),
    /// Negotiation of an option.
    Negotiation(TelnetVerb, u8),
    /// Option and parameters of a subnegotiation.
    Subnegotiation(u8, &'a [u8]),
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Data,
    /// After an IAC in data.
    Command,
    Option(TelnetVerb),
    Subnegotiation,
    /// After an IAC in a subnegotiation.
    SubnegotiationCommand,
}

/// Decoder of a Telnet stream in any pieces. Commands without effect on binary data, such as
/// "no operation", are skipped.
#[derive(Debug, Default)]
pub struct TelnetDecoder {
    state: State,
    /// The present subnegotiation without doubled IACs, at most one byte longer than permitted.
    subnegotiation: Vec<u8>,
}

impl TelnetDecoder {
    /// Takes the next event off `rest`; none if all bytes are consumed.
    pub fn next<'s, 'b: 's>(&'s mut self, rest: &mut &'b [u8]) -> Option<TelnetEvent<'s>> {
        while let Some((&byte, after)) = rest.split_first() {
            let all = *rest;
            *rest = after;
            match self.state {
                State::Data if byte == IAC => self.state = State::Command,
                State::Data => {
                    let length = all.iter().position(|byte| *byte == IAC);
                    let (data, after) = all.split_at(length.unwrap_or(all.len()));
                    *rest = after;
                    return Some(TelnetEvent::Data(data));
                }
                State::Command if byte == IAC => {
                    self.state = State::Data;
                    return Some(TelnetEvent::Data(&all[..1]));
                }
                State::Option(verb) => {
                    self.state = State::Data;
                    return Some(TelnetEvent::Negotiation(verb, byte));
                }
                State::Subnegotiation if byte == IAC => self.state = State::SubnegotiationCommand,
                State::Subnegotiation => self.keep(byte),
                State::SubnegotiationCommand if byte == IAC => {
                    self.state = State::Subnegotiation;
                    self.keep(byte);
                }
                State::SubnegotiationCommand if byte == SE => {
                    self.state = State::Data;
                    if (1..=SUBNEGOTIATION_MAX).contains(&self.subnegotiation.len()) {
                        let (option, parameters) = self.subnegotiation.split_at(1);
                        return Some(TelnetEvent::Subnegotiation(option[0], parameters));
                    }
                }
                // A subnegotiation without its end is left.
                State::Command | State::SubnegotiationCommand => self.begin_command(byte),
            }
        }
        None
    }

    /// Begins the command of the byte after an IAC.
    fn begin_command(&mut self, byte: u8) {
        let verb = TelnetVerb::ALL.into_iter().find(|verb| verb.code() == byte);
        self.state = match verb {
            Some(verb) => State::Option(verb),
            None if byte == SB => State::Subnegotiation,
            None => State::Data,
        };
        self.subnegotiation.clear();
    }

    fn keep(&mut self, byte: u8) {
        if self.subnegotiation.len() <= SUBNEGOTIATION_MAX {
            self.subnegotiation.push(byte);
        }
    }
}

/// Appends `data` to `bytes`, each IAC doubled.
pub fn push_data(data: &[u8], bytes: &mut Vec<u8>) {
    for run in data.split_inclusive(|byte| *byte == IAC) {
        bytes.extend_from_slice(run);
        if run.ends_with(&[IAC]) {
            bytes.push(IAC);
        }
    }
}

/// Appends a negotiation to `bytes`.
pub fn push_negotiation(verb: TelnetVerb, option: u8, bytes: &mut Vec<u8>) {
    bytes.extend_from_slice(&[IAC, verb.code(), option]);
}

/// Appends a subnegotiation to `bytes`, each IAC of option and parameters doubled.
pub fn push_subnegotiation(option: u8, parameters: &[u8], bytes: &mut Vec<u8>) {
    bytes.extend_from_slice(&[IAC, SB]);
    push_data(&[option], bytes);
    push_data(parameters, bytes);
    bytes.extend_from_slice(&[IAC, SE]);
}
