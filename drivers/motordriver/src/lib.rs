//! The motordriver boards of Oncilla, four of them on one bus, each with two motors: the driver that talks to them, and an
//! emulation of everything that it talks to, byte for byte and tick for tick. The driver cannot tell whether it has
//! the emulation before it or a serial port; the emulation meets the plant through signals alone. Both are deterministic and
//! can be saved and restored between any two bytes.
//!
//! ```
//! use twinrig_motordriver::{Bus, BusConfig, BusTopology, Generation};
//! use twinrig_runtime::Driver;
//!
//! // Without the bus controller, and with a board that still has the first firmware:
//! let mut config = BusConfig { topology: BusTopology::Direct, ..BusConfig::default() };
//! config.boards[1].firmware.generation = Generation::First;
//! // A clock that is slow by 764 ppm, whose ticks come 0.3 ms after the whole milliseconds:
//! let phase = twinrig_kernel::SimDuration::from_micros(300);
//! config.boards[0] = config.boards[0].clone().with_clock(-764_000, phase)?;
//!
//! let driver = Bus::driver(&config)?;
//! let wire = Bus::wire(&config)?;
//! let commands = driver.ports().iter().filter(|port| port.name.ends_with("/command")).count();
//! assert_eq!((driver.name(), commands), ("sbcp", 8));
//! let task = twinrig_runtime::WiredTask::new(Box::new(driver), Box::new(wire));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Board** ([`MotorBoard`]). A loop of 1 ms by its own clock: sensors, interpolation of the set-points (thesis, section
//! 5.3.3), position controllers, watchdog. **Driver** ([`MotorDriver`]). A session: who is there, registers, calibration,
//! then a cycle for each transfer. **Bus** ([`Bus`]). Both ends with USB converter, bus controller and faults between them.
//!
//! **Left and right.** The boards of the left legs count the other way (as in liboncilla-hw; another user of the robot
//! mirrored the right ones), so that on both sides hips count from the middle of their range and knees from the extended
//! leg. Magnetic encoders and force sensors are not mirrored (ASSUMED).
//!
//! **Watchdog.** Ten periods without a command, and the motors are let go. At 500 Hz that is 20 ms, and a silence of exactly
//! that lies on the safe side: up to 21 ms from command to command never drop the motors, 22 ms and more always do; nine
//! commands may be lost in a row, ten may not. The next command takes the motors up again, from where they are (ASSUMED).
//!
//! What it does not do: no physics (motors and gears are the plant's; it knows their back-EMF and resistance to limit
//! the current), no heat, no winding inductance, no bus voltage that sags; registers of stiffness, damping, preload and
//! greatest acceleration are kept without effect; registers that are saved are not kept from run to run; it opens no port.

mod assumed;
mod board;
mod bus;
mod config;
mod driver;
mod error;
mod event_timing;
mod firmware;
mod interval_histogram;
mod leg;
mod phase;
mod pid;
mod registers;
mod reply;
mod session;
mod smooth;
mod stack;
mod units;
mod watchdog;

pub use board::MotorBoard;
pub use bus::{Bus, BusWire};
pub use config::{
    BoardConfig, BusConfig, BusTopology, FirmwareConfig, Following, Generation, Interpolation,
    SessionConfig, SessionGains,
};
pub use driver::MotorDriver;
pub use error::BusError;
pub use stack::Stack;
pub use units::{Joint, Side};
