//! Drives: position servos with target rate and torque limit ([`PositionServo`]), their set-points
//! between commands ([`SetPoints`]), and direct-current motors with torque as a function of voltage
//! and rate ([`DcMotor`]). The plants of [`drives`] are test benches of both. Servos with firmware,
//! a supply and a gear are in [`serial`].
//!
//! A [`PositionServo`] is a cascade. The outer loop requests a rate in proportion to the position
//! error, up to the speed limit; the inner loop requests an acceleration in proportion to the rate
//! error, four times faster, which makes the pair critically damped with a delay of exactly
//! [`lag`](PositionServo::lag) behind a ramp. The drive rejects its load up to its torque limit: a
//! plant imposes the target rate where the torque for it is within
//! [`torque`](PositionServo::torque), and applies the torque limit otherwise.
//!
//! ```
//! use twinrig_actuator::PositionServo;
//! let servo = PositionServo::ideal(2e-3, 1e-3).unwrap();
//! assert_eq!(servo.rate_after(1e-3, 1.0, 1.0, 0.0), 0.0); // there, and at rest
//! assert!(servo.rate_after(1e-3, 1.0, 0.9, 0.0) > 0.0);
//! ```
//!
//! Not modelled: pulses, packets and clocks (drivers and boards), the motor's inductance, and the
//! gear losses of a [`DcMotor`]. Integration in time is the plant's.

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_actuator;

pub mod drives;
mod motor;
pub mod serial;
mod servo;
mod set_points;
#[cfg(test)]
mod tests;

pub use motor::{DcMotor, LegMotor, MotorError, MotorLine};
pub use servo::{PositionServo, ServoError};
pub use set_points::{Ramp, SetPoint, SetPoints, StepInputs};
