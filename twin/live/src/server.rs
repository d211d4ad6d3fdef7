//! Visitors of a session by WebSocket, in Foxglove's protocol, and a page over HTTP.
//!
//! The run has one thread, which never waits for a visitor: messages go to queues of a limited
//! length, from which the oldest is dropped, and requests come from one.

mod hardware;
mod page;
mod published;
mod requests;
mod simulated;
mod sink;
mod visitors;

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use foxglove::FoxgloveError;
use thiserror::Error;
use twinrig_record::RecordError;
use twinrig_rig::Error as RigError;

pub use self::hardware::HardwareServer;
pub use self::simulated::Server;
use crate::error::LiveError;

/// How a session is served.
#[derive(Clone, Debug)]
pub struct Options {
    /// Address of the interface: loopback, or one that other machines reach.
    pub host: String,
    /// Port of the WebSocket, and of the page; 0: any that is free.
    pub ports: [u16; 2],
    /// Folder of the scenarios of branches.
    pub folder: PathBuf,
    /// Limit of the memory of saved states \[bytes\].
    pub memory: usize,
    /// Simulated time over wall-clock time; 0: as fast as possible.
    pub speed: f64,
    /// Whether time stands still at the start.
    pub paused: bool,
}

/// Where a session is served.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// Address of the WebSocket.
    pub socket: SocketAddr,
    /// Address of the page.
    pub page: SocketAddr,
}

/// Failure to serve a session.
#[derive(Debug, Error)]
pub enum ServeError {
    /// The session cannot be created.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// A port cannot be listened at.
    #[error("cannot listen at {place}: {why}; another program may, port 0 takes a free one")]
    Listen {
        /// Address and port.
        place: String,
        /// Cause.
        why: String,
    },
    /// A channel cannot be declared.
    #[error("cannot declare the channels of the run: {0}")]
    Channels(#[from] FoxgloveError),
    /// The signals cannot be described.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The run cannot begin, or its recording cannot be created.
    #[error(transparent)]
    Run(Box<RigError>),
    /// The threads of the server cannot be started.
    #[error("cannot start the server: {0}")]
    Start(#[from] io::Error),
}

impl From<RigError> for ServeError {
    fn from(error: RigError) -> Self {
        Self::Run(Box::new(error))
    }
}
