use std::time::Duration;

use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_runtime::{Process, ProcessVariable};

use super::ports;

/// Process whose outputs are the sum of the elapsed milliseconds and each driver's last half.
pub struct Summing {
    names: Vec<String>,
    offset: [ProcessVariable; 1],
    milliseconds: f64,
    iterations: u64,
    /// Wall-clock time of an iteration.
    pub takes: Duration,
    /// Panics at this iteration.
    pub panics_at: Option<u64>,
}

impl Summing {
    /// Creates a process for the drivers with these names.
    pub fn new(names: &[&str]) -> Self {
        Self {
            names: names.iter().map(ToString::to_string).collect(),
            offset: [ProcessVariable::new("offset", Unit::One, .., 0.0)],
            milliseconds: 0.0,
            iterations: 0,
            takes: Duration::ZERO,
            panics_at: None,
        }
    }
}

impl Process for Summing {
    fn name(&self) -> &'static str {
        "summing"
    }
    fn ports(&self) -> Vec<Port> {
        let ports = self.names.iter().flat_map(|name| ports(name));
        ports.map(|port| port.mirrored()).collect()
    }
    fn variables(&self) -> &[ProcessVariable] {
        &self.offset
    }
    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        &mut self.offset
    }
    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        self.iterations += 1;
        assert_ne!(
            self.panics_at,
            Some(self.iterations),
            "requested by the test"
        );
        self.milliseconds += elapsed.as_secs_f64() * 1000.0;
        for (output, half) in outputs.iter_mut().zip(inputs) {
            *output = self.milliseconds + half + self.offset[0].value();
        }
        if !self.takes.is_zero() {
            std::thread::sleep(self.takes);
        }
    }
}
