//! A controller whose commands do not all go anywhere.

use twinrig_kernel::{Direction, Layout, Port, SimDuration, Snapshot, SnapshotError};
use twinrig_runtime::{Process, ProcessVariable, VariableError};

/// A process some of whose outputs nobody takes: at hardware, those that no bus carries.
pub(crate) struct OutputFilter {
    process: Box<dyn Process>,
    ports: Vec<Port>,
    /// All that the process writes.
    written: Vec<f64>,
    /// Where of it stands what is taken, in order.
    taken: Vec<std::ops::Range<usize>>,
}

impl OutputFilter {
    /// `process`, of whose outputs those are left that `takes` wants; and the names of the others.
    pub(crate) fn new(
        process: Box<dyn Process>,
        takes: impl Fn(&Port) -> bool,
    ) -> (Self, Vec<String>) {
        let ports = process.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let lost = |port: &&Port| port.direction == Direction::Output && !takes(port);
        let names = ports.iter().filter(lost).map(|port| port.name.clone());
        let names = names.collect();
        let fields = layout.fields().filter(|field| takes(&field.port));
        let output_filter = Self {
            taken: fields.map(twinrig_kernel::Field::range).collect(),
            written: vec![0.0; layout.len()],
            ports: ports.into_iter().filter(|port| !lost(&port)).collect(),
            process,
        };
        (output_filter, names)
    }
}

impl Process for OutputFilter {
    fn name(&self) -> &str {
        self.process.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn variables(&self) -> &[ProcessVariable] {
        self.process.variables()
    }

    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        self.process.set_variable(index, value)
    }

    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        self.process.step(elapsed, inputs, &mut self.written);
        let mut rest = outputs;
        for range in &self.taken {
            let (front, behind) = rest.split_at_mut(range.len());
            front.copy_from_slice(&self.written[range.clone()]);
            rest = behind;
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.written, self.process.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (written, process): (Vec<f64>, Snapshot) = snapshot.read()?;
        self.process.restore(&process)?;
        self.written = written;
        Ok(())
    }
}
