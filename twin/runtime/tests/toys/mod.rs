//! Toy parts: small enough to know what they must do, nasty enough to notice when they are treated
//! wrongly.
#![allow(dead_code, unused_imports, reason = "each test uses some of it")]

mod log;
mod plant;
mod process;
mod scene;
mod task;

pub use log::{Entry, Log};
pub use plant::ToyPlant;
pub use process::ToyProcess;
pub use scene::{Scene, any_scene};
pub use task::{Exchange, ToyTask, expected_exchange};
