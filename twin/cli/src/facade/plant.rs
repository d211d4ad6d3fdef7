//! Plants: a [`Plant`] is the physics, which advances from one instant to the next and answers for
//! its signals. A [`PlantKind`] makes it known to scenarios.
//!
//! A plant of a legged robot implements [`Dynamics`](legged::Dynamics), which
//! [`LeggedPlant`](legged::LeggedPlant) turns into a plant with the ports, the start and the pushes
//! of every other; [`setup`] and [`pushes`] read the scenario for it. `twinrig::plant::lcp` and
//! `massless` are the builders of two plants, for kinds that vary them:
//!
//! ```
//! use twinrig::plant::{PlantKind, SimDuration, legged::Setup, massless, setup};
//!
//! let heavy = PlantKind::new("careful", "massless legs, only at steps up to 1 ms", |context| {
//!     let setup: Setup = setup(context, SimDuration::from_millis(1))?;
//!     if setup.step > SimDuration::from_millis(1) {
//!         return Err("the step has to be 1 ms or less".into());
//!     }
//!     massless(context)
//! });
//! let registry = twinrig::registry().with_plant(heavy);
//! assert!(registry.plants().any(|name| name == "careful"));
//! ```
//!
//! A plant of its own has ports, advances, answers, and saves and restores its whole state:
//!
//! ```
//! use std::path::Path;
//! use twinrig::plant::{
//!     EnergyBalance, Plant, PlantFault, PlantKind, Port, SimTime, Snapshot, SnapshotError, Unit,
//! };
//! use twinrig::{Assembly, Execution, Registry, Status, execute};
//!
//! /// A stone that falls from 100 m.
//! struct Stone { now: SimTime }
//!
//! fn ports() -> Vec<Port> { vec![Port::output("stone/height", Unit::Meter, 1)] }
//!
//! impl Plant for Stone {
//!     fn name(&self) -> &str { "stone" }
//!     fn ports(&self) -> Vec<Port> { ports() }
//!     fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
//!         self.now = to;
//!         Ok(())
//!     }
//!     fn observe(&mut self, outputs: &mut [f64]) {
//!         outputs[0] = 100.0 - 9.81 / 2.0 * self.now.as_secs_f64().powi(2);
//!     }
//!     fn energy(&self) -> EnergyBalance { EnergyBalance::default() }
//!     fn save(&self) -> Snapshot { Snapshot::of(&self.now) }
//!     fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
//!         self.now = snapshot.read()?;
//!         Ok(())
//!     }
//! }
//!
//! let stone = PlantKind::new("stone", "falls", |_| Ok(Stone { now: SimTime::ZERO }))
//!     .with_ports(|_| Ok(ports()));
//! let registry = twinrig::registry().with_plant(stone);
//! let scenario = r#"
//!     robot = "cheetah-cub"
//!     duration = "4 s"
//!     plant = { model = "stone" }
//!     observe = { period = "1 ms" }
//!     expect = [{ signal = { name = "stone/height", always = { min = "21.5 m" } } }]
//! "#;
//! let assembly = Assembly::builder(&registry).text("stone.toml", scenario, Path::new(""))?;
//! let report = execute(&assembly, &Execution::default())?;
//! assert_eq!((report.error, report.verdict), (None, Status::Pass));
//! # Ok::<(), twinrig::TwinError>(())
//! ```

pub use twinrig_actuator as actuator;
pub use twinrig_contact as contact;
pub use twinrig_legged as legged;

pub use twinrig_document::{DocumentError, Range};
pub use twinrig_kernel::{
    Direction, Field, Layout, Port, SignalKind, SimDuration, SimTime, Snapshot, SnapshotError,
    Unit, signal,
};
pub use twinrig_lcp::Lcp;
pub use twinrig_massless::Massless;
pub use twinrig_robot::Robot;
pub use twinrig_robot::leg::{LegCommand, LegError, Pantograph, Planar};
pub use twinrig_runtime::{
    CompositePlant, Coupling, EnergyBalance, FixedStepCoupling, GridInputs, NameClash, Plant,
    PlantEvent, PlantEventKind, PlantFault, PlantState, WorkCounts, ZeroGridStep,
};
pub use twinrig_scenario::{
    Accepts, ActuatorSpec, Kind, LegFact, OptionSpec, OptionValue, Options, PlantSpec, PushSpec,
};

pub use twinrig_rig::error::BuildError;
pub use twinrig_rig::parts::fmu_plant;
pub use twinrig_rig::parts::lcp::lcp;
pub use twinrig_rig::parts::massless::massless;
pub use twinrig_rig::parts::method::Method;
pub use twinrig_rig::parts::plant_kind::PlantKind;
pub use twinrig_rig::parts::setup::{legged_ports, pushes, setup};
pub use twinrig_rig::{Accuracy, ModelContext, PlantContext, StandaloneModel};
