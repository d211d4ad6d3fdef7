//! Compliant constraints.
#![allow(
    clippy::inline_always,
    reason = "code with wider registers has to be inlined into the function that enables them"
)]

mod element;
mod friction;
pub mod lanes;
mod rk4;
mod servo;

pub use element::{Element, Press};
pub use friction::{Approach, Grip, Sole};
pub use rk4::{StepControl, StepError, StepWork, System};
pub use servo::ServoLaw;
