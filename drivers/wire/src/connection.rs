use std::io;
use std::net::TcpStream;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use nix::libc::POLLRDHUP;
use nix::poll::PollFlags;
use twinrig_runtime::DeviceError;

use crate::byte_stream::ByteStream;
use crate::rfc2217::{Rfc2217Client, Rfc2217Server, push_data};

/// Encoding of the bytes of a port on a connection.
#[derive(Debug)]
pub(crate) enum Session {
    Raw,
    Client(Rfc2217Client),
    Server(Rfc2217Server),
}

/// Established TCP connection with the bytes of a port.
///
/// A write is transmitted as a whole or not at all: the part that the socket does not take at once
/// is kept, and the next write fails if it is still there.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: ByteStream<TcpStream>,
    pub(crate) session: Session,
    /// Encoded bytes that are not sent.
    outbox: Vec<u8>,
    /// Encoded bytes that are received, between two reads empty.
    inbox: Vec<u8>,
}

/// Number of unsent bytes from which no more are read \[bytes\]: answers to a peer that does not
/// read.
const OUTBOX_MAX: usize = 1 << 16;

impl Connection {
    /// A connection that waits for at most `write_limit` until a peer that does not read makes
    /// room. `session` is made with its first bytes to be sent.
    pub(crate) fn new(
        place: String,
        stream: TcpStream,
        write_limit: Duration,
        session: impl FnOnce(&mut Vec<u8>) -> Session,
    ) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_nonblocking(true)?;
        let mut outbox = Vec::new();
        let session = session(&mut outbox);
        Ok(Self {
            stream: ByteStream::new(place, stream, write_limit),
            session,
            outbox,
            inbox: Vec::new(),
        })
    }

    pub(crate) fn place(&self) -> &str {
        &self.stream.place
    }

    /// Writes all of `bytes` or none.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        self.flush()?;
        match self.session {
            Session::Raw => self.outbox.extend_from_slice(bytes),
            Session::Client(_) | Session::Server(_) => push_data(bytes, &mut self.outbox),
        }
        self.flush_or_keep()
    }

    /// Reads as [`twinrig_runtime::Device::read_up_to`] does.
    pub(crate) fn read_up_to(
        &mut self,
        limit: usize,
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        // Bytes of a peer that no longer reads are read all the same.
        let flushed = self.flush_or_keep();
        if flushed.is_ok() && self.is_blocked() {
            self.stream.wait(PollFlags::POLLOUT, timeout)?;
            return self.flush_or_keep();
        }
        let read = self.stream.read_up_to(limit, timeout, &mut self.inbox);
        match &mut self.session {
            Session::Raw => bytes.append(&mut self.inbox),
            Session::Client(it) => it.handle_bytes(&self.inbox, bytes, &mut self.outbox),
            Session::Server(it) => it.handle_bytes(&self.inbox, bytes, &mut self.outbox),
        }
        self.inbox.clear();
        flushed.and(read)?;
        self.flush_or_keep()
    }

    /// Returns the descriptor to be polled for bytes; none while no bytes are read.
    pub(crate) fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        (!self.is_blocked()).then(|| self.stream.descriptor())
    }

    /// Returns whether the peer has ended the connection. Bytes from it may remain to be read.
    pub(crate) fn is_ended(&self) -> bool {
        self.has_event(PollFlags::from_bits_retain(POLLRDHUP))
    }

    /// Returns whether the peer has aborted the connection, also by ending it before it had read
    /// all bytes.
    pub(crate) fn is_reset(&self) -> bool {
        self.has_event(PollFlags::empty())
    }

    /// Returns whether there is one of `events`, an error or a hang-up.
    fn has_event(&self, events: PollFlags) -> bool {
        let found = self.stream.wait(events, Duration::ZERO);
        found.is_ok_and(|found| !found.is_empty())
    }

    fn is_blocked(&self) -> bool {
        self.outbox.len() > OUTBOX_MAX
    }

    fn flush(&mut self) -> Result<(), DeviceError> {
        let mut rest = &self.outbox[..];
        let written = self.stream.write_front(&mut rest);
        let sent = self.outbox.len() - rest.len();
        self.outbox.drain(..sent);
        written
    }

    /// Sends bytes and keeps those that the socket does not take.
    fn flush_or_keep(&mut self) -> Result<(), DeviceError> {
        match self.flush() {
            Err(DeviceError::Stuck { .. }) => Ok(()),
            flushed => flushed,
        }
    }
}
