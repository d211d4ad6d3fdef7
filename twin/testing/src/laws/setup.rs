use std::rc::Rc;

use twinrig_kernel::{Direction, HostTime, Layout, Port, SimDuration};
use twinrig_runtime::{Driver, Wire};
use twinrig_wire::{Duplex, HostEnd, Line, Node, Rs485, Uart};

use super::{Case, Damage, Detection};

/// Outputs of the plant, by level and component.
pub(super) type Levels = Rc<dyn Fn(usize, usize) -> f64>;

/// Devices of a bus.
pub type Nodes = Vec<Box<dyn Node>>;

/// A driver and its devices, to which the laws are applied: makers of both, the plant that the
/// devices measure, and the bounds that the driver promises.
pub struct DeviceSetup<D> {
    pub(super) driver: Box<dyn Fn() -> D>,
    pub(super) nodes: Box<dyn Fn() -> Nodes>,
    pub(super) wire: Box<dyn Fn(Nodes) -> Box<dyn Wire>>,
    pub(super) byte_time: SimDuration,
    pub(super) ports: Vec<Port>,
    pub(super) levels: Levels,
    pub(super) commands: Box<dyn Fn(usize, usize) -> f64>,
    pub(super) period: SimDuration,
    pub(super) recovery: usize,
    pub(super) deadline: SimDuration,
    pub(super) transfer_deadline: SimDuration,
    pub(super) state_bytes: usize,
    pub(super) detection: Detection,
    pub(super) spacing: usize,
    pub(super) numbers_answers: bool,
    pub(super) foreign: Vec<Vec<u8>>,
    pub(super) traffic: fn(&D, HostTime) -> Traffic,
}

/// Traffic as a driver has counted it since its creation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Answers and frames accepted.
    pub accepted: u64,
    /// Answers and frames that are missing: time-outs, gaps in sequence numbers.
    pub missing: u64,
    /// Frames and bytes that were discarded: damaged, unexpected, outside frames.
    pub discarded: u64,
}

impl Traffic {
    /// Returns the traffic by [`Driver::bus_health`]: errors that report an absence are missing
    /// frames, all others discarded ones.
    ///
    /// # Panics
    /// If the driver reports none.
    pub fn of_health<D: Driver>(driver: &D, now: HostTime) -> Self {
        let health = driver.bus_health(now);
        let health =
            health.expect("a driver without `bus_health`: see `DeviceSetup::with_traffic`");
        let mut traffic = Self {
            accepted: health.answers,
            ..Self::default()
        };
        for error in &health.errors {
            match error.kind {
                "no answer" | "lost frame" => traffic.missing += error.count,
                _ => traffic.discarded += error.count,
            }
        }
        traffic
    }

    /// Returns the traffic by the diagnostics of a driver, whose names end so: those of accepted,
    /// of missing and of discarded frames.
    ///
    /// # Panics
    /// If the driver has no such diagnostic.
    pub fn of_diagnostics<D: Driver>(driver: &D, names: [&[&str]; 3]) -> Self {
        let diagnostics = driver.diagnostics();
        let layout = Layout::of(&diagnostics, Direction::Output);
        let mut values = vec![0.0; layout.len()];
        driver.read_diagnostics(&mut values);
        let value = |name: &&str| {
            let of = |port: &&Port| {
                port.name
                    .strip_suffix(name)
                    .is_some_and(|it| it.ends_with('/'))
            };
            let port = diagnostics.iter().find(of);
            let place = port.and_then(|port| layout.find(&port.name));
            let place = place.unwrap_or_else(|| panic!("the driver has no diagnostic `{name}`"));
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a counter"
            )]
            {
                values[place.start] as u64
            }
        };
        let [accepted, missing, discarded] = names.map(|names| names.iter().map(value).sum());
        Self {
            accepted,
            missing,
            discarded,
        }
    }
}

impl<D: Driver> DeviceSetup<D> {
    /// Creates the setup of a driver and its devices on a line where a byte takes `byte_time`: a
    /// line of its own for a single device, a half-duplex bus for several.
    ///
    /// Both are made anew for each run and must be the same each time. The plant has `ports`. By
    /// default
    ///
    /// - the plant's outputs rise in steps of 0.01, and components differ by 0.001;
    /// - commands are 0;
    /// - a transfer begins once in [`Driver::period`], or in 10 ms;
    /// - the driver recovers within 2 periods after the last damage;
    /// - opening and closing end within 1 s, a transfer within 2 periods;
    /// - the state of the driver and of a device grows by 4 KiB at most;
    /// - all damage is detected; answers are not numbered; traffic is counted by
    ///   [`Driver::bus_health`].
    pub fn new(
        byte_time: SimDuration,
        ports: Vec<Port>,
        driver: impl Fn() -> D + 'static,
        nodes: impl Fn() -> Nodes + 'static,
    ) -> Self {
        let period = driver().period().unwrap_or(SimDuration::from_millis(10));
        Self {
            driver: Box::new(driver),
            nodes: Box::new(nodes),
            wire: Box::new(move |nodes| direct_wire(byte_time, nodes)),
            byte_time,
            ports,
            levels: Rc::new(|level, component| 0.01 * level as f64 + 0.001 * component as f64),
            commands: Box::new(|_, _| 0.0),
            period,
            recovery: 2,
            deadline: SimDuration::from_secs(1),
            transfer_deadline: period * 2,
            state_bytes: 4096,
            detection: Detection::AllDamage,
            spacing: 0,
            numbers_answers: false,
            foreign: Vec::new(),
            traffic: Traffic::of_health,
        }
    }

    /// Connects the devices by this wire: behind a USB converter, for example.
    #[must_use]
    pub fn with_wire(mut self, wire: impl Fn(Nodes) -> Box<dyn Wire> + 'static) -> Self {
        self.wire = Box::new(wire);
        self
    }

    /// Sets the outputs of the plant by level and component. A level lasts three periods. Every
    /// component must have another value at each level, as the driver reports it: a device that
    /// filters, or adds noise, is set up without.
    #[must_use]
    pub fn with_levels(mut self, levels: impl Fn(usize, usize) -> f64 + 'static) -> Self {
        self.levels = Rc::new(levels);
        self
    }

    /// Sets the commands by number of the transfer and component.
    #[must_use]
    pub fn with_commands(mut self, commands: impl Fn(usize, usize) -> f64 + 'static) -> Self {
        self.commands = Box::new(commands);
        self
    }

    /// Begins a transfer once in this period, which ends within two.
    #[must_use]
    pub fn with_period(mut self, period: SimDuration) -> Self {
        self.period = period;
        self.transfer_deadline = period * 2;
        self
    }

    /// The driver recovers within as many periods after the last damage.
    #[must_use]
    pub fn with_recovery(mut self, periods: usize) -> Self {
        self.recovery = periods;
        self
    }

    /// Opening and closing each end within this time, with success or an error.
    #[must_use]
    pub fn with_deadline(mut self, deadline: SimDuration) -> Self {
        self.deadline = deadline;
        self
    }

    /// A transfer ends within this time, with success or an error.
    #[must_use]
    pub fn with_transfer_deadline(mut self, deadline: SimDuration) -> Self {
        self.transfer_deadline = deadline;
        self
    }

    /// The saved state of the driver and of each device grows by as many bytes at most.
    #[must_use]
    pub fn with_state_bytes(mut self, bytes: usize) -> Self {
        self.state_bytes = bytes;
        self
    }

    /// The checksum detects this damage, if at least `spacing` bytes are between two damages: a sum
    /// does not detect two wrong bits in one frame.
    #[must_use]
    pub fn with_detection(mut self, detection: Detection, spacing: usize) -> Self {
        (self.detection, self.spacing) = (detection, spacing);
        self
    }

    /// Answers have numbers, so that the driver recognises one that comes again.
    #[must_use]
    pub fn with_numbered_answers(mut self) -> Self {
        self.numbers_answers = true;
        self
    }

    /// The driver ignores these frames: those of other addresses, kinds and directions.
    #[must_use]
    pub fn with_foreign_frames(mut self, frames: Vec<Vec<u8>>) -> Self {
        self.foreign = frames;
        self
    }

    /// The driver counts its traffic so.
    #[must_use]
    pub fn with_traffic(mut self, traffic: fn(&D, HostTime) -> Traffic) -> Self {
        self.traffic = traffic;
        self
    }
}

impl<D> DeviceSetup<D> {
    /// Returns the damage of a case that the checksums detect: to the driver, and to the devices.
    pub(super) fn damages(&self, case: &Case) -> [Vec<Damage>; 2] {
        [&case.to_driver, &case.to_devices].map(|damages| {
            let detected = damages.iter().copied();
            detected
                .filter(|it| self.detection.includes(it.kind))
                .collect()
        })
    }
}

/// Connects devices to the host without a converter.
fn direct_wire(byte_time: SimDuration, mut nodes: Nodes) -> Box<dyn Wire> {
    let line: Box<dyn Line> = match nodes.len() {
        1 => Box::new(Duplex::new(byte_time, nodes.remove(0))),
        _ => Box::new(
            Rs485::new("laws", byte_time, SimDuration::ZERO, nodes)
                .expect("the devices are on one bus"),
        ),
    };
    Box::new(HostEnd::new(Uart::new(byte_time, line)))
}
