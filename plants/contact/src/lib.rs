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
//! # Which method
//!
//! [`Problem::solve`] is Newton's; [`Problem::solve_by`] takes a [`Method`].
//!
//! - [`Method::Newton`] where steps follow each other: it is the fastest, the more so from a guess, and exact in friction
//!   discs. It asks for a definite G ([`Problem::soften`] makes one, by a billionth, say) and may give up. On a singular G
//!   it may also answer with forces beyond measure, which solve what rounding made of the problem.
//! - [`Method::Direct`] where the answer has to be right at the first go, or "there is none" has to be known: stops that
//!   repeat or contradict each other, events, references. Without friction it solves whatever can be solved, for symmetric
//!   positive semidefinite G, and proves the rest infeasible ([`Unsolved::Infeasible`]). With friction pivots decide for a
//!   pyramid of eight sides, and Newton's method goes from there to the disc; neither a solution nor a proof is promised.
//! - [`Method::GaussSeidel`] to compare with: it is what the thesis used (2.4). Each sweep is cheap and their number is
//!   not, but for contacts of which each has freedoms of its own. Its approximation stays if the sweeps run out.
//!
//! All three give the residual of [`Problem::residual`], and none takes for solved what exceeds its tolerance. Friction
//! leaves problems with no solution and with several; then methods need not agree.
//!
//! Nanoseconds a problem from no guess, on a machine of two cores that others used as well (`cargo bench -p
//! twinrig-contact`; random rows, residual 1e-9 of the greatest offset):
//!
//! ```text
//!  rows                         Newton   Direct   sweeps (ω = 1.2)
//!  2 stops                         120      140      300
//!  4 stops                         190      270      800
//!  6 stops                         350      420     1700
//!  12 stops                        830     1300     4900
//!  12 stops of 6 freedoms         3500     1400     3 of 16 not within 10 000 sweeps
//!  1 foot, 3 rows                  330      910      880
//!  2 feet, 6 rows                  670     3200      820
//!  4 feet, 12 rows                2300    14000     2900
//! ```
//!
//! # Impacts
//!
//! [`Problem::impact`] finds impulses by [`Restitution`]: Newton's law of rates or Poisson's law of impulses. Without
//! restitution they are one. Poisson's never gives energy, whatever the friction and the coefficients.
//!
//! # Curved ground
//!
//! [`Ground::below`] gives gap and normal. What the shape adds to the gap's acceleration, g̈ = ∇g·a + vᵀ∇²g v, is
//! [`Ground::gap_curvature`].
//!
//! What is not here: masses, bodies, time, and which constraints there are. Those are the plant's.

#![allow(
    clippy::inline_always,
    reason = "only inlined does a literal length reach the loops, and do numbers stay in registers"
)]

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
