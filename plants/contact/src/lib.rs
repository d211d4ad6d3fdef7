//! Ground model and complementarity solvers for the unilateral constraints of plants.
//!
//! [`Ground`] is a terrain with Coulomb friction and a restitution coefficient. [`Problem`] is a
//! complementarity problem over a cone: `w = G z + b` where each `z` is free, bounded, or lies in
//! the friction disc of a normal force, and `w` is the residual that is complementary to the bound.
//! The same problem serves accelerations and forces (`G = J M⁻¹ Jᵀ`, w = g̈, z = λ) and velocities
//! and impulses (w = ġ⁺, z = P), for stops, cables, motors with a torque limit, and contacts.
//!
//! ```
//! use twinrig_contact::{Bound, Problem};
//! // A unit mass hits the ground at 2 m/s: the impulse stops it.
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
//! # Choice of method
//!
//! [`Problem::solve`] uses Newton's method; [`Problem::solve_by`] takes a [`Method`].
//!
//! - [`Method::Newton`] for sequences of similar problems: it is the fastest, in particular from a
//!   guess, and exact for friction discs. It requires a definite G (which [`Problem::soften`]
//!   provides, by a relative compliance of 1e-9, say) and may fail. On a singular G it may also
//!   return extremely large forces, which solve the problem as perturbed by rounding.
//! - [`Method::Direct`] where reliability matters or infeasibility has to be proved: redundant or
//!   contradictory stops, events, references. Without friction it solves every solvable problem
//!   with symmetric positive semidefinite G, and proves the others infeasible
//!   ([`SolveError::Infeasible`]). With friction, pivoting solves the problem for a pyramid of
//!   eight sides, from which Newton's method continues to the disc; neither a solution nor a proof
//!   is guaranteed.
//! - [`Method::GaussSeidel`] for comparison: the method of the thesis (2.4). Each sweep is cheap,
//!   but many are needed unless the contacts have degrees of freedom of their own. The
//!   approximation is kept if the sweeps run out.
//!
//! All three report the residual of [`Problem::residual`], and none accepts a solution beyond its
//! tolerance. With friction a problem may have no solution or several; then the methods may differ.
//!
//! Nanoseconds per problem from a zero guess, on a shared machine of two cores (`cargo bench -p
//! twinrig-contact`; random rows, residual 1e-9 of the greatest offset):
//!
//! ```text
//!  rows                         Newton   Direct   sweeps (ω = 1.2)
//!  2 stops                         120      140      300
//!  4 stops                         190      270      800
//!  6 stops                         350      420     1700
//!  12 stops                        830     1300     4900
//!  12 stops, 6 degrees of freedom 3500     1400     3 of 16 fail in 10 000 sweeps
//!  1 foot, 3 rows                  330      910      880
//!  2 feet, 6 rows                  670     3200      820
//!  4 feet, 12 rows                2300    14000     2900
//! ```
//!
//! # Impacts
//!
//! [`Problem::impact`] computes impulses by [`Restitution`]: Newton's law of rates or Poisson's law
//! of impulses. Without restitution the two coincide. Poisson's law never increases the energy,
//! whatever the friction and the coefficients.
//!
//! # Curved ground
//!
//! [`Ground::below`] returns gap and normal, [`Ground::gap_curvature`] the curvature term of the
//! gap's acceleration, g̈ = ∇g·a + vᵀ∇²g v.
//!
//! [`Ground::friction_at`] returns the coefficient of friction, which patches of the ground change
//! by place and time.
//!
//! Masses, bodies, and the set of constraints are left to the plant.

#![allow(
    clippy::inline_always,
    reason = "inlining passes literal lengths to the loops and keeps values in registers"
)]

mod bound;
mod curvature;
mod dense;
mod direct;
mod gauss_seidel;
mod ground;
mod impact;
mod lemke;
mod levels;
mod newton;
mod patch;
mod problem;
mod residual;
mod solution;
mod surface;
mod workspace;

pub use bound::Bound;
pub use dense::{Factors, Singular};
pub use ground::{Ground, GroundError, HeightField, Terrain};
pub use impact::Restitution;
pub use levels::Levels;
pub use patch::Patch;
pub use problem::Problem;
pub use solution::{Method, Solution, SolveError};
pub use surface::Surface;
