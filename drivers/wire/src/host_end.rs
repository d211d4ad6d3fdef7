use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Part, PlantAccess, TaskError, TransmitBuffer, Wire};

use crate::{
    Arrivals, Duplex, FaultSchedule, Faulty, Line, Node, Piece, Uart, UsbSerial, UsbTiming,
    WireError, earlier,
};

/// Host end of a line without USB in between: written bytes enter the line at once, to be paced by
/// a [`crate::Uart`]; received bytes are readable as soon as they are complete.
pub struct HostEnd<L> {
    line: L,
    now: SimTime,
    /// Bytes received or announced that are not read yet.
    arrived: Arrivals,
}

impl<L: Line> HostEnd<L> {
    /// The host end of `line`.
    pub fn new(line: L) -> Self {
        Self {
            line,
            now: SimTime::ZERO,
            arrived: Arrivals::default(),
        }
    }
}

impl<L: Line> Part for HostEnd<L> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.line)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.line)
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.now, &self.arrived, self.line.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (now, arrived, line): (_, _, Snapshot) = snapshot.read()?;
        self.line.restore(&line)?;
        (self.now, self.arrived) = (now, arrived);
        Ok(())
    }
}

impl<L: Line> Wire for HostEnd<L> {
    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        self.line.send(Piece {
            first: now,
            spacing: SimDuration::ZERO,
            bytes,
            framing_error: false,
        });
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        self.line.transmit_buffer()
    }

    fn next_wake(&self) -> Option<SimTime> {
        earlier(self.line.next_wake(), self.arrived.at(0))
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        // However late, the line requires all its own instants.
        while let Some(wake) = self.line.next_wake().filter(|wake| *wake < now) {
            self.line.advance(wake, plant)?;
            self.line.receive(&mut self.arrived);
        }
        self.now = now;
        self.line.advance(now, plant)?;
        self.line.receive(&mut self.arrived);
        Ok(())
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) {
        let complete = self.arrived.complete(self.now);
        self.arrived
            .take(complete, |piece| bytes.extend_from_slice(piece.bytes));
    }
}

/// Returns the wire of a device at a serial port of its own, where a byte takes `byte_time`, with
/// the faults that are on `wire/NAME`.
///
/// # Errors
/// [`WireError`] if a fault is invalid.
pub fn device_wire<N: Node>(
    byte_time: SimDuration,
    faults: &FaultSchedule,
    node: N,
) -> Result<impl Wire + use<N>, WireError> {
    let line = device_line(byte_time, faults, node)?;
    Ok(HostEnd::new(Uart::new(byte_time, line)))
}

/// Returns the wire of a device at a USB converter, as [`device_wire`] is that of one at a UART of
/// the host. The faults are between converter and device.
///
/// # Errors
/// [`WireError`] if a fault or the timing is invalid.
pub fn usb_device_wire<N: Node>(
    timing: UsbTiming,
    byte_time: SimDuration,
    faults: &FaultSchedule,
    node: N,
) -> Result<impl Wire + use<N>, WireError> {
    let name = node.name().to_owned();
    let line = device_line(byte_time, faults, node)?;
    UsbSerial::new(&name, timing, byte_time, faults.seed, line)
}

fn device_line<N: Node>(
    byte_time: SimDuration,
    faults: &FaultSchedule,
    node: N,
) -> Result<Faulty<Duplex<N>>, WireError> {
    let place = format!("wire/{}", node.name());
    Faulty::new(&place, byte_time, faults, Duplex::new(byte_time, node))
}
