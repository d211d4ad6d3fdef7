use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Process, ProcessVariable};

/// Process that reads `NAME/sample` of every channel (number of the transfer, value), writes
/// `NAME/command`, and sums the elapsed times. The first command is that sum in nanoseconds.
pub struct ToyProcess {
    ports: Vec<Port>,
    variables: Vec<ProcessVariable>,
    elapsed_ns: u64,
    memory: f64,
}

impl ToyProcess {
    pub fn new(names: &[String]) -> Self {
        let sample = |name: &String| Port::input(format!("{name}/sample"), Unit::One, 2);
        let command = |name: &String| Port::output(format!("{name}/command"), Unit::Volt, 1);
        Self {
            ports: names
                .iter()
                .map(sample)
                .chain(names.iter().map(command))
                .collect(),
            variables: vec![
                ProcessVariable::new("gain", Unit::One, 0.0..=1.0, 0.5),
                ProcessVariable::new("offset", Unit::Volt, .., 0.0),
            ],
            elapsed_ns: 0,
            memory: 0.0,
        }
    }
}

impl Process for ToyProcess {
    fn name(&self) -> &'static str {
        "toy process"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        &mut self.variables
    }

    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        self.elapsed_ns += elapsed.as_nanos();
        let (gain, offset) = (self.variables[0].value(), self.variables[1].value());
        for (sample, output) in inputs.chunks_exact(2).zip(&mut *outputs) {
            self.memory = 0.9 * self.memory + sample[1];
            *output = offset - gain * sample[1] + 0.01 * self.memory;
        }
        #[expect(clippy::cast_precision_loss, reason = "runs of milliseconds")]
        if let Some(first) = outputs.first_mut() {
            *first = self.elapsed_ns as f64;
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.variables, self.elapsed_ns, self.memory))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.variables, self.elapsed_ns, self.memory) = snapshot.read()?;
        Ok(())
    }
}
