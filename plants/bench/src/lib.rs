//! Test bench of tactile sensors (thesis, section 4.3.2.1): a motor turns a cam, whose roller moves
//! a carriage, which presses through three springs onto a tactile sensor and a reference cell.
//! [`Bench`] is the plant; [`twinrig_sensor::SensedPlant`] adds the sensor to it.
//!
//! ```
//! use twinrig_bench::{Bench, BenchFile, BenchSettings, STEP};
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let file = BenchFile::find("tactile", "".as_ref())?.ok_or("no bench")?;
//! let parameters = file.bench(&BenchSettings::default())?;
//! let mut bench = Bench::new(&parameters, STEP, 1, &|signal| signal == "bench/force")?;
//! // 4 V at the motor: three turns a second.
//! bench.advance(SimTime::ZERO + SimDuration::from_millis(160), &[4.0, 1.0])?;
//! let mut load = [0.0];
//! bench.observe(&mut load);
//! assert!(load[0] > 20.0, "{load:?}");
//! # Ok(())
//! # }
//! ```
//!
//! Not modelled: the inertia of the carriage of the sensor, the compliance of sensor and reference
//! cell (hundreds of times stiffer than the springs), static friction, backlash of the gear,
//! gravity.

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_bench;

mod cam;
mod dynamics;
mod error;
mod parameters;
mod plant;
mod profile;
mod ranges;
mod spline;
#[cfg(test)]
mod tests;

pub use cam::{Scratches, Undercut};
pub use error::BenchError;
pub use parameters::{
    BenchFile, BenchParameters, BenchSettings, CamParameters, Carriage, ReferenceCell,
};
pub use plant::{Bench, LOAD, MOTOR, STEP};
pub use profile::CamProfile;
