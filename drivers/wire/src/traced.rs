use twinrig_kernel::SimTime;
use twinrig_runtime::{Part, PlantAccess, TaskError, TrafficLog, TransmitBuffer};

use crate::{Arrivals, Line, Piece};

/// Line that records its bytes in two traces: `NAME/out` away from the near end, `NAME/in` towards
/// it. Tracing does not change the simulation: undrained bytes are not part of a snapshot.
pub struct Traced<L> {
    name: String,
    line: L,
    arrived: Arrivals,
    traffic: TrafficLog,
}

/// Indices of the tracer's own traces, which precede those of its line.
const OUT: usize = 0;
const IN: usize = 1;
const OWN_TRACES: usize = 2;

impl<L: Line> Traced<L> {
    /// Traces `line`; with the name `rs485` in a task `sbcp`, the traces are `sbcp/rs485/out` and
    /// `sbcp/rs485/in`.
    pub fn new(name: impl Into<String>, line: L) -> Self {
        Self {
            name: name.into(),
            line,
            arrived: Arrivals::default(),
            traffic: TrafficLog::default(),
        }
    }
}

impl<L: Line> Part for Traced<L> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.line)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.line)
    }

    fn traces(&self) -> Vec<String> {
        let own_traces = ["out", "in"].map(|direction| format!("{}/{direction}", self.name));
        own_traces.into_iter().chain(self.line.traces()).collect()
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        self.traffic.drain(passed);
        self.line
            .drain_traffic(&mut |trace, bytes| passed(OWN_TRACES + trace, bytes));
    }
}

impl<L: Line> Line for Traced<L> {
    fn send(&mut self, piece: Piece<'_>) {
        self.traffic.record(OUT, piece.bytes);
        self.line.send(piece);
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        self.line.transmit_buffer()
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.line.next_wake()
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.line.advance(now, plant)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        let mut arrived = std::mem::take(&mut self.arrived);
        self.line.receive(&mut arrived);
        self.traffic.record(IN, arrived.bytes());
        arrivals.append(&mut arrived);
        self.arrived = arrived;
    }
}
