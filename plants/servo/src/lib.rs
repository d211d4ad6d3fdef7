//! Bench of a serial servo: [`ServoBench`] is a plant, in which one servo moves a mass on an arm in
//! a vertical plane, as on the benches on which servos are measured. Its firmware and its motor are
//! those of `twinrig_actuator::serial`.
//!
//! ```
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_runtime::Plant;
//! use twinrig_servo::{ServoBench, ServoBenchFile};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let file = ServoBenchFile::find("xl330", "".as_ref())?.ok_or("no bench")?;
//! let mut bench = ServoBench::new(&file.bench()?, &|signal| signal == "servo/angle")?;
//! // Half a radian upwards: gravity and friction leave an error of position.
//! bench.advance(SimTime::ZERO + SimDuration::from_secs(1), &[0.5, 1.0])?;
//! let mut angle = [0.0];
//! bench.observe(&mut angle);
//! assert!((0.3..0.5).contains(&angle[0]), "{angle:?}");
//! # Ok(())
//! # }
//! ```
//!
//! # Equations
//!
//! With the angle q, which is 0 where the arm hangs down up to the offset q₀, its rate ω, the duty
//! cycle d and the motor's current I:
//!
//! ```text
//! I = (d V − k ω)/(R_w + R_s d²)             |I| ≤ I_max
//! R_w = R (1 + α θ)        C θ' = R_w I² − C θ/T
//! τ_m = k I/(1 + |I|/I_s)  τ_g = −(m l + m_a l/2) g sin(q + q₀)
//! (J_m + J_l) ω' = τ_m + τ_g − s τ_f         J_l = m l² + m_a l²/3
//! ```
//!
//! V and `R_s` are the voltage and the resistance of the supply, whose mean current is d I. θ is
//! the rise of the temperature of the winding, α the temperature coefficient of copper. With the
//! torque off the bridge is open: I = 0, but where k |ω| exceeds V and the voltage of two diodes,
//! what exceeds them drives a current into the supply, which brakes. s is the direction of motion,
//! `τ_f` ≥ 0 the friction ([`Friction`](twinrig_robot::serial::Friction),
//! [`Gear`](twinrig_robot::serial::Gear)). A shaft at rest stays there while the other
//! torques do not exceed `τ_f` at rest; the instant at which it comes to rest is located within a
//! step.
//!
//! `I_s` is the current at which saturated iron takes half of the torque; without it the torque is
//! k I. Within the backlash of the gear motor and arm move alone, the arm without friction; where
//! teeth meet, the impact is perfectly inelastic, and where they would pull, they part.
//!
//! Not modelled: the inductance of the winding (delays of 0.1 ms), ripple of torque and supply, the
//! compliance of the gear. The induced voltage is k ω also where iron saturates: a motor that
//! brakes then heats its winding by more than it takes from the shaft.

mod backlash;
mod error;
mod file;
mod model;
mod parameters;
mod plant;
mod ranges;
mod shaft;
mod step;

pub use error::ServoBenchError;
pub use file::ServoBenchFile;
pub use parameters::{BenchLoad, ServoBenchParameters};
pub use plant::ServoBench;
