use std::io::{self, ErrorKind};
use std::net::{TcpStream, ToSocketAddrs};
use std::os::fd::BorrowedFd;
use std::time::{Duration, Instant};

use twinrig_runtime::{Device, DeviceError};

use crate::connection::{Connection, Session};
use crate::network_address::{NetworkAddress, NetworkTransport};
use crate::rfc2217::Rfc2217Client;

/// Serial port of another machine, or of a served twin, over TCP. By `rfc2217://` the server is
/// told the settings of the port, as in [`SerialPort::open`](crate::SerialPort::open); by `tcp://`
/// it has its own.
#[derive(Debug)]
pub struct RemotePort {
    connection: Connection,
}

/// Maximum wait for a connection, for each address of the host.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);
/// Maximum duration of the negotiation.
const NEGOTIATION_LIMIT: Duration = Duration::from_secs(5);
/// Maximum wait for room in the socket's buffer, as for that of a port.
const WRITE_LIMIT: Duration = Duration::from_millis(100);
/// Maximum number of bytes per read of the negotiation.
const READ_MAX: usize = 4096;

impl RemotePort {
    /// Connects to the server at `address`; by `rfc2217://` also sets the port to `baud_rate`
    /// \[bit/s\], 8 data bits, no parity, one stop bit, no flow control, and discards its bytes
    /// received before.
    ///
    /// # Errors
    /// [`DeviceError`] with the cause and a remedy.
    pub fn open(address: &NetworkAddress, baud_rate: u32) -> Result<Self, DeviceError> {
        Self::open_within(address, baud_rate, NEGOTIATION_LIMIT)
    }

    fn open_within(
        address: &NetworkAddress,
        baud_rate: u32,
        limit: Duration,
    ) -> Result<Self, DeviceError> {
        let place = address.to_string();
        let stream = connect(address, &place)?;
        let session = |reply: &mut Vec<u8>| match address.transport {
            NetworkTransport::Tcp => Session::Raw,
            NetworkTransport::Rfc2217 => Session::Client(Rfc2217Client::new(baud_rate, reply)),
        };
        let connection = Connection::new(place.clone(), stream, WRITE_LIMIT, session);
        let connection = connection.map_err(|error| failed(place, &error))?;
        let mut port = Self { connection };
        port.negotiate(limit)?;
        Ok(port)
    }

    /// Waits for at most `limit` until the server has confirmed the settings.
    fn negotiate(&mut self, limit: Duration) -> Result<(), DeviceError> {
        let deadline = now() + limit;
        let mut discarded = Vec::new();
        loop {
            let Session::Client(client) = &self.connection.session else {
                return Ok(());
            };
            if client.is_ready() {
                return Ok(());
            }
            let left = deadline.saturating_duration_since(now());
            if let Some(missing) = client.unanswered().filter(|_| left.is_zero()) {
                return Err(DeviceError::NoAnswer {
                    place: self.place().to_owned(),
                    limit,
                    missing: missing.to_owned(),
                });
            }
            self.read_up_to(READ_MAX, left, &mut discarded)?;
        }
    }
}

impl Device for RemotePort {
    fn place(&self) -> &str {
        self.connection.place()
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        self.connection.write(bytes).map_err(closed)
    }

    fn read_up_to(
        &mut self,
        limit: usize,
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        let read = self.connection.read_up_to(limit, timeout, bytes);
        // A server that refuses may close the connection at once.
        if let Session::Client(client) = &self.connection.session
            && let Some(refusal) = client.refusal()
        {
            return Err(DeviceError::Refused {
                place: self.place().to_owned(),
                why: refusal.to_string(),
            });
        }
        read.map_err(closed)
    }

    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        self.connection.descriptor()
    }
}

/// Connects to the first address of the host that accepts.
fn connect(address: &NetworkAddress, place: &str) -> Result<TcpStream, DeviceError> {
    let found = (&*address.host, address.port).to_socket_addrs();
    let found = found.map_err(|error| DeviceError::NoHost {
        place: place.to_owned(),
        why: error.to_string(),
    })?;
    let mut last = io::Error::new(ErrorKind::NotFound, "the name has no address");
    for socket_address in found {
        match TcpStream::connect_timeout(&socket_address, CONNECT_LIMIT) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(failed(place.to_owned(), &last))
}

/// Error of a connection that is not established.
fn failed(place: String, error: &io::Error) -> DeviceError {
    match error.kind() {
        ErrorKind::ConnectionRefused => DeviceError::ConnectionRefused { place },
        ErrorKind::TimedOut | ErrorKind::WouldBlock => DeviceError::NoConnection {
            place,
            limit: CONNECT_LIMIT,
        },
        _ => DeviceError::Other {
            place,
            why: error.to_string(),
        },
    }
}

/// A connection, other than a device, is ended by its peer.
fn closed(error: DeviceError) -> DeviceError {
    match error {
        DeviceError::Gone { place } => DeviceError::Closed { place },
        error => error,
    }
}

#[expect(clippy::disallowed_methods, reason = "time-out of a network")]
fn now() -> Instant {
    Instant::now()
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn silent_server_is_an_error_that_names_the_missing_answer() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let place = format!("rfc2217://{}", listener.local_addr().unwrap());
        let address = NetworkAddress::parse(&place).unwrap().unwrap();
        let limit = Duration::from_millis(20);
        let error = RemotePort::open_within(&address, 1_000_000, limit).unwrap_err();
        let missing = "the COM port control option (RFC 2217)".to_owned();
        let silent = DeviceError::NoAnswer {
            place,
            limit,
            missing,
        };
        assert_eq!(error, silent);
    }
}
