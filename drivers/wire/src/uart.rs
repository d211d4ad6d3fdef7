use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, TaskError, TransmitBuffer};

use crate::{Arrivals, Line, Piece};

/// Transmit buffer of a serial port of the host, or of the chip of a USB converter (FT2232H)
/// \[bytes\].
pub(crate) const TRANSMIT_BUFFER: usize = 4096;

/// Transmitter of a UART: serialises bytes, each in 10 bit times, independently of the pace of its
/// input.
///
/// Behind a [`crate::HostEnd`] it is the host's serial port; a [`crate::UsbSerial`] contains one.
pub struct Uart<L> {
    byte_time: SimDuration,
    /// Time at which all bytes so far are transmitted.
    free_at: SimTime,
    line: L,
}

impl<L: Line> Uart<L> {
    /// A transmitter in front of `line`; a byte takes `byte_time` (start bit, 8 data bits, stop
    /// bit).
    pub fn new(byte_time: SimDuration, line: L) -> Self {
        Self {
            byte_time,
            free_at: SimTime::ZERO,
            line,
        }
    }
}

impl<L: Line> Part for Uart<L> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.line)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.line)
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.free_at, self.line.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (free_at, line): (SimTime, Snapshot) = snapshot.read()?;
        self.line.restore(&line)?;
        self.free_at = free_at;
        Ok(())
    }
}

impl<L: Line> Line for Uart<L> {
    fn send(&mut self, piece: Piece<'_>) {
        let start = piece.first.max(self.free_at);
        let mut queued = 0;
        // Bytes that arrive while others are being transmitted follow without a pause; the rest at
        // their own pace.
        while queued < piece.bytes.len()
            && (piece.spacing <= self.byte_time
                || piece.at(queued) <= start + self.byte_time * queued as u64)
        {
            queued += 1;
        }
        let (at_once, later) = piece.bytes.split_at(queued);
        for (start, spacing, bytes) in [
            (start, self.byte_time, at_once),
            (piece.at(queued), piece.spacing, later),
        ] {
            if bytes.is_empty() {
                continue;
            }
            let piece = Piece {
                first: start + self.byte_time,
                spacing,
                bytes,
                framing_error: piece.framing_error,
            };
            self.free_at = piece.last();
            self.line.send(piece);
        }
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        Some(TransmitBuffer {
            idle_from: self.free_at,
            byte_time: self.byte_time,
            capacity: TRANSMIT_BUFFER,
        })
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.line.next_wake()
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.line.advance(now, plant)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        self.line.receive(arrivals);
    }
}
