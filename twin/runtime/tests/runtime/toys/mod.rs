//! Toy parts with simple closed-form behaviour that reveals any error of the executor.
#![allow(dead_code, unused_imports, reason = "each test uses some of it")]

mod fixture;
mod log;
mod plant;
mod process;
mod task;

pub use fixture::{Fixture, any_fixture};
pub use log::{Entry, Log};
pub use plant::ToyPlant;
pub use process::ToyProcess;
pub use task::{ToyTask, WireTransfer, expected_transfer};
