use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, TransmitBuffer, WiringError};

use crate::{Arrivals, Line, Piece};

/// Hands what passes to the recording, on two lanes: `NAME/out` away from the near end, `NAME/in` towards it.
/// Looking on changes nothing: what was not handed over yet is no part of a snapshot.
pub struct Traced<L> {
    name: String,
    line: L,
    arrived: Arrivals,
    /// What has passed and was not handed over yet, in buffers that are used again.
    traffic: Vec<(usize, Vec<u8>)>,
    passed: usize,
}

/// Lanes of the tracer itself, before those of its line.
const OUT: usize = 0;
const IN: usize = 1;
const OWN_LANES: usize = 2;

impl<L: Line> Traced<L> {
    /// Around `line`; `rs485`, within a task `sbcp`, becomes `sbcp/rs485/out` and `sbcp/rs485/in`.
    pub fn new(name: impl Into<String>, line: L) -> Self {
        Self {
            name: name.into(),
            line,
            arrived: Arrivals::default(),
            traffic: Vec::new(),
            passed: 0,
        }
    }

    fn note(&mut self, trace: usize, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        if self.passed == self.traffic.len() {
            self.traffic.push((trace, Vec::new()));
        }
        let (of, noted) = &mut self.traffic[self.passed];
        *of = trace;
        noted.clear();
        noted.extend_from_slice(bytes);
        self.passed += 1;
    }
}

impl<L: Line> Line for Traced<L> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)
    }

    fn send(&mut self, piece: Piece<'_>) {
        self.note(OUT, piece.bytes);
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
        self.note(IN, arrived.bytes());
        arrivals.append(&mut arrived);
        self.arrived = arrived;
    }

    fn diagnostics(&self) -> Vec<Port> {
        self.line.diagnostics()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        self.line.read_diagnostics(now, values);
    }

    fn traces(&self) -> Vec<String> {
        let own = ["out", "in"].map(|way| format!("{}/{way}", self.name));
        own.into_iter().chain(self.line.traces()).collect()
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        for (trace, bytes) in &self.traffic[..self.passed] {
            passed(*trace, bytes);
        }
        self.passed = 0;
        self.line
            .drain_traffic(&mut |trace, bytes| passed(OWN_LANES + trace, bytes));
    }

    fn save(&self) -> Snapshot {
        self.line.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.line.restore(snapshot)
    }
}
