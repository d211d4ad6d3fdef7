use super::telnet::push_subnegotiation;

/// Code of the COM port control option.
pub(super) const COM_PORT: u8 = 44;

const SIGNATURE: u8 = 0;
const BAUD_RATE: u8 = 1;
/// Difference between the codes of a server and of a client.
const SERVER_OFFSET: u8 = 100;

/// Sender of a message, which determines its code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComPortSender {
    /// The program that uses the port.
    Client,
    /// The access server, which has the port.
    Server,
}

/// Parameter of a port in one byte; codes and values as in RFC 2217.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComPortParameter {
    /// Data bits: 5 to 8.
    DataSize = 2,
    /// 1: no parity.
    Parity = 3,
    /// 1: one stop bit.
    StopSize = 4,
    /// Flow control, break and modem lines.
    Control = 5,
    /// State of the line, sent by the server.
    LineState = 6,
    /// State of the modem lines, sent by the server.
    ModemState = 7,
    /// Line states to be sent.
    LineStateMask = 10,
    /// Modem states to be sent.
    ModemStateMask = 11,
    /// Buffers to be purged: 1: received by the port, 2: to be transmitted by it, 3: both.
    Purge = 12,
}

impl ComPortParameter {
    /// All parameters.
    pub const ALL: [Self; 9] = [
        Self::DataSize,
        Self::Parity,
        Self::StopSize,
        Self::Control,
        Self::LineState,
        Self::ModemState,
        Self::LineStateMask,
        Self::ModemStateMask,
        Self::Purge,
    ];
}

/// Message of the COM port control option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComPortMessage<'a> {
    /// Name of the sender; empty: request for the name of the receiver.
    Signature(&'a [u8]),
    /// Baud rate \[bit/s\]; of a client 0: request for the present one.
    BaudRate(u32),
    /// Another parameter and its value.
    Parameter(ComPortParameter, u8),
}

impl<'a> ComPortMessage<'a> {
    /// Returns the message in the parameters of a subnegotiation from `sender`; none if it is
    /// malformed or has another code. Bytes beyond the value are ignored.
    pub fn decode(parameters: &'a [u8], sender: ComPortSender) -> Option<Self> {
        let (&code, value) = parameters.split_first()?;
        let code = match sender {
            ComPortSender::Client => code,
            ComPortSender::Server => code.checked_sub(SERVER_OFFSET)?,
        };
        match code {
            SIGNATURE => Some(Self::Signature(value)),
            BAUD_RATE => {
                let rate = value.first_chunk()?;
                Some(Self::BaudRate(u32::from_be_bytes(*rate)))
            }
            _ => {
                let mut all = ComPortParameter::ALL.into_iter();
                let parameter = all.find(|parameter| *parameter as u8 == code)?;
                Some(Self::Parameter(parameter, *value.first()?))
            }
        }
    }

    /// Appends the message of `sender` to `bytes`, as a subnegotiation.
    pub fn push(self, sender: ComPortSender, bytes: &mut Vec<u8>) {
        let offset = match sender {
            ComPortSender::Client => 0,
            ComPortSender::Server => SERVER_OFFSET,
        };
        match self {
            Self::Signature(name) => {
                let parameters = [&[SIGNATURE + offset], name].concat();
                push_subnegotiation(COM_PORT, &parameters, bytes);
            }
            Self::BaudRate(rate) => {
                let [a, b, c, d] = rate.to_be_bytes();
                push_subnegotiation(COM_PORT, &[BAUD_RATE + offset, a, b, c, d], bytes);
            }
            Self::Parameter(parameter, value) => {
                push_subnegotiation(COM_PORT, &[parameter as u8 + offset, value], bytes);
            }
        }
    }
}
