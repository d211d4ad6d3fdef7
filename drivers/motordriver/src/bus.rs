use std::time::Duration;

use twinrig_kernel::SimDuration;
use twinrig_sbcp::{ControlledBus, ControllerConfig, FRAME_MAX, MasterConfig, OVERHEAD, Topology};
use twinrig_wire::{Faulty, FaultyNode, Line, Node, Rs485, Traced, UsbSerial};

use crate::board::MotorBoard;
use crate::config::{BusConfig, BusTopology, Generation};
use crate::driver::MotorDriver;
use crate::error::BusError;
use crate::reply::{COMMAND_LEN, REPLY_LEN};

/// Transport between the host's driver and the plant: USB converter, bus controller, RS-485 and the
/// boards.
pub type BusWire = UsbSerial<Box<dyn Line>>;

/// Builder of both ends of a bus: the host's driver, and the wire with the emulated boards. The
/// driver can be used with the physical bus, too.
#[derive(Clone, Copy, Debug)]
pub struct Bus;

impl Bus {
    /// Returns the driver that runs on the host.
    ///
    /// # Errors
    /// [`BusError`] if the configuration is invalid.
    pub fn driver(config: &BusConfig) -> Result<MotorDriver, BusError> {
        MotorDriver::new(config)
    }

    /// Returns the emulated bus to which the driver is connected in virtual time.
    ///
    /// # Errors
    /// [`BusError`] if the configuration is invalid.
    pub fn wire(config: &BusConfig) -> Result<BusWire, BusError> {
        config.check()?;
        let mut nodes: Vec<Box<dyn Node>> = Vec::new();
        for board in config.boards.iter().filter(|board| board.present) {
            let place = config.board_place(&board.name);
            // Duplicated or delayed bytes may form one burst of two packets.
            let faulty = !config.faults.faults.is_empty();
            let node = MotorBoard::new(&config.name, board)?
                .with_bytewise_reception(faulty)
                .with_nominal_period(config.session.nominal_period());
            nodes.push(if has_faults(config, &place) {
                let faults = &config.faults;
                Box::new(FaultyNode::new(&place, config.byte_time, faults, node)?)
            } else {
                Box::new(node)
            });
        }
        let (name, byte_time) = (&config.name, config.byte_time);
        let mut line: Box<dyn Line> =
            Box::new(Rs485::new(name, byte_time, config.turnaround, nodes)?);
        if config.trace {
            line = Box::new(Traced::new("rs485", line));
        }
        line = with_faults(config, &config.place(), line)?;
        if let BusTopology::Controller(controller) = config.topology {
            let controller = ControllerConfig {
                byte_time,
                ..controller
            };
            line = Box::new(ControlledBus::new(name, controller, line)?);
        }
        line = with_faults(config, &config.link_place(), line)?;
        Ok(UsbSerial::new(
            name,
            config.usb.clone(),
            byte_time,
            config.seed,
            line,
        )?)
    }
}

fn has_faults(config: &BusConfig, place: &str) -> bool {
    config.faults.faults.iter().any(|fault| fault.on == place)
}

fn with_faults(
    config: &BusConfig,
    place: &str,
    line: Box<dyn Line>,
) -> Result<Box<dyn Line>, BusError> {
    if !has_faults(config, place) {
        return Ok(line);
    }
    let faulty = Faulty::new(place, config.byte_time, &config.faults, line)?;
    Ok(Box::new(faulty))
}

/// Microframe for which the default time-outs of the protocol's master are chosen.
const MICROFRAME: Duration = Duration::from_micros(125);
/// ASSUMED: maximum response time of a board with the first firmware: its main loop, plus 10 % for
/// its clock.
const FIRST_FIRMWARE: Duration = Duration::from_micros(1_100);
/// Maximum response time of a board with the final firmware (thesis, section 5.3.2).
const REACTION: SimDuration = SimDuration::from_micros(10);
/// Microframes by which the host may exceed its configured timing in a direct cycle before an
/// answer is given up.
const LATENESS: u64 = 2;

/// Returns the time-out of a request directly on the bus, from its write.
///
/// A request takes (4 + ⌈bus time / microframe⌉) microframes, the turnaround and the jitters;
/// [`LATENESS`] is added as a margin. The margin is small because a silent board costs the time-out
/// in every cycle. The time-out is a whole number of microframes after the turnaround: with the
/// defaults 895 µs, so that the next request leaves 7 microframes after the unanswered one, and
/// three boards of 5 microframes with one that is silent are polled at 364 Hz.
fn direct_timeout(config: &BusConfig) -> SimDuration {
    let usb = &config.usb;
    let bytes = COMMAND_LEN + REPLY_LEN + 2 * OVERHEAD;
    let bus = config.byte_time * bytes as u64 + REACTION;
    let frames = 4 + bus.as_nanos().div_ceil(usb.microframe.as_nanos().max(1));
    let late = usb.turnaround + usb.jitter.longest() + usb.write_jitter.longest();
    usb.microframe * (frames + LATENESS) + late
}

/// Returns the configuration of the bus master: its time-outs allow for USB as configured and for
/// boards with the first firmware, which answer late.
pub(crate) fn master_config(config: &BusConfig) -> MasterConfig {
    let topology = match config.topology {
        BusTopology::Direct => Topology::Direct,
        BusTopology::Controller(_) => Topology::Controller,
    };
    let defaults = MasterConfig::new(topology);
    let nanos = |duration: SimDuration| Duration::from_nanos(duration.as_nanos());
    let frames = nanos(config.usb.microframe)
        .as_nanos()
        .div_ceil(MICROFRAME.as_nanos());
    let frames = u32::try_from(frames).unwrap_or(u32::MAX).max(1);
    let timer = nanos(config.usb.latency_timer) * 2;
    let late = |board: &&crate::config::BoardConfig| board.firmware.generation == Generation::First;
    let late = config.boards.iter().filter(late).count();
    let late = u32::try_from(match topology {
        Topology::Direct => late.min(1),
        Topology::Controller => late,
    });
    let slow = timer + FIRST_FIRMWARE * late.unwrap_or(u32::MAX);
    let longest = defaults.cycle_timeout * frames;
    let shortest = match topology {
        Topology::Direct => longest.min(nanos(direct_timeout(config))),
        Topology::Controller => longest,
    };
    let (cycle_timeout, grace) = match config.session.cycle_timeout {
        Some(timeout) => (timeout, defaults.grace),
        // A shorter time-out does not shorten the time in which an answer may arrive late.
        None => (
            shortest + slow,
            defaults.grace + longest.saturating_sub(shortest),
        ),
    };
    MasterConfig {
        // A host that reads answers late in a cycle reads those of single requests as late.
        lazy_timeout: (defaults.lazy_timeout + timer).max(cycle_timeout),
        cycle_timeout,
        grace,
        error_threshold: config.session.error_threshold,
        ..defaults
    }
}

/// Relative clock error of the host up to which a period still counts as whole milliseconds.
const PERIOD_TOLERANCE: f64 = 1e-3;

impl BusConfig {
    /// Rejects invalid configurations.
    pub(crate) fn check(&self) -> Result<(), BusError> {
        let used = self.boards.iter().filter(|board| board.used).count();
        if used > FRAME_MAX {
            return Err(BusError::Boards { boards: used });
        }
        for (n, board) in self.boards.iter().enumerate() {
            let same = |other: &&crate::config::BoardConfig| {
                other.id == board.id || other.name == board.name
            };
            if let Some(other) = self.boards[..n].iter().find(same) {
                return Err(BusError::Twice {
                    first: other.name.clone(),
                    second: board.name.clone(),
                });
            }
        }
        let millis = self.session.period.as_secs_f64() * 1e3;
        let whole = libm::rint(millis);
        let near = (millis - whole).abs() < whole * PERIOD_TOLERANCE;
        if near && (1.0..=1_000.0).contains(&whole) {
            Ok(())
        } else {
            Err(BusError::Period { millis })
        }
    }
}
