use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{Address, Master, SbcpError};

use crate::config::{Attachment, BoardConfig, SessionGains};
use crate::leg::{self, Leg};
use crate::reply::Reply;
use crate::shaft::{self, Shaft};

/// Host's view of a board.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct HostBoard {
    /// Number in the record of the traffic.
    device: u16,
    used: bool,
    mechanism: Mechanism,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum Mechanism {
    Leg(Leg),
    Shaft(Shaft),
}

impl HostBoard {
    pub(crate) fn new(board: &BoardConfig, gains: &SessionGains) -> Result<Self, SbcpError> {
        let address = Address::new(CLASS_MOTORDRIVER, board.id)?;
        Ok(Self {
            device: Master::device(address),
            used: board.used,
            mechanism: match board.attachment {
                Attachment::Leg { side } => Mechanism::Leg(Leg::new(board, side)),
                Attachment::Shaft => Mechanism::Shaft(Shaft::new(board, gains)),
            },
        })
    }

    /// Returns its number in the record of the traffic.
    pub(crate) fn device(&self) -> u16 {
        self.device
    }

    pub(crate) fn is_used(&self) -> bool {
        self.used
    }

    pub(crate) fn is_shaft(&self) -> bool {
        matches!(self.mechanism, Mechanism::Shaft(_))
    }

    /// Returns the number of values from the process.
    pub(crate) fn commanded(&self) -> usize {
        match self.mechanism {
            Mechanism::Leg(_) => leg::COMMANDED,
            Mechanism::Shaft(_) => shaft::COMMANDED,
        }
    }

    /// Returns the number of values for the process.
    pub(crate) fn measured(&self) -> usize {
        match self.mechanism {
            Mechanism::Leg(_) => leg::MEASURED,
            Mechanism::Shaft(_) => shaft::MEASURED,
        }
    }

    /// Returns the ports of its commands and measurements.
    pub(crate) fn ports(&self) -> Vec<Port> {
        match &self.mechanism {
            Mechanism::Leg(leg) => leg.ports(),
            Mechanism::Shaft(shaft) => shaft.ports(),
        }
    }

    /// Sets the register `PositionLimit` of a motor as reported by the board.
    pub(crate) fn set_limit(&mut self, motor: usize, word: u16) {
        match &mut self.mechanism {
            Mechanism::Leg(leg) => leg.set_limit(motor, word),
            Mechanism::Shaft(shaft) => shaft.set_limit(word),
        }
    }

    /// Returns the reason why the board, as configured, cannot serve its mechanism, if any.
    pub(crate) fn refusal(&self) -> Option<String> {
        match &self.mechanism {
            Mechanism::Leg(_) => None,
            Mechanism::Shaft(shaft) => shaft.refusal(),
        }
    }

    /// Returns the words of the set-points for the values from the process.
    pub(crate) fn goals(&mut self, commands: &[f64]) -> [u16; 2] {
        match &mut self.mechanism {
            Mechanism::Leg(leg) => leg.goals(commands),
            Mechanism::Shaft(shaft) => shaft.goals(commands[0]),
        }
    }

    /// Stores the reply of a cycle that began at `at`. Returns false and stores nothing if no board
    /// sends it.
    pub(crate) fn store(&mut self, reply: &Reply, at: HostTime) -> bool {
        match &mut self.mechanism {
            Mechanism::Leg(leg) => leg.store(reply),
            Mechanism::Shaft(shaft) => shaft.store(reply, at),
        }
    }

    /// Stores one word of a reply.
    pub(crate) fn store_word(&mut self, place: usize, word: u16) {
        match &mut self.mechanism {
            Mechanism::Leg(leg) => leg.store_word(place, word),
            Mechanism::Shaft(shaft) if place == 0 => shaft.store_word(word),
            Mechanism::Shaft(_) => {}
        }
    }

    /// Writes the values for the process: the last valid ones.
    pub(crate) fn write(&self, values: &mut [f64]) {
        match &self.mechanism {
            Mechanism::Leg(leg) => leg.write(values),
            Mechanism::Shaft(shaft) => shaft.write(values),
        }
    }

    /// Returns the number of set-points that were out of range.
    pub(crate) fn saturated(&self) -> u64 {
        match &self.mechanism {
            Mechanism::Leg(leg) => leg.saturated,
            Mechanism::Shaft(shaft) => shaft.saturated,
        }
    }

    /// Returns the number of words of magnetic encoders with a fault status.
    pub(crate) fn encoder_faults(&self) -> u64 {
        match &self.mechanism {
            Mechanism::Leg(leg) => leg.encoder_faults,
            Mechanism::Shaft(_) => 0,
        }
    }

    /// Returns the number of intervals between replies in which whole turns may have been lost.
    pub(crate) fn ambiguous(&self) -> u64 {
        match &self.mechanism {
            Mechanism::Leg(_) => 0,
            Mechanism::Shaft(shaft) => shaft.ambiguous,
        }
    }
}

impl fmt::Display for HostBoard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.mechanism {
            Mechanism::Leg(leg) => leg.fmt(f),
            Mechanism::Shaft(shaft) => shaft.fmt(f),
        }
    }
}
