use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, TransmitBuffer, WiringError};
use twinrig_wire::{Arrivals, Line, Piece};

/// Nested transport layers of a bus, built according to its configuration.
pub struct Stack(Box<dyn Line>);

impl Stack {
    pub(crate) fn new(line: impl Line + 'static) -> Self {
        Self(Box::new(line))
    }
}

impl Line for Stack {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.0.connect(owner, plant)
    }

    fn send(&mut self, piece: Piece<'_>) {
        self.0.send(piece);
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        self.0.transmit_buffer()
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.0.next_wake()
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.0.advance(now, plant)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        self.0.receive(arrivals);
    }

    fn diagnostics(&self) -> Vec<Port> {
        self.0.diagnostics()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        self.0.read_diagnostics(now, values);
    }

    fn traces(&self) -> Vec<String> {
        self.0.traces()
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        self.0.drain_traffic(passed);
    }

    fn save(&self) -> Snapshot {
        self.0.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.0.restore(snapshot)
    }
}
