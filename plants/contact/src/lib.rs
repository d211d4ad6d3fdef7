//! Ground and complementarity: what holds a plant's one-sided constraints.
//!
//! [`Ground`] is a terrain with Coulomb friction and a restitution coefficient. [`Problem`] is a complementarity problem
//! over a cone: `w = G z + b` where each `z` is free, bounded, or lies in the friction disc of a normal force, and `w`
//! is what the bound leaves over. The same problem serves accelerations and forces (`G = J M⁻¹ Jᵀ`, w = g̈, z = λ) and
//! velocities and impulses (w = ġ⁺, z = P), for stops, cables, motors with a torque limit, and contacts alike.
//!
//! ```
//! use twinrig_contact::{Bound, Problem};
//! // A unit mass that falls at 2 m/s onto the ground: the impulse stops it.
//! let mut problem = Problem::default();
//! problem.reset(1);
//! problem.bound(0, Bound::NonNegative);
//! problem.set(0, 0, 1.0);
//! problem.offset(0, -2.0);
//! let solution = problem.solve().unwrap();
//! assert_eq!(problem.unknowns(), &[2.0]);
//! assert!(solution.residual < 1e-12);
//! ```
//!
//! What is not here: masses, bodies, time, and which constraints there are. Those are the plant's.

mod curvature;
mod dense;
mod direct;
mod gauss_seidel;
mod ground;
mod impact;
mod lemke;
mod newton;
mod problem;
mod residual;
mod solution;

pub use dense::{Factors, Singular};
pub use ground::{Ground, GroundError, HeightField, Surface, Terrain};
pub use impact::Restitution;
pub use problem::{Bound, Problem};
pub use solution::{Method, Solution, Unsolved};
