//! Geometry and statics of the spring-loaded pantograph leg, derived independently of the thesis
//! and verified numerically.
//!
//! The leg has three segments. The hip motor rotates the first, the knee cable flexes the second,
//! and a rod with a spring keeps the third parallel to the first, which lets the pantograph open
//! under load. Two closed forms describe it: [`Pantograph::pose`] from hip angle and foot position,
//! used by the mass-less plant, and [`Pantograph::pose_of_angles`] from joint angles, used by the
//! full plant. Both return a [`Pose`], whose forces are gradients by virtual work.
//!
//! Conventions: the leg plane has x forward and z up, origin at the hip; link angles are absolute,
//! zero pointing straight down and positive swinging forward; hip angle and passive joints (q2, q3)
//! are zero in the reference pose, in which the leg is fully extended, the pantograph closed and
//! the foot vertically below the hip.
//!
//! ```
//! use twinrig_robot::leg::{Pantograph, Planar};
//! # fn main() -> Result<(), twinrig_robot::leg::LegError> {
//! let leg = Pantograph::new(&twinrig_robot::Leg::example())?;
//! let command = leg.inverse_closed(Planar::new(0.02, -0.13))?;
//! let first = command.hip + leg.hip_reference();
//! let pose = leg.pose(libm::sin(first), libm::cos(first), Planar::new(0.02, -0.13))?;
//! assert!((pose.parallel - 0.0714).abs() < 1e-12); // the pantograph is closed
//! # Ok(())
//! # }
//! ```
//!
//! Out of scope: masses and inertia, contact with the ground, friction, time. The thesis' appendix
//! A contains many misprints; where a formula here differs from it, the item's documentation says
//! so.

mod axial;
mod equilibrium;
mod error;
mod joints;
mod pantograph;
mod pose;
mod table;
#[cfg(test)]
mod tests;

pub use axial::LoadedLength;
pub use equilibrium::{Equilibrium, Stop};
pub use error::LegError;
pub use joints::{Jet, Joints, OpeningStop};
pub use pantograph::{LegCommand, Pantograph, Planar};
pub use pose::{Gradient, Length, Pose, Velocity};
pub use table::{EnergyTable, TableError};
