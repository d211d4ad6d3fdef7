//! The robot with mass-less legs.
//!
//! Trunk and feet have mass, the segments between them have none (thesis, section 2.7): hip angle and foot position fix
//! the pose of a leg in closed form, and its springs push on foot and trunk as the gradient of their energy says. What the
//! thesis' version lacked is here: a knee cable that pulls and never pushes, friction in the joints, Coulomb friction and
//! slip on the ground.
//!
//! ```no_run
//! use twinrig_massless::{Massless, Options};
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let (robot, options): (twinrig_robot::Robot, Options) = todo!();
//! let mut plant = Massless::new(&robot, &options, &|signal| signal.starts_with("body/"))?;
//! plant.advance(twinrig_kernel::SimTime::from_nanos(1_000_000), &[0.0; 8])?;
//! # Ok(())
//! # }
//! ```
//!
//! What is not here: inertia of the segments (the full plant has it), the toe (its spring stays unloaded under a point
//! foot), abduction of the hips, collisions of anything but the feet, and the drives' electronics.

mod constraints;
mod drives;
mod flow;
mod ledger;
mod midpoint;
mod mobility;
mod model;
mod plant;
mod rows;
mod signals;
mod state;

pub use model::{Base, Drives, Force, MasslessError, Options};
pub use plant::Massless;
