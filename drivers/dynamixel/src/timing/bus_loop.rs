use twinrig_kernel::{BoardClock, HostTime, SimDuration, SimTime};
use twinrig_runtime::{Driver, Part, Wire};
use twinrig_wire::{FaultSchedule, UsbTiming, earlier};

use super::host_loop::LoopError;
use super::stand::{STEPS, Stand};
use crate::bus::ServoBusWire;
use crate::config::{JointSignals, ReadPattern, ServoBusConfig, ServoConfig};
use crate::driver::DynamixelDriver;
use crate::firmware::ServoKind;
use crate::table::ReturnDelay;

/// Transfers before those that count.
const WARM_UP: usize = 5;
/// Period of the firmware of all kinds, at which it samples.
const PERIOD: SimDuration = SimDuration::from_millis(1);
/// Unit of the return delay.
const UNIT: SimDuration = SimDuration::from_micros(2);

/// Loop of the driver over a bus of several servos, each transfer right after the one before: goals
/// to all, positions of all. The program takes no time.
#[derive(Clone, Debug)]
pub struct BusLoop {
    /// Kind of the servos.
    pub kind: &'static ServoKind,
    /// Number of servos.
    pub servos: u8,
    /// Time of a byte.
    pub byte_time: SimDuration,
    /// Way to read the positions.
    pub pattern: ReadPattern,
    /// Adapter and host.
    pub usb: UsbTiming,
    /// Return delay of the servos, in steps of 2 µs, at most 508 µs; that of a servo without a
    /// register for it is fixed.
    pub return_delay: SimDuration,
    /// Seed.
    pub seed: u64,
}

/// Measured transfers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BusTimes {
    /// Durations, from the write of the goals to the last position.
    pub durations: Vec<SimDuration>,
    /// Age of the oldest position of each transfer at its end: the time since its servo sampled the
    /// encoder, to within a millisecond for every 0.4 s.
    pub ages: Vec<SimDuration>,
}

impl BusLoop {
    /// Runs some transfers and measures them.
    ///
    /// # Errors
    /// [`LoopError`] if the bus is invalid, or a servo does not answer.
    pub fn run(&self, transfers: usize) -> Result<BusTimes, LoopError> {
        let config = self.config();
        let mut host = Host::new(&config)?;
        host.driver.open(host.time());
        host.finish()?;
        let goals = vec![0.0; config.servos.len()];
        let (mut times, mut held) = (BusTimes::default(), 1);
        for transfer in 0..WARM_UP + transfers {
            let begin = host.now;
            if transfer + 1 == WARM_UP {
                host.stand.hold(held);
            }
            host.driver.begin(host.time(), &goals);
            host.finish()?;
            // Samples are told apart for twice as long as a transfer takes.
            let samples = (host.now - begin).as_nanos() / PERIOD.as_nanos();
            held = 1 + 2 * usize::try_from(samples).unwrap_or_default() / STEPS;
            if transfer >= WARM_UP {
                times.durations.push(host.now - begin);
                let positions = host.driver.to_process();
                let sampled = host.stand.oldest(positions);
                times.ages.push(host.now - sampled);
            }
        }
        Ok(times)
    }

    fn config(&self) -> ServoBusConfig {
        let units = self.return_delay.as_nanos() / UNIT.as_nanos();
        let units = i32::try_from(units).unwrap_or(i32::MAX);
        let settings = match self.kind.model.roles.return_delay {
            ReturnDelay::Register(address) => vec![(address, units)],
            ReturnDelay::Fixed(_) => Vec::new(),
        };
        let servo = |n: u8| ServoConfig {
            name: format!("servo{n}"),
            kind: self.kind,
            id: n + 1,
            registers: Vec::new(),
            settings: settings.clone(),
            signals: JointSignals::of_joint(&format!("servo{n}")),
            command: format!("servo{n}/command"),
            voltage: self.kind.voltage,
            temperature: 25.0,
            clock: BoardClock::IDEAL,
        };
        let held = self.usb.latency_timer + self.usb.inn.hold_max();
        ServoBusConfig {
            name: "loop".to_owned(),
            servos: (0..self.servos).map(servo).collect(),
            byte_time: self.byte_time,
            pattern: self.pattern,
            period: SimDuration::from_secs(1),
            timeout: held + SimDuration::from_millis(20),
            usb: self.usb.clone(),
            turnaround: SimDuration::ZERO,
            faults: FaultSchedule::default(),
            seed: self.seed,
        }
    }
}

/// The driver at its end of the wire.
struct Host {
    driver: DynamixelDriver,
    wire: ServoBusWire,
    stand: Stand,
    now: SimTime,
    bytes: Vec<u8>,
}

impl Host {
    fn new(config: &ServoBusConfig) -> Result<Self, LoopError> {
        let (stand, signals) = Stand::new(&config.servos);
        let mut wire = config.wire()?;
        wire.connect("loop", &signals)?;
        Ok(Self {
            driver: config.driver()?,
            wire,
            stand,
            now: SimTime::ZERO,
            bytes: Vec::new(),
        })
    }

    fn time(&self) -> HostTime {
        HostTime::from_nanos(self.now.as_nanos())
    }

    /// Runs until the driver has finished.
    fn finish(&mut self) -> Result<(), LoopError> {
        let start = self.now;
        loop {
            self.bytes.clear();
            while self.driver.poll_transmit(&mut self.bytes) {
                self.wire.send(self.now, &self.bytes);
                self.bytes.clear();
            }
            if !self.driver.is_busy()? {
                return Ok(());
            }
            let timeout = self.driver.poll_timeout();
            let timeout = timeout.map(|at| SimTime::from_nanos(at.as_nanos()));
            if timeout.is_some_and(|at| at <= self.now) {
                return Err(LoopError::NoAnswer(start));
            }
            let next = earlier(timeout, self.wire.next_wake());
            self.now = next.ok_or(LoopError::NoAnswer(start))?;
            self.stand.now = self.now;
            self.wire.advance(self.now, &mut self.stand)?;
            self.wire.receive(&mut self.bytes);
            self.driver.handle_bytes(self.time(), &self.bytes);
        }
    }
}
