//! Host driver and emulation of Oncilla's motordriver boards: four boards on one SBCP bus, each
//! with the two motors of a leg, or with one motor on a shaft that rotates without limit. The
//! emulation is exact to the byte and to the firmware tick. The driver runs unchanged against the
//! emulation and against a serial port; the emulation is coupled to the plant through signals only.
//! Both are deterministic, and their state can be saved and restored between any two bytes.
//!
//! ```
//! use twinrig_motordriver::{Bus, BusConfig, BusTopology, Generation};
//! use twinrig_runtime::Driver;
//!
//! // Without the bus controller, and with one board that still runs the first firmware:
//! let mut config = BusConfig { topology: BusTopology::Direct, ..BusConfig::default() };
//! config.boards[1].firmware.generation = Generation::First;
//! // A clock that is slow by 764 ppm, with ticks 0.3 ms after the whole milliseconds:
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
//! **Board** ([`MotorBoard`]). A loop with a period of 1 ms of the board's own clock: sensors,
//! interpolation of the set-points (thesis, section 5.3.3), position controllers, watchdog.
//! **Driver** ([`MotorDriver`]). A session: probing, register configuration, calibration, then one
//! cycle per transfer. **Bus** ([`Bus`]). Both ends, with USB converter, bus controller and faults
//! in between.
//!
//! **Left and right.** The boards of the left legs count in the opposite direction (as in
//! liboncilla-hw; another user of the robot mirrored the right ones), so that on both sides the
//! zero of the hip is the middle of its range and the zero of the knee is the extended leg.
//! Magnetic encoders and force sensors are not mirrored (ASSUMED).
//!
//! **Free shaft** ([`BoardConfig::shaft`]). Bit 15 of the register `PositionLimit`, of which only
//! the name is known, permits continuous rotation (ASSUMED), and with it a velocity mode (ASSUMED,
//! code 4): the set-point word is a signed speed in units of 2 counts/s, up to 16 turns per second.
//! The firmware integrates it to a position set-point for the same position controller, within the
//! registers of maximum speed and acceleration, so that the mean speed is exact to the board's
//! clock and to half a unit. The following error is limited to a quarter of a turn; beyond it the
//! motor is reported as stalled.
//!
//! **Watchdog.** The motors are dropped (coast) after ten periods without a command. At 500 Hz
//! these are 20 ms; a pause of exactly 20 ms does not trigger the watchdog: intervals of
//! up to 21 ms between commands never drop the motors, intervals of 22 ms and more always do; nine
//! consecutive commands may be lost, ten may not. The next command re-engages the motors at their
//! present position (ASSUMED), those of free shafts at their present speed, too.
//!
//! **Limits.** No physics: motors and gears belong to the plant, the firmware contains only their
//! back-EMF constant and resistance to limit the current. No thermal model, no winding inductance,
//! no supply sag. The registers of stiffness, damping and preload are stored without effect, and so
//! is the maximum acceleration outside velocity mode; the second motor of a board on a free shaft
//! is not connected; non-volatile registers are not preserved between runs. The crate opens no
//! serial port.

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_motordriver;

mod assumed;
mod board;
mod bus;
mod clock_check;
mod config;
mod driver;
mod error;
mod event_timing;
mod firmware;
mod host_board;
mod interval_histogram;
mod leg;
mod motor;
mod phase;
mod pid;
mod registers;
mod reply;
mod requests;
mod session;
mod shaft;
mod smooth;
#[cfg(test)]
mod tests;
mod time_outs;
mod units;
mod velocity;
mod watchdog;
mod wiring;

pub use board::MotorBoard;
pub use bus::{Bus, BusWire};
pub use config::{
    Attachment, BoardConfig, BusConfig, BusTopology, FirmwareConfig, Following, Generation,
    Interpolation, SessionConfig, SessionGains,
};
pub use driver::MotorDriver;
pub use error::BusError;
pub use reply::{COMMAND_LEN, REPLY_LEN};
pub use units::{Joint, Side};
