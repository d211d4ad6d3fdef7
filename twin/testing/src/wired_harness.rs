//! A driver and its wire step by step, with joints that turn as they are driven.

use std::ops::Range;

use twinrig_kernel::{HostTime, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    BusWork, Driver, DriverPhase, Plant, PlantAccess, PlantFault, PlantSignals, Wire,
};

/// Rate of a joint at a duty cycle of 1 \[rad/s\].
const RATE: f64 = 5.0;

/// Joints with the inputs `NAME/duty` and `NAME/bridge` and the outputs `NAME/position` and
/// `NAME/rate`, which turn at 5 rad/s at a duty cycle of 1: a plant, or access to it.
pub struct Joints {
    ports: Vec<Port>,
    now: SimTime,
    advanced: SimTime,
    /// Duty cycle and bridge of each.
    pub inputs: Vec<f64>,
    /// Angle and rate of each.
    pub outputs: Vec<f64>,
}

impl Joints {
    /// Creates joints with these names at angle 0, and their signals.
    pub fn new(names: &[String]) -> (Self, PlantSignals) {
        let of = |name: &String| {
            [
                Port::input(format!("{name}/duty"), Unit::One, 1),
                Port::input(format!("{name}/bridge"), Unit::One, 1),
                Port::output(format!("{name}/position"), Unit::Radian, 1),
                Port::output(format!("{name}/rate"), Unit::RadianPerSecond, 1),
            ]
        };
        let ports: Vec<Port> = names.iter().flat_map(of).collect();
        let signals = PlantSignals::of(&ports);
        let joints = Self {
            ports,
            now: SimTime::ZERO,
            advanced: SimTime::ZERO,
            inputs: vec![0.0; signals.inputs.len()],
            outputs: vec![0.0; signals.outputs.len()],
        };
        (joints, signals)
    }

    /// Turns the joints up to the present.
    fn turn(&mut self) {
        let seconds = (self.now - self.advanced).as_secs_f64();
        self.advanced = self.now;
        let (outputs, _) = self.outputs.as_chunks_mut::<2>();
        let (inputs, _) = self.inputs.as_chunks::<2>();
        for ([angle, rate], [duty, closed]) in outputs.iter_mut().zip(inputs) {
            *rate = RATE * duty * closed;
            *angle += *rate * seconds;
        }
    }
}

impl PlantAccess for Joints {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        self.turn();
        Ok(&self.outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        self.turn();
        Ok(&mut self.inputs[signals])
    }
}

impl Plant for Joints {
    fn name(&self) -> &'static str {
        "joints"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        inputs.copy_from_slice(&self.inputs);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.inputs.copy_from_slice(inputs);
        self.now = to;
        self.turn();
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&self.outputs);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.now, self.advanced, &self.inputs, &self.outputs))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.now, self.advanced, self.inputs, self.outputs) = snapshot.read()?;
        Ok(())
    }
}

/// Driver, wire and joints.
pub struct WiredHarness<D, W> {
    /// The driver.
    pub driver: D,
    /// The wire.
    pub wire: W,
    /// The joints.
    pub joints: Joints,
    /// Present time.
    pub now: SimTime,
    tx: Vec<u8>,
    rx: Vec<u8>,
}

impl<D: Driver, W: Wire> WiredHarness<D, W> {
    /// Connects a wire to joints with these names.
    pub fn new(driver: D, mut wire: W, joints: &[String]) -> Self {
        let (joints, signals) = Joints::new(joints);
        wire.connect("test", &signals).unwrap();
        Self {
            driver,
            wire,
            joints,
            now: SimTime::ZERO,
            tx: Vec::new(),
            rx: Vec::new(),
        }
    }

    /// Returns the present time of the driver.
    fn host(&self) -> HostTime {
        HostTime::from_nanos(self.now.as_nanos())
    }

    fn write(&mut self) {
        self.tx.clear();
        while self.driver.poll_transmit(&mut self.tx) {
            self.wire.send(self.now, &self.tx);
            self.tx.clear();
        }
    }

    /// Advances to the next event, at most to `until`; returns whether there was one.
    fn step(&mut self, until: SimTime) -> bool {
        let timeout = self.driver.poll_timeout();
        let timeout = timeout.map(|it| SimTime::from_nanos(it.as_nanos()));
        let wakes = [self.wire.next_wake(), timeout].into_iter().flatten();
        let next = wakes.min().unwrap_or(until).max(self.now);
        self.now = next.min(until);
        self.joints.now = self.now;
        self.wire.advance(self.now, &mut self.joints).unwrap();
        if next >= until {
            return false;
        }
        self.rx.clear();
        self.wire.receive(&mut self.rx);
        let now = self.host();
        if !self.rx.is_empty() {
            self.driver.handle_bytes(now, &self.rx);
        }
        self.driver.handle_timeout(now);
        self.write();
        true
    }

    /// Advances to an instant.
    pub fn run_until(&mut self, until: SimTime) {
        self.write();
        while self.step(until) {}
    }

    /// Advances until the driver is idle, for at most 10 s.
    fn run_until_idle(&mut self) -> Result<(), String> {
        let until = self.now + SimDuration::from_secs(10);
        self.write();
        while self.driver.is_busy().map_err(|error| error.why)? {
            assert!(self.step(until), "the driver is busy for 10 s");
        }
        Ok(())
    }

    /// Opens the driver.
    pub fn open(&mut self) -> Result<(), String> {
        self.wire.begin_phase(self.now, DriverPhase::Opening);
        self.driver.open(self.host());
        self.run_until_idle()
    }

    /// Closes the driver, and lets the devices act for 10 ms.
    pub fn close(&mut self) -> Result<(), String> {
        self.driver.close(self.host());
        self.run_until_idle()?;
        self.run_until(self.now + SimDuration::from_millis(10));
        Ok(())
    }

    /// Transfers commands, and returns the duration.
    pub fn transfer(&mut self, commands: &[f64]) -> SimDuration {
        self.try_transfer(commands).unwrap()
    }

    /// Transfers commands, and returns the duration, or the failure of the driver.
    pub fn try_transfer(&mut self, commands: &[f64]) -> Result<SimDuration, String> {
        let start = self.now;
        self.wire.begin_phase(self.now, DriverPhase::Transfer);
        self.driver.begin(self.host(), commands);
        self.run_until_idle()?;
        Ok(self.now - start)
    }

    /// Transfers the same commands once in each period.
    pub fn transfers(&mut self, count: u32, period: SimDuration, commands: &[f64]) {
        for _ in 0..count {
            let next = self.now + period;
            self.transfer(commands);
            self.run_until(next.max(self.now));
        }
    }

    /// Returns the diagnostic of the driver with this name.
    pub fn diagnostic(&self, name: &str) -> f64 {
        let ports = self.driver.diagnostics();
        let place = ports.iter().position(|port| port.name == name);
        let mut values = vec![0.0; ports.len()];
        self.driver.read_diagnostics(&mut values);
        values[place.expect("the driver has the diagnostic")]
    }

    /// Returns the work of the wire.
    pub fn work(&self) -> BusWork {
        let mut work = BusWork::default();
        self.wire.count_work(&mut work);
        work
    }
}
