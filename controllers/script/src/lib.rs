//! A controller that plays what is known in advance: each drive holds, ramps, swings or jumps, whatever the robot does. What
//! it writes is a pure function of the sum of the elapsed times it was told, in whole nanoseconds: executors that tell it the
//! same times, in virtual time or on a real clock, in the same pieces or others, get the same bits. It is for rigs whose
//! subject is not walking: the timing of a bus, a drive on a bench, a comparison of a twin with hardware byte by byte.
//!
//! ```
//! use twinrig_kernel::SimDuration;
//! use twinrig_runtime::Process;
//! use twinrig_script::{Plan, Script, Shape};
//!
//! # let robot = twinrig_robot::Robot::example();
//! let plan = Plan { hip: Shape::Sine, ..Plan::default() };
//! let mut script = Script::new(&robot, &["LF"], &plan)?;
//! let mut commands = [0.0; 2];
//! script.step(SimDuration::ZERO, &[], &mut commands);
//! assert_eq!(commands, [0.0, 0.5]); // the middle of the hip's swing; the knee holds
//! script.step(SimDuration::from_millis(250), &[], &mut commands);
//! assert_eq!(commands, [0.1, 0.5]); // a quarter of a cycle at 1 Hz
//! # Ok::<(), twinrig_script::ScriptError>(())
//! ```
//!
//! # What it does not do
//!
//! It reads no sensor, knows neither kinematics nor limits of a leg (an angle is an angle, in or out of reach), smooths
//! nothing, and draws no random numbers.

mod error;
mod plan;
mod script;
mod shape;
#[cfg(test)]
mod tests;

pub use error::ScriptError;
pub use plan::Plan;
pub use script::Script;
pub use shape::Shape;
