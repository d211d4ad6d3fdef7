//! A driver and an emulated device step by step, to check the bytes and their times.

use std::ops::Range;

use twinrig_kernel::{Direction, HostTime, Layout, Port, SimDuration, SimTime};
use twinrig_runtime::{Driver, PlantFault, PlantSignals};
use twinrig_wire::{Node, Piece};

/// Driver with its present time.
pub struct DriverHarness<D> {
    /// The driver.
    pub driver: D,
    now: HostTime,
}

impl<D: Driver> DriverHarness<D> {
    /// Creates a harness at a time after zero.
    pub fn new(driver: D) -> Self {
        let now = HostTime::from_nanos(1_000_000);
        Self { driver, now }
    }

    /// Opens the driver and returns the bytes that it writes.
    pub fn open(&mut self) -> Vec<u8> {
        self.driver.open(self.now);
        self.written()
    }

    /// Begins a transfer and returns the bytes that the driver writes.
    pub fn begin(&mut self, from_process: &[f64]) -> Vec<u8> {
        self.driver.begin(self.now, from_process);
        self.written()
    }

    /// Closes the driver and returns the bytes that it writes.
    pub fn close(&mut self) -> Vec<u8> {
        self.driver.close(self.now);
        self.written()
    }

    /// Advances time by `later` and passes bytes to the driver.
    pub fn receive(&mut self, later: SimDuration, bytes: &[u8]) {
        self.now = self.now + later;
        self.driver.handle_bytes(self.now, bytes);
    }

    /// Returns the time until the driver's time-out; `None` without one.
    pub fn timeout(&self) -> Option<SimDuration> {
        let until = self.driver.poll_timeout()?;
        Some(SimDuration::from_nanos(
            until.as_nanos() - self.now.as_nanos(),
        ))
    }

    /// Advances time to the time-out and returns the bytes that the driver writes then.
    pub fn expire(&mut self) -> Vec<u8> {
        self.now = self
            .driver
            .poll_timeout()
            .expect("the driver has a time-out");
        self.driver.handle_timeout(self.now);
        self.written()
    }

    /// Returns whether the transfer is done.
    pub fn is_done(&mut self) -> bool {
        self.driver.is_busy() == Ok(false)
    }

    /// Returns the diagnostic whose name ends so.
    pub fn diagnostic(&self, name: &str) -> f64 {
        let diagnostics = self.driver.diagnostics();
        let place = diagnostics
            .iter()
            .position(|diagnostic| diagnostic.name.ends_with(name));
        let mut values = vec![0.0; diagnostics.len()];
        self.driver.read_diagnostics(&mut values);
        values[place.expect("the driver has the diagnostic")]
    }

    fn written(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        while self.driver.poll_transmit(&mut bytes) {}
        bytes
    }
}

/// Inputs and outputs of a static plant.
#[derive(Default)]
pub struct StaticPlant {
    /// Values of the outputs.
    pub outputs: Vec<f64>,
    /// Values of the inputs.
    pub inputs: Vec<f64>,
}

impl twinrig_runtime::PlantAccess for StaticPlant {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        Ok(&self.outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut self.inputs[signals])
    }
}

/// Returns the signals of a plant with these ports.
pub fn plant(ports: &[Port]) -> PlantSignals {
    PlantSignals {
        inputs: Layout::of(ports, Direction::Input),
        outputs: Layout::of(ports, Direction::Output),
    }
}

/// Advances a device until `to`, with `bytes` received at `at`, and returns its transmissions with
/// their start times.
pub fn run_device(
    node: &mut impl Node,
    plant: &mut StaticPlant,
    (at, bytes): (SimTime, &[u8]),
    to: SimTime,
) -> Vec<(SimTime, Vec<u8>)> {
    let mut transmitted = Vec::new();
    let mut advance = |node: &mut dyn Node, now: SimTime| {
        node.advance(now, plant).expect("the plant does not fail");
        let mut bytes = Vec::new();
        while let Some(start) = node.poll_transmit(&mut bytes) {
            transmitted.push((start, std::mem::take(&mut bytes)));
        }
    };
    let mut received = false;
    loop {
        let wake = node.next_wake().unwrap_or(SimTime::MAX);
        if !received && at <= wake {
            received = true;
            node.receive(Piece {
                first: at,
                spacing: SimDuration::ZERO,
                bytes,
                framing_error: false,
            });
            advance(node, at);
        } else if wake <= to {
            advance(node, wake);
        } else {
            return transmitted;
        }
    }
}
