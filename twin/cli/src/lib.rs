//! The rig as a program: from scenario files to verdicts, recordings and comparisons of recordings. A crate with a
//! controller, a plant or a bus of its own hands them to [`run`] and is a program with all the commands.
//!
//! ```no_run
//! use std::process::ExitCode;
//! use twinrig::kernel::{Port, SimDuration, Snapshot, SnapshotError};
//! use twinrig::runtime::Process;
//! use twinrig::{ControllerKind, Registry};
//!
//! /// Commands nothing.
//! struct Lazy;
//! impl Process for Lazy {
//!     fn name(&self) -> &str { "lazy" }
//!     fn ports(&self) -> Vec<Port> { Vec::new() }
//!     fn step(&mut self, _: SimDuration, _: &[f64], _: &mut [f64]) {}
//!     fn save(&self) -> Snapshot { Snapshot::of(&()) }
//!     fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> { snapshot.read() }
//! }
//!
//! fn main() -> ExitCode {
//!     let lazy = ControllerKind::new("lazy", "commands nothing", |_| Ok(Lazy));
//!     twinrig::run(Registry::standard().with_controller(lazy))
//! }
//! ```
//!
//! What it does not do: it holds no physics, no controller and no protocol; it knows them, and nobody knows it. Clocks of
//! the machine appear in its reports and nowhere else.

mod analog_sources;
mod args;
mod assembly;
mod body;
mod bus_kind;
mod buses;
mod commands;
mod continuation;
mod controller_kind;
mod coupling;
mod coupling_builder;
mod coupling_table;
mod drives;
mod error;
mod execute;
mod executor;
mod grid;
mod hardware;
mod idle;
mod interrupt;
mod judging;
mod junit;
mod lcp;
mod massless;
mod method;
mod mjcf;
#[cfg(feature = "mujoco")]
mod model_file;
#[cfg(feature = "mujoco")]
mod mujoco;
mod observers;
mod option;
mod optoforce;
mod output_filter;
mod paint;
mod phidget;
mod plant_kind;
mod progress;
#[cfg(feature = "rapier")]
mod rapier;
mod rb110;
mod recording_size;
mod registry;
mod report;
mod sbcp;
mod script;
mod setup;
mod sources;
mod standard;
mod study_builder;
mod study_table;
mod table;
mod timing;

pub use twinrig_kernel as kernel;
pub use twinrig_robot as robot;
pub use twinrig_runtime as runtime;
pub use twinrig_scenario as scenario;

pub use assembly::Assembly;
pub use bus_kind::{BusContext, BusKind};
pub use commands::{run, run_with};
pub use controller_kind::{ControllerContext, ControllerKind, LegContext};
pub use error::TwinError;
pub use execute::{Execution, execute};
pub use lcp::lcp;
pub use massless::massless;
pub use method::Method;
pub use plant_kind::{ModelContext, PlantContext, PlantKind, StandaloneModel};
pub use registry::{BuildError, Registry};
pub use report::{Energy, Line, RealTime, Report, Status, Warned};
