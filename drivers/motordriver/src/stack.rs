use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, TransmitBuffer, WiringError, World};
use twinrig_wire::{Arrivals, Line, Piece};

/// Lines around lines, as the configuration of a bus puts them together.
pub struct Stack(Box<dyn Line>);

impl Stack {
    pub(crate) fn of(line: impl Line + 'static) -> Self {
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

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        self.0.advance(now, world)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        self.0.receive(arrivals);
    }

    fn gauges(&self) -> Vec<Port> {
        self.0.gauges()
    }

    fn read_gauges(&self, now: SimTime, values: &mut [f64]) {
        self.0.read_gauges(now, values);
    }

    fn lanes(&self) -> Vec<String> {
        self.0.lanes()
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
