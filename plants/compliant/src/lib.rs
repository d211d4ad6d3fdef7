//! Compliant constraints.
#![allow(
    clippy::inline_always,
    reason = "code with wider registers has to be inlined into the function that enables them"
)]

mod commands;
mod dynamics;
mod element;
mod flow;
mod flows;
pub mod frame;
mod friction;
mod ground;
pub mod lanes;
mod pantograph;
mod rk4;
mod servo;

pub use commands::Commands;
pub use element::{Element, Press};
pub use flow::{DriveState, Equations, Flow, FlowError, SavedCompliant, Step, TrunkState};
pub use flows::Flows;
pub use friction::{Approach, Grip, Sole};
pub use ground::{Below, Footforce, Point, TrunkMotion, broadcast};
pub use pantograph::{Depths, Internal, Joints, PantographConstants, Pantographs, Turns};
pub use rk4::{StepControl, StepError, StepWork, System};
pub use servo::{DriveLaws, ServoLaw};
