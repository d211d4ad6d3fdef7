//! The program `twin` as a library: from scenario files to verdicts, recordings and comparisons of
//! recordings. A crate that adds a custom controller, plant or bus to the [`Registry`] and calls
//! [`run`] is a program with all commands.
//!
//! ```no_run
//! use std::process::ExitCode;
//! use twinrig::kernel::{Port, SimDuration};
//! use twinrig::runtime::Process;
//! use twinrig::ControllerKind;
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
//!     twinrig::run(twinrig::registry().with_controller(lazy))
//! }
//! ```
//!
//! The modules [`controller`], [`plant`], [`bus`] and [`robot`] have what each kind of part needs,
//! `testing` (a cargo feature) harnesses for their tests: such a crate depends on `twinrig` alone.
//!
//! The crate `twinrig-rig` is the library without the program: it reads, runs and judges scenarios,
//! also where there is neither a terminal nor a system.
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | `commands` | a module for each command |
//! | `report` | the result of a run as a table and as `JUnit` XML |
//! | `thesis` | printed figures beside ours: a declaration for each item in `thesis/items`, with the basis of ours and a function that determines it; `thesis/flips` moves the numbers that items read |
//! | `robot_facts` | what follows from a robot file |
//! | `drawing` | a robot as SVG |
//! | `doctor` | the check of the machine, which a test replaces |
//! | `progress`, `interrupt` | progress lines, requests to end |
//!
//! This crate implements no physics, no controller and no protocol; it depends on the crates that
//! do, and none of them depends on it. The system clock affects reports and progress output only.

mod args;
mod commands;
mod date;
mod doctor;
mod drawing;
mod error;
mod examples;
mod facade;
mod interrupt;
mod progress;
mod report;
mod robot_facts;
mod thesis;
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
pub use twinrig_rig::{
    Accuracy, Assembly, BuildError, BuildKey, BusContext, BusKind, BusReport, ControllerContext,
    ControllerKind, Energy, Error, ErrorBar, ErrorSource, Execution, LegContext, Line,
    LineEnsemble, Method, ModelContext, PlantContext, PlantKind, RealTime, Registry, Report,
    RunLayouts, RunObserver, RunProgress, StandaloneModel, Status, WarningEntry, execute_observed,
    fmu, fmu_plant, lcp, massless,
};

pub use commands::{plan_json, recording_path, run, run_args, run_with};
pub use error::{ThesisError, TwinError};
pub use report::text;
pub use twinrig_experiment::{
    Error as ExperimentError, JobError, OptimizationOutcome, OptimizationProgress,
    OptimizationRequest, SweepEvent, SweepOutcome, SweepProgress, SweepRequest, SweepRows,
    WorkerJob, execute, optimize, sweep, with_ensemble, with_error_bars,
};

/// Returns the parts of this build: the standard ones, and the plants on engines whose cargo
/// features it has.
pub fn registry() -> Registry {
    let registry = Registry::standard();
    #[cfg(any(feature = "mujoco", feature = "rapier"))]
    let registry = twinrig_engines::register(registry);
    registry
}
