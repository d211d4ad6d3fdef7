//! Test harness that steps a driver and an emulated device without wire and rig, to check the bytes
//! and their times. Included by the tests of each driver crate.
#![allow(dead_code, reason = "each test uses some of it")]

use std::ops::Range;

use twinrig_kernel::{Direction, HostTime, Layout, Port, SimDuration, SimTime};
use twinrig_runtime::{Driver, PlantFault, PlantSignals, Transfer};
use twinrig_wire::{Node, Piece};

/// Driver with its present time.
pub struct Host<D> {
    pub driver: D,
    now: HostTime,
}

impl<D: Driver> Host<D> {
    pub fn new(driver: D) -> Self {
        let now = HostTime::from_nanos(1_000_000);
        Self { driver, now }
    }

    pub fn open(&mut self) -> Vec<u8> {
        self.driver.open(self.now);
        self.written()
    }

    pub fn begin(&mut self, from_process: &[f64]) -> Vec<u8> {
        self.driver.begin(self.now, from_process);
        self.written()
    }

    pub fn close(&mut self) -> Vec<u8> {
        self.driver.close(self.now);
        self.written()
    }

    /// Advances time by `later` and passes bytes to the driver.
    pub fn reads(&mut self, later: SimDuration, bytes: &[u8]) {
        self.now = HostTime::from_nanos(self.now.as_nanos() + later.as_nanos());
        self.driver.handle_bytes(self.now, bytes);
    }

    /// Returns the time until the driver's time-out; `None` without one.
    pub fn waits(&self) -> Option<SimDuration> {
        let until = self.driver.poll_timeout()?;
        Some(SimDuration::from_nanos(
            until.as_nanos() - self.now.as_nanos(),
        ))
    }

    /// Advances time to the time-out and returns the bytes that the driver writes then.
    pub fn waits_in_vain(&mut self) -> Vec<u8> {
        self.now = self.driver.poll_timeout().expect("it waits");
        self.driver.handle_timeout(self.now);
        self.written()
    }

    pub fn is_done(&mut self) -> bool {
        self.driver.poll_transfer() == Ok(Transfer::Done)
    }

    pub fn diagnostic(&self, name: &str) -> f64 {
        let diagnostics = self.driver.diagnostics();
        let place = diagnostics
            .iter()
            .position(|diagnostic| diagnostic.name.ends_with(name));
        let mut values = vec![0.0; diagnostics.len()];
        self.driver.read_diagnostics(&mut values);
        values[place.expect("there is such a gauge")]
    }

    fn written(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        while self.driver.poll_transmit(&mut bytes) {}
        bytes
    }
}

/// Inputs and outputs of a static plant.
#[derive(Default)]
pub struct Still {
    pub outputs: Vec<f64>,
    pub inputs: Vec<f64>,
}

impl twinrig_runtime::PlantAccess for Still {
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
pub fn says(
    node: &mut impl Node,
    plant: &mut Still,
    (at, bytes): (SimTime, &[u8]),
    to: SimTime,
) -> Vec<(SimTime, Vec<u8>)> {
    let mut said = Vec::new();
    let mut advance = |node: &mut dyn Node, now: SimTime| {
        node.advance(now, plant).expect("the plant is well");
        let mut bytes = Vec::new();
        while let Some(start) = node.poll_transmit(&mut bytes) {
            said.push((start, std::mem::take(&mut bytes)));
        }
    };
    let mut heard = false;
    loop {
        let own = node.next_wake().unwrap_or(SimTime::MAX);
        if !heard && at <= own {
            heard = true;
            node.receive(Piece {
                first: at,
                spacing: SimDuration::ZERO,
                bytes,
                framing_error: false,
            });
            advance(node, at);
        } else if own <= to {
            advance(node, own);
        } else {
            return said;
        }
    }
}
