//! Drives alone: a robot's motors or servos on a bench, with nothing on their shafts but what one puts there. They have the
//! ports of the drives of a whole robot, so that buses, boards and controllers can be tried without one, in next to no time;
//! and where a robot has servos that its plant does not move, they turn beside it.
//!
//! [`MotorBench`] is exact: under a voltage that stays, a motor's rate is an exponential, and so no step is too long.
//! [`ServoBench`] takes steps of a millisecond at most.
//!
//! ```
//! use twinrig_drives::{Motored, MotorBench, Shaft};
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_robot::RobotFile;
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = include_str!("../../../robots/oncilla.toml");
//! let robot = RobotFile::parse("oncilla.toml", text)?.robot()?;
//! let motors = robot.motors.ok_or("no motors")?;
//! let motored = Motored {
//!     legs: vec!["LF".to_owned()],
//!     hip: Shaft::bare(motors.hip),
//!     knee: Shaft::bare(motors.knee),
//! };
//! let mut bench = MotorBench::new(&motored, &|signal| signal == "leg/LF/hip/rate")?;
//! // 24 V at the hip, whose bridge is closed; the knee coasts.
//! bench.advance(SimTime::ZERO + SimDuration::from_secs(1), &[24.0, 1.0, 0.0, 0.0])?;
//! let mut rate = [0.0];
//! bench.observe(&mut rate);
//! assert!((rate[0] * 30.0 / core::f64::consts::PI * 14.0 - 16_312.0).abs() < 1.0, "rpm before the gear");
//! # Ok(())
//! # }
//! ```
//!
//! What is not here: legs, ground and whatever else loads a drive in a robot, but for an inertia and a viscous friction;
//! stops, so shafts turn on and on; the loops and electronics in front of a motor.

mod cache;
mod error;
mod motor_bench;
mod response;
mod servo_bench;
mod shaft;

pub use error::DrivesError;
pub use motor_bench::{MotorBench, Motored};
pub use servo_bench::ServoBench;
pub use shaft::{Load, Shaft};
