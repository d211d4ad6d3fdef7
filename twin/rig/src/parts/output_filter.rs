//! Filter for controller outputs that no part receives.

use twinrig_kernel::{Direction, Layout, Port, SimDuration, Snapshot, SnapshotError};
use twinrig_runtime::{LimitViolation, Process, ProcessVariable, VariableError};

/// Process with only those outputs that are received; on hardware, the outputs that a bus carries.
pub(crate) struct OutputFilter {
    process: Box<dyn Process>,
    ports: Vec<Port>,
    /// All outputs of the process.
    outputs: Vec<f64>,
    /// Ranges of the received outputs, in order.
    received: Vec<std::ops::Range<usize>>,
}

impl OutputFilter {
    /// Keeps the outputs of `process` for which `receives` holds, and its monitors; also returns
    /// the names of the removed outputs.
    pub(crate) fn new(
        process: Box<dyn Process>,
        receives: impl Fn(&Port) -> bool,
    ) -> (Self, Vec<String>) {
        let ports = process.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let kept = |port: &Port| receives(port) || process.is_monitor(&port.name);
        let removed = |port: &&Port| port.direction == Direction::Output && !kept(port);
        let names = ports.iter().filter(removed).map(|port| port.name.clone());
        let names = names.collect();
        let fields = layout.fields().filter(|field| kept(&field.port));
        let received = fields.map(twinrig_kernel::Field::range).collect();
        let kept_ports = ports.iter().filter(|port| !removed(port));
        let output_filter = Self {
            received,
            outputs: vec![0.0; layout.len()],
            ports: kept_ports.cloned().collect(),
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

    fn is_monitor(&self, output: &str) -> bool {
        self.process.is_monitor(output)
    }

    fn limit_violations(&self) -> Vec<LimitViolation> {
        self.process.limit_violations()
    }

    fn variables(&self) -> &[ProcessVariable] {
        self.process.variables()
    }

    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        self.process.set_variable(index, value)
    }

    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        self.process.step(elapsed, inputs, &mut self.outputs);
        let mut rest = outputs;
        for range in &self.received {
            let (front, behind) = rest.split_at_mut(range.len());
            front.copy_from_slice(&self.outputs[range.clone()]);
            rest = behind;
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.outputs, self.process.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (outputs, process): (Vec<f64>, Snapshot) = snapshot.read()?;
        self.process.restore(&process)?;
        self.outputs = outputs;
        Ok(())
    }
}
