use twinrig_sbcp::{ControlledBus, ControllerConfig, FRAME_MAX, FRAMES, recipient};
use twinrig_wire::{Faulty, FaultyNode, Line, Node, Rs485, Traced, UsbSerial};

use crate::board::MotorBoard;
use crate::config::{BoardConfig, BusConfig, BusTopology};
use crate::driver::MotorDriver;
use crate::error::BusError;

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
            let board = BoardConfig {
                clock: config.faults.clock(&place, board.clock)?,
                ..board.clone()
            };
            let node = MotorBoard::new(&config.name, &board)?
                .with_bytewise_reception(faulty)
                .with_nominal_period(config.session.nominal_period());
            nodes.push(if config.faults.harms_board(&place) {
                let faults = &config.faults;
                Box::new(FaultyNode::framed(
                    &place,
                    config.byte_time,
                    faults,
                    Some(FRAMES),
                    node,
                )?)
            } else {
                Box::new(node)
            });
        }
        let (name, byte_time) = (&config.name, config.byte_time);
        let with_packets = config.packet_level && config.faults.faults.is_empty();
        let mut bus = Rs485::new(name, byte_time, config.turnaround, nodes)?;
        if with_packets {
            bus = bus.with_packets(recipient);
        }
        let mut line: Box<dyn Line> = Box::new(bus);
        if config.trace {
            line = Box::new(Traced::new("rs485", line));
        }
        line = with_faults(config, &config.place(), line)?;
        if let BusTopology::Controller(controller) = config.topology {
            let controller = ControllerConfig {
                byte_time,
                ..controller
            };
            let mut controlled = ControlledBus::new(name, controller, line)?;
            // A trace has the instants at which bytes begin.
            if with_packets && !config.trace {
                controlled = controlled.with_packets();
            }
            line = Box::new(controlled);
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

fn with_faults(
    config: &BusConfig,
    place: &str,
    line: Box<dyn Line>,
) -> Result<Box<dyn Line>, BusError> {
    if !config.faults.harms(place) {
        return Ok(line);
    }
    let faulty = Faulty::framed(place, config.byte_time, &config.faults, Some(FRAMES), line)?;
    Ok(Box::new(faulty))
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
