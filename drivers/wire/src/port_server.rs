use std::io::{self, ErrorKind};
use std::net::{TcpListener, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use twinrig_runtime::{Device, DeviceError};

use crate::connection::{Connection, Session};
use crate::network_address::{NetworkAddress, NetworkTransport};
use crate::rfc2217::Rfc2217Server;

/// Port served over TCP to one client at a time, in place of the master end of a PTY
/// ([`Pty`](crate::Pty)).
///
/// While no client is connected, reading returns [`DeviceError::HungUp`]; one may connect at any
/// time. Further clients are disconnected at the next read. A write never blocks: bytes for a
/// client that does not read are [`DeviceError::Stuck`].
///
/// A client whose machine disappears without closing the connection stays connected until TCP gives
/// up a write to it.
///
/// ```
/// use twinrig_runtime::Device;
/// use twinrig_wire::{NetworkAddress, PortServer, RemotePort};
///
/// let mut twin = PortServer::listen(&NetworkAddress::parse_served("tcp://0")?, 1_000_000)?;
/// let mut robot = RemotePort::open(twin.address(), 1_000_000)?;
/// robot.write(b"hello")?;
/// let mut received = Vec::new();
/// twin.read(std::time::Duration::from_secs(1), &mut received)?;
/// assert_eq!(received, b"hello");
/// # Ok::<(), twinrig_runtime::DeviceError>(())
/// ```
#[derive(Debug)]
pub struct PortServer {
    listener: TcpListener,
    address: NetworkAddress,
    place: String,
    baud_rate: u32,
    client: Option<Connection>,
    /// Client that connected after the last one had closed its connection.
    next: Option<TcpStream>,
}

/// Maximum number of further clients that are disconnected at one read.
const REFUSED_MAX: usize = 16;

impl PortServer {
    /// Listens at `address`; port 0 is replaced by a free one. Clients by `rfc2217://` are told
    /// `baud_rate` \[bit/s\].
    ///
    /// # Errors
    /// [`DeviceError`]: the host is not this machine, or the port is in use.
    pub fn listen(address: &NetworkAddress, baud_rate: u32) -> Result<Self, DeviceError> {
        let refused = |error: io::Error| refused(address.to_string(), &error);
        let listener = TcpListener::bind((&*address.host, address.port)).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        let port = listener.local_addr().map_err(refused)?.port();
        let address = NetworkAddress {
            port,
            ..address.clone()
        };
        Ok(Self {
            listener,
            place: address.to_string(),
            address,
            baud_rate,
            client: None,
            next: None,
        })
    }

    /// Address by which clients on this machine connect.
    pub fn address(&self) -> &NetworkAddress {
        &self.address
    }

    /// Returns the client, which may just have connected.
    fn client(&mut self) -> Option<&mut Connection> {
        if self.client.is_none() {
            let stream = self.next.take().or_else(|| self.accept())?;
            let (transport, baud_rate) = (self.address.transport, self.baud_rate);
            let session = |reply: &mut Vec<u8>| match transport {
                NetworkTransport::Tcp => Session::Raw,
                NetworkTransport::Rfc2217 => Session::Server(Rfc2217Server::new(baud_rate, reply)),
            };
            // A client that has disappeared since is none.
            let place = self.place.clone();
            self.client = Connection::new(place, stream, Duration::ZERO, session).ok();
        }
        self.client.as_mut()
    }

    /// Returns the next client that connects. Errors are those of its connection, or pass.
    fn accept(&self) -> Option<TcpStream> {
        self.listener.accept().ok().map(|(stream, _)| stream)
    }

    /// Disconnects further clients; one that has come after the end of the last one is the next.
    fn refuse_others(&mut self) {
        let Some(client) = self.client.as_ref().filter(|_| self.next.is_none()) else {
            return;
        };
        for _ in 0..REFUSED_MAX {
            let Some(stream) = self.accept() else {
                return;
            };
            if client.is_ended() {
                self.next = Some(stream);
                return;
            }
        }
    }

    fn hung_up(&self) -> DeviceError {
        DeviceError::HungUp {
            place: self.place.clone(),
        }
    }
}

impl Device for PortServer {
    fn place(&self) -> &str {
        &self.place
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        let Some(client) = &mut self.client else {
            return Err(self.hung_up());
        };
        match client.write(bytes) {
            Ok(()) => Ok(()),
            Err(DeviceError::Stuck { place, limit }) => Err(DeviceError::Stuck { place, limit }),
            // The next read ends the connection, after its last bytes.
            Err(_) => Err(self.hung_up()),
        }
    }

    fn read_up_to(
        &mut self,
        limit: usize,
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        let Some(client) = self.client() else {
            return Err(self.hung_up());
        };
        let (is_reset, before) = (client.is_reset(), bytes.len());
        let read = client.read_up_to(limit, timeout, bytes);
        if is_reset {
            // The last bytes, perhaps a command to stop, are read once, as many as the buffer of a
            // terminal has; all of those of a program that has crashed in a flood would take
            // minutes.
            self.client = None;
            return if bytes.len() > before {
                Ok(())
            } else {
                Err(self.hung_up())
            };
        }
        self.refuse_others();
        if read.is_err() {
            self.client = None;
        }
        read.map_err(|_| self.hung_up())
    }

    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        match &self.client {
            Some(client) => client.descriptor(),
            None => Some(self.listener.as_fd()),
        }
    }
}

/// Error of an address at which no server can listen.
fn refused(place: String, error: &io::Error) -> DeviceError {
    let why = match error.kind() {
        ErrorKind::AddrInUse => return DeviceError::Busy { place },
        ErrorKind::PermissionDenied => "permission denied; choose a port from 1024 up".to_owned(),
        ErrorKind::AddrNotAvailable => "this machine does not have that address".to_owned(),
        _ => error.to_string(),
    };
    DeviceError::Other { place, why }
}
