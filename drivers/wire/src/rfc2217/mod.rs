//! Telnet (RFC 854) with binary transmission (RFC 856) and the COM port control option (RFC 2217):
//! both ends of a serial port over a network, as state machines without input or output.
//!
//! Each end has the order `new`, then `handle_bytes` for received bytes; both append the bytes to
//! be sent to a buffer. [`push_data`] encodes data. All parsers take streams in any pieces, and
//! keep a bounded number of bytes.
//!
//! Out of scope: parity, flow control, breaks and modem lines, which the server reports as absent
//! or constant, and `FLOWCONTROL-SUSPEND`, whose task the flow control of TCP has.

mod client;
mod com_port;
mod options;
mod server;
mod telnet;

pub use client::{Rfc2217Client, Rfc2217Refusal};
pub use com_port::{ComPortMessage, ComPortParameter, ComPortSender};
pub use server::Rfc2217Server;
pub use telnet::{
    SUBNEGOTIATION_MAX, TelnetDecoder, TelnetEvent, TelnetVerb, push_data, push_negotiation,
    push_subnegotiation,
};

#[cfg(test)]
mod tests;
