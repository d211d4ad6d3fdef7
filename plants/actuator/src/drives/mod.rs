//! Test benches of drives: the motors or servos of a robot with nothing but a configurable load on
//! their shafts. They have the ports of the drives of a complete robot, so that buses, boards and
//! controllers can be tested without one at almost no cost; servos of a robot that its plant does
//! not simulate run on a bench in parallel to it.
//!
//! [`MotorBench`] is exact at any step length: at a constant voltage, a motor's rate is an
//! exponential. [`ServoBench`] takes steps of a millisecond at most.
//!
//! ```
//! use std::path::Path;
//! use twinrig_actuator::drives::{BenchMotors, MotorBench, Shaft};
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_robot::RobotFile;
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = RobotFile::find("oncilla", Path::new(""))?.robot()?;
//! let motors = robot.motors.ok_or("no motors")?;
//! let motored = BenchMotors {
//!     legs: vec!["LF".to_owned()],
//!     hip: Shaft::bare(motors.hip),
//!     knee: Shaft::bare(motors.knee),
//! };
//! let mut bench = MotorBench::new(&motored, &|signal| signal == "leg/LF/hip/rate")?;
//! // 24 V at the hip, whose bridge is closed; the knee coasts.
//! bench.advance(SimTime::ZERO + SimDuration::from_secs(1), &[24.0, 1.0, 0.0, 0.0])?;
//! let mut rate = [0.0];
//! bench.observe(&mut rate);
//! let rpm = rate[0] * 30.0 / core::f64::consts::PI * 14.0; // before the gear
//! assert!((rpm - 16_312.0).abs() < 1.0);
//! # Ok(())
//! # }
//! ```
//!
//! Not modelled: legs, ground and other loads of a drive in a robot, except for an inertia and a
//! viscous friction; stops (shafts rotate without limit); control loops and electronics in front of
//! a motor.

mod cache;
mod error;
mod motor_bench;
mod response;
mod servo_bench;
mod shaft;

pub use error::DrivesError;
pub use motor_bench::{BenchMotors, MotorBench};
pub use servo_bench::ServoBench;
pub use shaft::{Load, Shaft};
