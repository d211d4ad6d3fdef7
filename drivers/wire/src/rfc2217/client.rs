use thiserror::Error;

use super::com_port::{COM_PORT, ComPortMessage, ComPortParameter, ComPortSender};
use super::options::{BINARY, End, Negotiation, SUPPRESS_GO_AHEAD};
use super::telnet::{TelnetDecoder, TelnetEvent};

/// Reason for which a server cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Rfc2217Refusal {
    /// A required Telnet option is refused, or was disabled later.
    #[error("it does not have {0}")]
    Option(&'static str),
    /// The port has another baud rate than requested.
    #[error("the port is at {found} bit/s, not at {requested} bit/s")]
    BaudRate {
        /// Requested rate \[bit/s\].
        requested: u32,
        /// Rate stated by the server \[bit/s\].
        found: u32,
    },
    /// The port has another value of a parameter than requested.
    #[error("the port has {name} {found}, not {requested}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Requested value, in the codes of RFC 2217.
        requested: u8,
        /// Value stated by the server.
        found: u8,
    },
}

/// Options without which the port cannot be used.
const REQUIRED: [(End, u8, &str); 3] = [
    (End::Own, COM_PORT, "the COM port control option (RFC 2217)"),
    (End::Own, BINARY, "binary reception"),
    (End::Other, BINARY, "binary transmission"),
];

/// Parameters without which the port cannot be used, and their values: 8N1.
const FORMAT: [(ComPortParameter, u8, &str); 3] = [
    (ComPortParameter::DataSize, 8, "data size"),
    (ComPortParameter::Parity, 1, "parity"),
    (ComPortParameter::StopSize, 1, "stop size"),
];

/// No flow control, in the codes of [`ComPortParameter::Control`].
const NO_FLOW_CONTROL: u8 = 1;
/// Both buffers, in the codes of [`ComPortParameter::Purge`].
const PURGE_BOTH: u8 = 3;

/// Client of a port at 8 data bits, no parity, one stop bit, no flow control. Negotiates the
/// options, then purges the port's buffers and sets its parameters; it is ready when the server has
/// confirmed them.
#[derive(Debug)]
pub struct Rfc2217Client {
    baud_rate: u32,
    decoder: TelnetDecoder,
    negotiation: Negotiation,
    is_configured: bool,
    /// Whether baud rate and parameters are confirmed.
    confirmed: [bool; 1 + FORMAT.len()],
    refusal: Option<Rfc2217Refusal>,
}

impl Rfc2217Client {
    /// A client for a port at `baud_rate` \[bit/s\]; its requests are appended to `reply`.
    pub fn new(baud_rate: u32, reply: &mut Vec<u8>) -> Self {
        let mut negotiation = Negotiation::default();
        for (end, option, _) in REQUIRED {
            negotiation.request(end, option, reply);
        }
        for end in [End::Own, End::Other] {
            negotiation.request(end, SUPPRESS_GO_AHEAD, reply);
        }
        Self {
            baud_rate,
            decoder: TelnetDecoder::default(),
            negotiation,
            is_configured: false,
            confirmed: [false; 1 + FORMAT.len()],
            refusal: None,
        }
    }

    /// Handles received bytes. Appends the bytes of the port to `data`, at most as many as are
    /// received, and answers to `reply`. Bytes of the port are discarded until the client is ready.
    pub fn handle_bytes(&mut self, bytes: &[u8], data: &mut Vec<u8>, reply: &mut Vec<u8>) {
        let mut rest = bytes;
        while let Some(event) = self.decoder.next(&mut rest) {
            match event {
                TelnetEvent::Data(bytes) if is_ready(&self.confirmed) => {
                    data.extend_from_slice(bytes);
                }
                TelnetEvent::Negotiation(verb, option) => {
                    self.negotiation.handle(verb, option, reply);
                    self.configure(reply);
                }
                TelnetEvent::Subnegotiation(COM_PORT, parameters) => {
                    let message = ComPortMessage::decode(parameters, ComPortSender::Server);
                    let checked = check(message, self.baud_rate, &mut self.confirmed);
                    // The first reason is the cause of others. Answers to no request are those of
                    // a change made by another program.
                    self.refusal = self.refusal.or(checked.err());
                }
                TelnetEvent::Data(_) | TelnetEvent::Subnegotiation(..) => {}
            }
        }
    }

    /// Returns whether the port is configured.
    pub fn is_ready(&self) -> bool {
        self.refusal.is_none() && is_ready(&self.confirmed)
    }

    /// Returns the reason for which the port cannot be used.
    pub fn refusal(&self) -> Option<Rfc2217Refusal> {
        self.refusal
    }

    /// Returns what the server has not answered; none if the client is ready.
    pub fn unanswered(&self) -> Option<&'static str> {
        let mut required = REQUIRED.into_iter();
        let option = required.find(|(end, option, _)| !self.negotiation.is_on(*end, *option));
        let names = ["baud rate"]
            .into_iter()
            .chain(FORMAT.map(|(_, _, name)| name));
        let mut parameters = self.confirmed.iter().zip(names);
        let parameter = parameters.find(|(confirmed, _)| !**confirmed);
        option
            .map(|(_, _, name)| name)
            .or(parameter.map(|(_, name)| name))
    }

    /// Requests the settings as soon as all options are negotiated.
    fn configure(&mut self, reply: &mut Vec<u8>) {
        for (end, option, name) in REQUIRED {
            if self.negotiation.is_refused(end, option) {
                self.refusal = self.refusal.or(Some(Rfc2217Refusal::Option(name)));
            }
        }
        let on = REQUIRED.map(|(end, option, _)| self.negotiation.is_on(end, option));
        if self.is_configured || on.contains(&false) {
            return;
        }
        self.is_configured = true;
        // Purged first: answers to the settings come afterwards. Not all servers answer to this
        // request, and to that of no flow control.
        let unchecked = [
            (ComPortParameter::Purge, PURGE_BOTH),
            (ComPortParameter::Control, NO_FLOW_CONTROL),
        ];
        for (parameter, value) in unchecked {
            ComPortMessage::Parameter(parameter, value).push(ComPortSender::Client, reply);
        }
        ComPortMessage::BaudRate(self.baud_rate).push(ComPortSender::Client, reply);
        for (parameter, value, _) in FORMAT {
            ComPortMessage::Parameter(parameter, value).push(ComPortSender::Client, reply);
        }
    }
}

fn is_ready(confirmed: &[bool]) -> bool {
    !confirmed.contains(&false)
}

/// Compares an answer with the request, and marks it as confirmed.
fn check(
    message: Option<ComPortMessage<'_>>,
    requested: u32,
    confirmed: &mut [bool; 1 + FORMAT.len()],
) -> Result<(), Rfc2217Refusal> {
    match message {
        Some(ComPortMessage::BaudRate(found)) if found == requested => confirmed[0] = true,
        Some(ComPortMessage::BaudRate(found)) => {
            return Err(Rfc2217Refusal::BaudRate { requested, found });
        }
        Some(ComPortMessage::Parameter(parameter, found)) => {
            let mut format = FORMAT.into_iter().enumerate();
            let Some((n, (_, requested, name))) = format.find(|(_, (it, ..))| *it == parameter)
            else {
                return Ok(());
            };
            if found != requested {
                return Err(Rfc2217Refusal::Parameter {
                    name,
                    requested,
                    found,
                });
            }
            confirmed[1 + n] = true;
        }
        Some(ComPortMessage::Signature(_)) | None => {}
    }
    Ok(())
}
