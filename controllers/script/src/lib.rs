//! Scripted open-loop controller: each drive holds, ramps, oscillates or steps, independently of
//! the robot. The outputs are a pure function of the sum of the elapsed times in whole nanoseconds:
//! executors with the same total time, in virtual time or in real time, divided in the same steps
//! or others, produce the same bits. It is intended for rigs whose subject is not walking: the
//! timing of a bus, a drive on a test bench, a byte-by-byte comparison of a twin with hardware.
//! [`Turn`] turns free shafts at an even rate, [`Swing`] commands the servo of a bench.
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
//! assert_eq!(commands, [0.0, 0.5]); // the middle of the hip's oscillation; the knee holds
//! script.step(SimDuration::from_millis(250), &[], &mut commands);
//! assert_eq!(commands, [0.1, 0.5]); // a quarter of a cycle at 1 Hz
//! # Ok::<(), twinrig_script::ScriptError>(())
//! ```
//!
//! # Limits
//!
//! No sensors, no kinematics, no joint limits (any angle is accepted, in or out of reach), no
//! smoothing, no random numbers.

mod error;
mod plan;
mod script;
mod shape;
mod swing;
#[cfg(test)]
mod tests;
mod turn;

pub use error::ScriptError;
pub use plan::Plan;
pub use script::Script;
pub use shape::Shape;
pub use swing::Swing;
pub use turn::Turn;
