//! The program `twin` as a library: from scenario files to verdicts, recordings and comparisons of
//! recordings. A crate that adds a custom controller, plant or bus to the [`Registry`] and calls
//! [`run`] is a program with all commands.
//!
//! ```no_run
//! use std::process::ExitCode;
//! use twinrig::kernel::{Port, SimDuration};
//! use twinrig::runtime::Process;
//! use twinrig::{ControllerKind, Registry};
//!
//! /// Commands nothing.
//! struct Lazy;
//! impl Process for Lazy {
//!     fn name(&self) -> &str { "lazy" }
//!     fn ports(&self) -> Vec<Port> { Vec::new() }
//!     fn step(&mut self, _: SimDuration, _: &[f64], _: &mut [f64]) {}
//! }
//!
//! fn main() -> ExitCode {
//!     let lazy = ControllerKind::new("lazy", "commands nothing", |_| Ok(Lazy));
//!     twinrig::run(Registry::standard().with_controller(lazy))
//! }
//! ```
//!
//! The modules [`controller`], [`plant`], [`bus`] and [`robot`] have what each kind of part needs,
//! `testing` (a cargo feature) harnesses for their tests: such a crate depends on `twinrig` alone.
//!
//! The feature `cli`, on by default, is the program: its commands, signals and terminal, and
//! [`run`]. Without it the crate is a library that reads, runs and judges scenarios, also where
//! there is neither a terminal nor a system.
//!
//! This crate implements no physics, no controller and no protocol; it depends on the crates that
//! do, and none of them depends on it. The system clock affects reports and progress output only.

#![cfg_attr(
    not(feature = "cli"),
    allow(
        dead_code,
        reason = "tables, files and progress lines that only the commands show"
    )
)]

#[cfg(feature = "cli")]
mod args;
mod assembly;
mod build_key;
#[cfg(feature = "cli")]
mod commands;
#[cfg(feature = "cli")]
mod doctor;
#[cfg(feature = "cli")]
mod drawing;
mod ensemble;
mod error;
#[cfg(feature = "cli")]
mod examples;
mod facade;
pub mod fmu;
mod optimize;
mod parts;
mod progress;
#[cfg(feature = "cli")]
mod radius;
mod registry;
mod report;
#[cfg(feature = "cli")]
mod robot_facts;
mod run;
#[cfg(feature = "cli")]
mod study;
mod sweep;
#[cfg(feature = "cli")]
mod thesis;
mod twin_error;
#[cfg(feature = "cli")]
mod version;

pub use twinrig_campaign as campaign;
pub use twinrig_document as document;
pub use twinrig_kernel as kernel;
pub use twinrig_record as record;
pub use twinrig_runtime as runtime;
pub use twinrig_scenario as scenario;

#[cfg(feature = "testing")]
pub use facade::testing;
pub use facade::{bus, controller, plant, prelude, robot};

pub use assembly::Assembly;
pub use build_key::BuildKey;
#[cfg(feature = "cli")]
pub use commands::{plan_json, recording_path, run, run_args, run_with};
pub use ensemble::{execute, with_ensemble};
pub use error::{BuildError, Error};
pub use optimize::execute::{
    OptimizationOutcome, OptimizationProgress, OptimizationRequest, optimize,
};
pub use parts::bus_kind::{BusContext, BusKind};
pub use parts::controller_kind::{ControllerContext, ControllerKind, LegContext};
pub use parts::fmu_plant;
pub use parts::lcp::lcp;
pub use parts::massless::massless;
pub use parts::method::Method;
pub use parts::plant_kind::{ModelContext, PlantContext, PlantKind, StandaloneModel};
pub use registry::Registry;
pub use report::{BusReport, Energy, Line, LineEnsemble, RealTime, Report, Status, Warned};
pub use run::execute::{Execution, execute_observed};
pub use run::observers::{RunLayouts, RunObserver, RunProgress};
pub use sweep::execute::{SweepEvent, SweepOutcome, SweepProgress, SweepRequest, sweep};
pub use sweep::job::{JobError, WorkerJob};
#[cfg(feature = "cli")]
pub use thesis::error::ThesisError;
pub use twin_error::TwinError;
