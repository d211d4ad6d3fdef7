//! Compliant constraints: the parts of a smooth formulation of a legged robot that its plants
//! share.
//!
//! Stops, cables and soles are one-sided springs with dampers ([`Element`]), and friction is a
//! bristle scaled by the load ([`Sole`]); the equations of motion have a continuous right-hand
//! side, without events, modes or complementarity problems. A plant implements [`Equations`];
//! [`Flow`] integrates them by the Runge–Kutta method of order 4 with error control
//! ([`StepControl`]), exponentially along a stiff [`Mode`] of each leg, keeps the energy balance,
//! and implements `Dynamics` of `twinrig-legged`. Four legs are computed side by side in the
//! [lanes] of the processor. The instants at which elements are compressed and released are
//! [events], which the method does not need. No stop lets a leg
//! through into another assembly mode ([stop]).
//!
//! ```
//! use twinrig_compliant::lanes::{Features, Kernel, Lanes, Quad, Simd, dispatch};
//! use twinrig_compliant::Element;
//! use twinrig_robot::OneSided;
//!
//! /// Force of four soles at given depths, compressed at no rate.
//! struct Force(Element<Quad>, Quad);
//!
//! impl Kernel for Force {
//!     type Output = Quad;
//!
//!     #[inline(always)]
//!     fn run<S: Simd>(self, simd: S) -> Quad {
//!         let depth = simd.load(self.1);
//!         self.0.load(simd).press(depth, depth.zero()).force.quad()
//!     }
//! }
//!
//! let sole = OneSided { stiffness: 10e3, damping: 40.0, toe_region: 0.2e-3 };
//! let soles = Element::side_by_side([sole; 4]);
//! let depths = Quad([-1e-3, 0.1e-3, 0.2e-3, 1.2e-3]);
//! let forces = dispatch(Features::Detected, Force(soles, depths));
//! // k t²/2δ in the toe region, k (x − δ/2) beyond it.
//! for (force, expected) in forces.0.into_iter().zip([0.0, 0.25, 1.0, 11.0]) {
//!     assert!((force - expected).abs() < 1e-12);
//! }
//! assert_eq!(forces, dispatch(Features::Portable, Force(soles, depths)));
//! ```
//!
//! Out of scope: equations of motion, which belong to the plants; restitution other than that of
//! the dampers; rolling and spinning friction.
#![allow(
    clippy::inline_always,
    reason = "code with wider registers has to be inlined into the function that enables them"
)]

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_compliant;

mod abduction;
mod body_contact;
mod commands;
mod dynamics;
mod element;
pub mod events;
mod flow;
mod flows;
pub mod frame;
mod friction;
mod ground;
pub mod lanes;
mod pantograph;
mod pushed;
mod rk4;
mod servo;
pub mod stop;
#[cfg(test)]
mod tests;

pub use abduction::{
    AbductionJoints, JointDrive, JointMotion, JointRow, JointState, LegBody, LegFrame, Limited,
    Resistance, SpatialSystem,
};
pub use body_contact::{BodyContact, BodyPoints, TrunkForce};
pub use commands::Commands;
pub use element::{Element, Press};
pub use flow::{
    AbductionState, DriveState, Equations, Flow, FlowError, SavedCompliant, Step, TrunkState,
};
pub use flows::Flows;
pub use friction::{Approach, Grip, Sole};
pub use ground::{Below, Footforce, Point, TrunkMotion, broadcast};
pub use pantograph::{Depths, Internal, Joints, PantographConstants, Pantographs, Tangent, Turns};
pub use pushed::Pushed;
pub use rk4::{
    Fastest, Missed, Mode, NoMode, StepControl, StepError, StepWork, Substep, System, Unseen,
};
pub use servo::{DriveLaws, ServoLaw};
