use super::com_port::{COM_PORT, ComPortMessage, ComPortParameter, ComPortSender};
use super::options::{BINARY, End, Negotiation, SUPPRESS_GO_AHEAD};
use super::telnet::{TelnetDecoder, TelnetEvent};

/// Name sent upon a request for the signature.
const NAME: &[u8] = b"twinrig";
/// Modem lines as of a device that is always ready: carrier detect, data set ready, clear to send.
const MODEM_STATE: u8 = 0b1011_0000;

/// Server of a port that has one baud rate and 8 data bits, no parity, one stop bit, no flow
/// control. Requests for other settings are answered by these, as RFC 2217 permits.
#[derive(Debug)]
pub struct Rfc2217Server {
    decoder: TelnetDecoder,
    negotiation: Negotiation,
    port: PortState,
    modem_state_sent: bool,
}

/// State of the port as seen by a client.
#[derive(Debug)]
struct PortState {
    /// Baud rate \[bit/s\].
    baud_rate: u32,
    /// Answers to requests for the lines "data terminal ready" and "request to send", which act on
    /// nothing: the codes of on or off.
    lines: [u8; 2],
}

impl Rfc2217Server {
    /// A server of a port at `baud_rate` \[bit/s\]; its requests are appended to `reply`.
    pub fn new(baud_rate: u32, reply: &mut Vec<u8>) -> Self {
        let mut negotiation = Negotiation::default();
        for option in [BINARY, SUPPRESS_GO_AHEAD] {
            for end in [End::Own, End::Other] {
                negotiation.request(end, option, reply);
            }
        }
        Self {
            decoder: TelnetDecoder::default(),
            negotiation,
            port: PortState {
                baud_rate,
                lines: [8, 11],
            },
            modem_state_sent: false,
        }
    }

    /// Handles received bytes. Appends the bytes for the port to `data`, at most as many as are
    /// received, and answers to `reply`.
    pub fn handle_bytes(&mut self, bytes: &[u8], data: &mut Vec<u8>, reply: &mut Vec<u8>) {
        let mut rest = bytes;
        while let Some(event) = self.decoder.next(&mut rest) {
            match event {
                TelnetEvent::Data(bytes) => data.extend_from_slice(bytes),
                TelnetEvent::Negotiation(verb, option) => {
                    self.negotiation.handle(verb, option, reply);
                    if !self.modem_state_sent && self.negotiation.is_on(End::Other, COM_PORT) {
                        self.modem_state_sent = true;
                        let parameter = ComPortParameter::ModemState;
                        let state = ComPortMessage::Parameter(parameter, MODEM_STATE);
                        state.push(ComPortSender::Server, reply);
                    }
                }
                TelnetEvent::Subnegotiation(COM_PORT, parameters) => {
                    let request = ComPortMessage::decode(parameters, ComPortSender::Client);
                    if let Some(answer) = self.port.answer(request) {
                        answer.push(ComPortSender::Server, reply);
                    }
                }
                TelnetEvent::Subnegotiation(..) => {}
            }
        }
    }
}

impl PortState {
    fn answer(&mut self, request: Option<ComPortMessage<'_>>) -> Option<ComPortMessage<'static>> {
        Some(match request? {
            ComPortMessage::Signature([]) => ComPortMessage::Signature(NAME),
            ComPortMessage::Signature(_) => return None,
            ComPortMessage::BaudRate(_) => ComPortMessage::BaudRate(self.baud_rate),
            ComPortMessage::Parameter(parameter, value) => {
                let value = match parameter {
                    ComPortParameter::DataSize => 8,
                    ComPortParameter::Parity | ComPortParameter::StopSize => 1,
                    ComPortParameter::Control => self.control(value),
                    ComPortParameter::LineStateMask
                    | ComPortParameter::ModemStateMask
                    | ComPortParameter::Purge => value,
                    ComPortParameter::LineState | ComPortParameter::ModemState => return None,
                };
                ComPortMessage::Parameter(parameter, value)
            }
        })
    }

    /// Returns the answer to a request of [`ComPortParameter::Control`], in its codes.
    fn control(&mut self, request: u8) -> u8 {
        match request {
            // Break: off.
            4..=6 => 6,
            // Data terminal ready: present state, on, off.
            7 => self.lines[0],
            8 | 9 => {
                self.lines[0] = request;
                request
            }
            // Request to send: present state, on, off.
            10 => self.lines[1],
            11 | 12 => {
                self.lines[1] = request;
                request
            }
            // Inbound flow control: none.
            13..=16 | 18 => 14,
            // Outbound flow control: none.
            _ => 1,
        }
    }
}
