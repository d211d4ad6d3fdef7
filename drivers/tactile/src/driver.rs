use twinrig_kernel::{Direction, HostTime, Layout, Port, SimDuration, Snapshot, SnapshotError};
use twinrig_runtime::{BusHealth, Driver, DriverError};
use twinrig_wire::{Diagnostics, FramedDriver};

use crate::{Stage, Tactile, TactileAcquisition, TactileError};

/// Driver of the board: starts it, maps the stamps of its samples to host time, and passes every
/// sample to the stages.
///
/// Opening lasts until the board has acknowledged its commands and sent a sample. A board that is
/// silent for 20 periods is started again; its restart is noticed by its boot number, or by a stamp
/// that jumps back. Once a second the board is sent the host time of one of its stamps.
///
/// The output ports of the driver come first, then those of the stages in the order of mounting.
pub struct TactileDriver {
    framed: FramedDriver<TactileAcquisition>,
    stages: Vec<Mounted>,
    /// Outputs to the process: channels, then stages.
    outputs: Vec<f64>,
    /// Number of diagnostics without those of the stages.
    framed_diagnostics: usize,
}

/// A stage with the numbers of its signals.
struct Mounted {
    stage: Box<dyn Stage>,
    inputs: usize,
    diagnostics: usize,
}

impl Mounted {
    /// Returns the ports of the diagnostics: the outputs, which the process need not read, and the
    /// reported ones.
    fn diagnostics(&self, owner: &str) -> Vec<Port> {
        let mut ports = self.stage.ports();
        ports.retain(|port| port.direction == Direction::Output);
        let report = |diagnostics: &mut Diagnostics<'_>| self.stage.report(diagnostics);
        ports.extend(Diagnostics::ports(owner, report));
        ports
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        let (outputs, reported) = values.split_at_mut(self.stage.outputs().len());
        outputs.copy_from_slice(self.stage.outputs());
        Diagnostics::read(reported, |diagnostics| self.stage.report(diagnostics));
    }
}

/// Returns the number of values of ports of one direction.
fn width(ports: &[Port], direction: Direction) -> usize {
    Layout::of(ports, direction).len()
}

impl TactileDriver {
    /// Creates the driver of a checked configuration.
    pub(crate) fn new(protocol: TactileAcquisition) -> Self {
        let framed = FramedDriver::new(protocol);
        Self {
            framed_diagnostics: width(&framed.diagnostics(), Direction::Output),
            outputs: framed.to_process().to_vec(),
            framed,
            stages: Vec::new(),
        }
    }

    /// Mounts a stage behind those mounted before; all of them receive every sample.
    ///
    /// # Panics
    /// If the length of [`Stage::outputs`] differs from that of its output ports.
    #[must_use]
    pub fn with_stage(mut self, stage: Box<dyn Stage>) -> Self {
        let (ports, values) = (stage.ports(), stage.outputs().len());
        let outputs = width(&ports, Direction::Output);
        assert_eq!(
            values,
            outputs,
            "{}: a stage returns {values} numbers, but its output ports hold {outputs}",
            self.name()
        );
        let mut mounted = Mounted {
            inputs: width(&ports, Direction::Input),
            diagnostics: 0,
            stage,
        };
        mounted.diagnostics = width(&mounted.diagnostics(self.name()), Direction::Output);
        self.stages.push(mounted);
        self.collect();
        self
    }

    /// Passes the new samples to the stages.
    fn process_samples(&mut self) {
        let samples = &mut self.framed.protocol_mut().1.samples;
        for sample in &*samples {
            for mounted in &mut self.stages {
                mounted.stage.handle_sample(sample);
            }
        }
        samples.clear();
        self.collect();
    }

    /// Collects the outputs to the process.
    fn collect(&mut self) {
        self.outputs.clear();
        self.outputs.extend_from_slice(self.framed.to_process());
        for mounted in &self.stages {
            self.outputs.extend_from_slice(mounted.stage.outputs());
        }
    }
}

impl Driver for TactileDriver {
    fn name(&self) -> &str {
        self.framed.name()
    }

    fn ports(&self) -> Vec<Port> {
        let stages = self.stages.iter().flat_map(|mounted| mounted.stage.ports());
        self.framed.ports().into_iter().chain(stages).collect()
    }

    fn open(&mut self, now: HostTime) {
        self.framed.open(now);
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        let mut rest = from_process;
        for mounted in &mut self.stages {
            let inputs;
            (inputs, rest) = rest.split_at(mounted.inputs.min(rest.len()));
            mounted.stage.begin_transfer(now, inputs);
        }
        self.framed.begin(now, &[]);
        self.collect();
    }

    fn close(&mut self, now: HostTime) {
        self.framed.close(now);
    }

    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        self.framed.protocol_mut().1.now = now;
        self.framed.handle_bytes(now, bytes);
        if !self.framed.state().samples.is_empty() {
            self.process_samples();
        }
    }

    fn handle_timeout(&mut self, now: HostTime) {
        self.framed.handle_timeout(now);
        let (protocol, state) = self.framed.protocol_mut();
        protocol.handle_silence(state, now);
    }

    fn poll_timeout(&self) -> Option<HostTime> {
        let silent_at = self.framed.state().silent_at;
        match (self.framed.poll_timeout(), silent_at) {
            (Some(request), Some(silent_at)) => Some(request.min(silent_at)),
            (request, silent_at) => request.or(silent_at),
        }
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        if self.framed.poll_transmit(bytes) {
            return true;
        }
        let unsolicited = &mut self.framed.protocol_mut().1.unsolicited;
        let any = !unsolicited.is_empty();
        bytes.append(unsolicited);
        any
    }

    fn is_busy(&self) -> Result<bool, DriverError> {
        self.framed.is_busy()
    }

    fn to_process(&self) -> &[f64] {
        &self.outputs
    }

    fn diagnostics(&self) -> Vec<Port> {
        let mut ports = self.framed.diagnostics();
        for mounted in &self.stages {
            ports.extend(mounted.diagnostics(self.name()));
        }
        ports
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        let (framed, mut rest) = values.split_at_mut(self.framed_diagnostics.min(values.len()));
        self.framed.read_diagnostics(framed);
        for mounted in &self.stages {
            let values;
            (values, rest) = rest.split_at_mut(mounted.diagnostics.min(rest.len()));
            mounted.read_diagnostics(values);
        }
    }

    fn period(&self) -> Option<SimDuration> {
        self.framed.period()
    }

    fn bus_health(&self, now: HostTime) -> Option<BusHealth> {
        self.framed.bus_health(now)
    }

    fn save(&self) -> Snapshot {
        let stages = self.stages.iter().map(|mounted| mounted.stage.save());
        Snapshot::of(&(self.framed.save(), stages.collect::<Vec<_>>()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (framed, stages): (Snapshot, Vec<Snapshot>) = snapshot.read()?;
        if stages.len() != self.stages.len() {
            return Err(SnapshotError::Mismatch {
                expected: format!("{} with {} stages", self.name(), self.stages.len()),
                found: format!("a driver with {} stages", stages.len()),
            });
        }
        self.framed.restore(&framed)?;
        for (mounted, stage) in self.stages.iter_mut().zip(&stages) {
            mounted.stage.restore(stage)?;
        }
        self.collect();
        Ok(())
    }
}

impl Tactile {
    /// Creates the driver, which runs on the robot, without stages.
    ///
    /// # Errors
    /// [`TactileError`] if the configuration is invalid.
    pub fn driver(&self) -> Result<TactileDriver, TactileError> {
        self.check()?;
        Ok(TactileDriver::new(TactileAcquisition::new(self.clone())))
    }
}
